#include <gtest/gtest.h>

#include "server/http/sse.h"

namespace server {
namespace {

TEST(HttpSse, WritesTheFieldsAndAnEmptyLine) {
  EXPECT_EQ(format_sse({.id = "s-1", .event = "tile", .data = "{}"}),
            "id: s-1\nevent: tile\ndata: {}\n\n");
  EXPECT_EQ(format_sse({.event = "overloaded", .data = "", .retry_ms = 15000}),
            "event: overloaded\nretry: 15000\ndata: \n\n");
}

TEST(HttpSse, EveryLineOfDataIsAField) {
  EXPECT_EQ(format_sse({.data = "a\nb\r\nc\rd"}), "data: a\ndata: b\ndata: c\ndata: d\n\n");
}

TEST(HttpSse, LineBreakInTheNameCannotStartAField) {
  EXPECT_EQ(format_sse({.event = "x\ndata: evil", .data = "a"}), "event: xdata: evil\ndata: a\n\n");
}

TEST(HttpSse, WritesCommentsThatClientsSkip) {
  EXPECT_EQ(format_sse_comment("ping"), ": ping\n\n");
}

TEST(HttpSse, IdsRoundTrip) {
  const auto id = parse_sse_id(format_sse_id("k3f0", 42));
  ASSERT_TRUE(id);
  EXPECT_EQ(id->stream, "k3f0");
  EXPECT_EQ(id->seq, 42U);
}

TEST(HttpSse, RefusesOtherIds) {
  for (const char* text : {"", "-", "a-", "-1", "A-1", "a-1x", "a--1", "a-9223372036854775808"}) {
    EXPECT_FALSE(parse_sse_id(text)) << text;
  }
  EXPECT_FALSE(parse_sse_id(std::string(65, 'a') + "-1"));
}

TEST(HttpSse, ReadsLastEventIdFromTheHeaderOrTheQuery) {
  Request request;
  EXPECT_FALSE(last_event_id(request));
  request.query_params.emplace_back("last_event_id", "q-1");
  EXPECT_EQ(last_event_id(request).value().stream, "q");
  request.headers.add("last-event-id", "h-2");
  EXPECT_EQ(last_event_id(request).value().stream, "h");
}

}  // namespace
}  // namespace server
