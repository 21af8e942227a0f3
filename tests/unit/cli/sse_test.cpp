#include "clients/cli/sse.h"

#include <gtest/gtest.h>

namespace {

TEST(EventParser, ReadsTypeDataAndId) {
  cli::EventParser parser;
  const auto events = parser.feed("id: a-1\nevent: state\ndata: {\"x\":1}\n\n");
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].type, "state");
  EXPECT_EQ(events[0].data, "{\"x\":1}");
  EXPECT_EQ(parser.last_id(), "a-1");
}

TEST(EventParser, GivesTheSameEventsForAnyChunks) {
  const std::string stream = "event: a\r\ndata: 1\r\ndata: 2\r\n\r\n: ping\r\rdata:3\n\n";
  for (std::size_t cut = 0; cut <= stream.size(); ++cut) {
    cli::EventParser parser;
    auto events = parser.feed(stream.substr(0, cut));
    for (auto& event : parser.feed(stream.substr(cut))) {
      events.push_back(std::move(event));
    }
    ASSERT_EQ(events.size(), 2U) << "split at " << cut;
    EXPECT_EQ(events[0].type, "a");
    EXPECT_EQ(events[0].data, "1\n2");
    EXPECT_EQ(events[1].type, "message");
    EXPECT_EQ(events[1].data, "3");
  }
}

TEST(EventParser, SkipsComments) {
  cli::EventParser parser;
  EXPECT_TRUE(parser.feed(": ping\n\n").empty());
}

TEST(EventParser, DiscardsAnUnfinishedEventAfterARestart) {
  cli::EventParser parser;
  parser.feed("id: s-1\ndata: 1\n\nid: s-2\ndata: 2\n");
  parser.restart();
  EXPECT_EQ(parser.last_id(), "s-1");
  const auto events = parser.feed("data: 3\n\n");
  ASSERT_EQ(events.size(), 1U);
  EXPECT_EQ(events[0].data, "3");
}

TEST(EventParser, StoresTheRetryDelay) {
  cli::EventParser parser;
  parser.feed("retry: 2500\n\n");
  EXPECT_EQ(parser.retry_ms(), 2500);
}

}  // namespace
