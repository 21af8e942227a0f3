#include "server/guard.h"

#include <memory>

#include <gtest/gtest.h>

#include "server/store/database.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::Config;
using server::Request;
using std::chrono::seconds;

/// A guard with a store of its own.
class Guard {
 public:
  explicit Guard(const Config& config)
      : config_(config),
        database_(*server::Database::open(folder_.file("test.db"))),
        keys_(*database_),
        ring_(config_, keys_),
        guard_(config_, ring_, tickets_) {}

  std::optional<server::Response> check(Request& request) const { return guard_.check(request); }
  server::Response start_session(const Request& request) const { return guard_.start_session(request); }
  server::KeyTable& keys() { return keys_; }

 private:
  const Config config_;
  test_support::TemporaryFolder folder_;
  std::unique_ptr<server::Database> database_;
  server::KeyTable keys_;
  server::KeyRing ring_;
  server::Tickets tickets_;
  mutable server::Guard guard_;
};

Request request(std::string method, std::string route, std::string host = "localhost:8080") {
  Request made;
  made.method = std::move(method);
  made.route = route;
  made.path = std::move(route);
  made.headers.set("Host", host);
  return made;
}

int status_of(const Guard& guard, Request asked) {
  const auto answer = guard.check(asked);
  return answer ? answer->status : 0;
}

TEST(Guard, AnswersToLoopbackNamesAndTheNamedHosts) {
  Config config;
  config.hosts = {"render.example"};
  const Guard guard(config);
  for (const char* host : {"localhost", "127.0.0.1:99", "[::1]:8080", "render.example:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 0) << host;
  }
  for (const char* host : {"evil.example", "", "localhost.evil.example", "127.0.0.1.nip.example:8080"}) {
    EXPECT_EQ(status_of(guard, request("GET", "/v1/jobs", host)), 421) << host;
  }
}

TEST(Guard, ProbesAnswerToAnyHostWithoutAKey) {
  Config config;
  config.key = "k";
  EXPECT_EQ(status_of(Guard(config), request("GET", "/livez", "10.1.2.3")), 0);
}

TEST(Guard, PagesOfOtherOriginsAreRefusedUnlessNamed) {
  Config config;
  config.origins = {"https://studio.example"};
  const Guard guard(config);
  auto asked = request("POST", "/v1/jobs");
  asked.headers.set("Origin", "http://localhost:8080");
  EXPECT_EQ(status_of(guard, asked), 0);
  asked.headers.set("Origin", "https://studio.example");
  EXPECT_EQ(status_of(guard, asked), 0);
  for (const char* origin : {"https://evil.example", "null", "http://localhost:9999"}) {
    asked.headers.set("Origin", origin);
    EXPECT_EQ(status_of(guard, asked), 403) << origin;
  }
}

TEST(Guard, TheKeyComesAsBearerTokenOrCookie) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  auto asked = request("GET", "/v1/jobs");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer wrong");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer secret");
  EXPECT_EQ(status_of(guard, asked), 0);

  const auto session = guard.start_session(asked);
  const auto cookie = session.headers.find("Set-Cookie");
  ASSERT_TRUE(cookie);
  EXPECT_NE(cookie->find("HttpOnly"), std::string_view::npos);
  EXPECT_NE(cookie->find("SameSite=Strict"), std::string_view::npos);
  EXPECT_EQ(cookie->find("secret"), std::string_view::npos);
  auto by_cookie = request("GET", "/v1/jobs");
  by_cookie.headers.set("Cookie", "a=b; " + std::string(cookie->substr(0, cookie->find(';'))));
  EXPECT_EQ(status_of(guard, by_cookie), 0);
}

TEST(Guard, ThePageAndTheDescriptionNeedNoKey) {
  Config config;
  config.key = "secret";
  const Guard guard(config);
  for (const char* path : {"/", "/docs", "/openapi.json"}) {
    EXPECT_EQ(status_of(guard, request("GET", path)), 0) << path;
  }
  EXPECT_EQ(status_of(guard, request("GET", "/v1/server")), 401);
  EXPECT_EQ(status_of(guard, request("POST", "/v1/jobs")), 401);
}

TEST(Guard, AStoredKeyIsKnownByItsHashAndByItsScopes) {
  Config config;
  Guard guard(config);
  server::MadeKey made = server::make_key("studio");
  made.row.may_write = false;
  ASSERT_TRUE(guard.keys().insert(made.row));
  EXPECT_EQ(made.row.token_hash.find(made.token), std::string::npos);
  auto asked = request("GET", "/v1/jobs");
  EXPECT_EQ(status_of(guard, asked), 401);
  asked.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_FALSE(guard.check(asked));
  EXPECT_EQ(asked.principal, made.row.id);
  auto submits = request("POST", "/v1/jobs");
  submits.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_EQ(status_of(guard, submits), 403);
  for (const std::string& wrong : {made.row.token_hash, made.row.session_hash, made.row.id}) {
    asked.headers.set("Authorization", "Bearer " + wrong);
    EXPECT_EQ(status_of(guard, asked), 401);
  }
}

TEST(Guard, AnExpiredKeyIsNone) {
  Guard guard{Config()};
  server::MadeKey made = server::make_key("old");
  made.row.expires_at = 1000;
  ASSERT_TRUE(guard.keys().insert(made.row));
  auto asked = request("GET", "/v1/jobs");
  asked.headers.set("Authorization", "Bearer " + made.token);
  EXPECT_EQ(status_of(guard, asked), 401);
}

TEST(Tickets, AreForTheirJobsAndForAMinute) {
  server::Tickets tickets;
  const auto now = server::Tickets::Clock::now();
  const auto ticket = tickets.issue({"a", "b"}, "me", now);
  ASSERT_TRUE(ticket);
  EXPECT_EQ(tickets.holder_of(*ticket, {"a"}, now), "me");
  EXPECT_EQ(tickets.holder_of(*ticket, {"b", "a"}, now), "me");
  EXPECT_FALSE(tickets.holder_of(*ticket, {"a", "c"}, now));
  EXPECT_FALSE(tickets.holder_of(*ticket, {}, now));
  EXPECT_FALSE(tickets.holder_of("other", {"a"}, now));
  EXPECT_TRUE(tickets.holder_of(*ticket, {"a"}, now + seconds(59)));
  EXPECT_FALSE(tickets.holder_of(*ticket, {"a"}, now + seconds(60)));
}

TEST(Tickets, AreLimitedInNumberUntilTheyEnd) {
  server::Tickets tickets;
  const auto now = server::Tickets::Clock::now();
  for (std::size_t i = 0; i < server::Tickets::kMax; ++i) {
    ASSERT_TRUE(tickets.issue({"a"}, "", now));
  }
  EXPECT_FALSE(tickets.issue({"a"}, "", now));
  EXPECT_TRUE(tickets.issue({"a"}, "", now + seconds(61)));
}

TEST(RateLimiter, FillsSteadilyUpToOneMinute) {
  server::RateLimiter rates;
  const auto now = server::RateLimiter::Clock::now();
  for (int i = 0; i < 60; ++i) {
    const auto state = rates.take("k", 60, now);
    EXPECT_TRUE(state.allowed);
    EXPECT_EQ(state.remaining, 59 - i);
  }
  const auto refused = rates.take("k", 60, now);
  EXPECT_FALSE(refused.allowed);
  EXPECT_EQ(refused.reset_seconds, 1);
  EXPECT_TRUE(rates.take("other", 60, now).allowed);
  EXPECT_TRUE(rates.take("k", 60, now + seconds(1)).allowed);
  EXPECT_FALSE(rates.take("k", 60, now + seconds(1)).allowed);
  EXPECT_EQ(rates.take("k", 60, now + seconds(3600)).remaining, 59);
  EXPECT_FALSE(rates.last("nobody"));
}

}  // namespace
