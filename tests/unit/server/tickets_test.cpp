#include "server/auth/tickets.h"

#include <chrono>
#include <cstddef>

#include <gtest/gtest.h>

namespace {

using std::chrono::seconds;

TEST(Tickets, AreValidForTheirJobsAndForAMinute) {
  server::Tickets tickets;
  const auto now = server::Tickets::Clock::now();
  const auto ticket = tickets.issue({"a", "b"}, {.key = "me", .access = {}}, now);
  ASSERT_TRUE(ticket);
  EXPECT_EQ(tickets.holder_of(*ticket, {"a"}, now)->key, "me");
  EXPECT_EQ(tickets.holder_of(*ticket, {"b", "a"}, now)->key, "me");
  EXPECT_FALSE(tickets.holder_of(*ticket, {"a", "c"}, now));
  EXPECT_FALSE(tickets.holder_of(*ticket, {}, now));
  EXPECT_FALSE(tickets.holder_of("other", {"a"}, now));
  EXPECT_TRUE(tickets.holder_of(*ticket, {"a"}, now + seconds(59)));
  EXPECT_FALSE(tickets.holder_of(*ticket, {"a"}, now + seconds(60)));
}

TEST(Tickets, AreLimitedInNumberUntilTheyExpire) {
  server::Tickets tickets;
  const auto now = server::Tickets::Clock::now();
  for (std::size_t i = 0; i < server::Tickets::kMax; ++i) {
    ASSERT_TRUE(tickets.issue({"a"}, {}, now));
  }
  EXPECT_FALSE(tickets.issue({"a"}, {}, now));
  EXPECT_TRUE(tickets.issue({"a"}, {}, now + seconds(61)));
}

TEST(Tickets, OfOneTenantLeaveSomeForOthers) {
  server::Tickets tickets;
  const auto now = server::Tickets::Clock::now();
  const server::Tickets::Holder busy = {.key = "b", .access = server::Access::of("b")};
  for (std::size_t i = 0; i < server::Tickets::kMaxOfTenant; ++i) {
    ASSERT_TRUE(tickets.issue({"a"}, busy, now));
  }
  EXPECT_FALSE(tickets.issue({"a"}, busy, now));
  EXPECT_TRUE(tickets.issue({"a"}, {.key = "a", .access = server::Access::of("a")}, now));
}

}  // namespace
