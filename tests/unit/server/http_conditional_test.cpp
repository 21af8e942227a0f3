#include <gtest/gtest.h>

#include "server/http/conditional.h"

namespace server {
namespace {

TEST(HttpConditional, WeakComparisonIgnoresWeakness) {
  EXPECT_TRUE(etag_matches_weakly("\"a\"", "\"a\""));
  EXPECT_TRUE(etag_matches_weakly("W/\"a\"", "\"a\""));
  EXPECT_TRUE(etag_matches_weakly("\"x\", W/\"a\"", "W/\"a\""));
  EXPECT_FALSE(etag_matches_weakly("\"b\"", "\"a\""));
}

TEST(HttpConditional, StrongComparisonRequiresTwoStrongTags) {
  EXPECT_TRUE(etag_matches_strongly("\"b\", \"a\"", "\"a\""));
  EXPECT_FALSE(etag_matches_strongly("W/\"a\"", "\"a\""));
  EXPECT_FALSE(etag_matches_strongly("\"a\"", "W/\"a\""));
}

TEST(HttpConditional, StarMatchesEverything) {
  EXPECT_TRUE(etag_matches_weakly("*", "\"a\""));
  EXPECT_TRUE(etag_matches_strongly(" * ", "\"a\""));
}

TEST(HttpConditional, CommaInsideATagIsPartOfIt) {
  EXPECT_TRUE(etag_matches_weakly("\"x,y\", \"z\"", "\"x,y\""));
  EXPECT_FALSE(etag_matches_weakly("\"x,y\"", "\"x\""));
}

TEST(HttpConditional, UnquotedTagsMatchNothing) {
  EXPECT_FALSE(etag_matches_weakly("a", "\"a\""));
  EXPECT_FALSE(etag_matches_weakly("\"a", "\"a\""));
}

TEST(HttpConditional, CompressedBodyKeepsItsTag) {
  EXPECT_TRUE(etag_matches_weakly("\"a-gzip\"", "\"a\""));
  EXPECT_TRUE(etag_matches_strongly("\"a-gzip\"", "\"a\""));
}

TEST(HttpConditional, OnlyReadsAreNotModified) {
  Request request;
  request.method = "GET";
  request.headers.add("If-None-Match", "\"a\"");
  EXPECT_TRUE(is_not_modified(request, "\"a\""));
  EXPECT_FALSE(is_not_modified(request, "\"b\""));
  request.method = "PUT";
  EXPECT_FALSE(is_not_modified(request, "\"a\""));
}

TEST(HttpConditional, IfMatchHoldsIfAbsent) {
  Request request;
  EXPECT_TRUE(precondition_holds(request, "\"a\""));
  request.headers.add("If-Match", "\"b\"");
  EXPECT_FALSE(precondition_holds(request, "\"a\""));
  request.headers.add("If-Match", "\"a\"");
  EXPECT_TRUE(precondition_holds(request, "\"a\""));
}

}  // namespace
}  // namespace server
