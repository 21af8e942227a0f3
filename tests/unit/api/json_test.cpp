#include "api/json/json.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace {

constexpr std::size_t kBytes = 1U << 20U;

api::Problem problem_of(const std::string& text) {
  const auto parsed = api::parse_json(text, kBytes);
  EXPECT_FALSE(parsed) << text;
  return parsed ? api::Problem{} : parsed.problem();
}

struct BrokenCase {
  std::string text;
  std::string byte;  ///< of the offset, as shown
};
class BrokenJson : public testing::TestWithParam<BrokenCase> {};

TEST_P(BrokenJson, Is400WithTheByteOffset) {
  const api::Problem problem = problem_of(GetParam().text);
  EXPECT_EQ(problem.status, 400);
  EXPECT_TRUE(problem.detail.ends_with("at byte " + GetParam().byte + ".")) << problem.detail;
  EXPECT_EQ(problem.detail.find("exception"), std::string::npos) << problem.detail;
}

INSTANTIATE_TEST_SUITE_P(
    Table, BrokenJson,
    testing::Values(BrokenCase{"{", "1"}, BrokenCase{"[1,]", "3"}, BrokenCase{"{\"a\" 1}", "5"},
                    BrokenCase{"{} {}", "3"}, BrokenCase{"NaN", "0"}, BrokenCase{"[Infinity]", "1"},
                    BrokenCase{"{'a':1}", "1"}, BrokenCase{"[1] // no", "4"},
                    BrokenCase{"[01]", "2"}, BrokenCase{"[+1]", "1"}, BrokenCase{"[.5]", "1"},
                    BrokenCase{"\"\xff\"", "1"}, BrokenCase{"\"\xc0\x80\"", "1"},
                    BrokenCase{"\"\xed\xa0\x80\"", "2"}, BrokenCase{"\"\\ud800\"", "7"},
                    BrokenCase{std::string("\"a\0b\"", 5), "2"}, BrokenCase{"tru", "3"}));

TEST(ParseJson, ReportsAnEmptyBody) {
  for (const char* text : {"", "  \r\n\t"}) {
    const api::Problem problem = problem_of(text);
    EXPECT_EQ(problem.status, 400);
    EXPECT_EQ(problem.detail, "The body is empty; JSON was expected.");
  }
}

TEST(ParseJson, RefusesARepeatedMemberWithItsPointer) {
  const api::Problem problem = problem_of(R"({"a":[{"b":1,"c":{"x/y":1,"x/y":2}}]})");
  EXPECT_EQ(problem.status, 422);
  ASSERT_EQ(problem.errors.size(), 1U);
  EXPECT_EQ(problem.errors[0].pointer, "/a/0/c/x~1y");
  EXPECT_EQ(problem.errors[0].detail, "appears more than once");
}

TEST(ParseJson, AcceptsEqualNamesInDifferentObjects) {
  EXPECT_TRUE(api::parse_json(R"([{"a":1},{"a":{"a":2}}])", kBytes));
}

TEST(ParseJson, RefusesNumbersOutsideTheRangeOfDouble) {
  for (const char* number : {"1e999", "-1e999", "1e400"}) {
    const api::Problem problem = problem_of(std::string(R"({"a":[0,)") + number + "]}");
    EXPECT_EQ(problem.status, 422);
    ASSERT_EQ(problem.errors.size(), 1U);
    EXPECT_EQ(problem.errors[0].pointer, "/a/1");
    EXPECT_EQ(problem.errors[0].detail, std::string(number) + " is too large for a number");
  }
}

TEST(ParseJson, LimitsTheDepth) {
  const std::string open(32, '[');
  const std::string close(32, ']');
  EXPECT_TRUE(api::parse_json(open + close, kBytes));
  const api::Problem problem = problem_of("[" + open + close + "]");
  EXPECT_EQ(problem.status, 422);
  EXPECT_EQ(problem.errors[0].detail, "is nested deeper than 32 levels");
  EXPECT_EQ(problem_of(std::string(kBytes, '[')).status, 422);
}

TEST(ParseJson, LimitsTheSizeAndTheNamesOfMembers) {
  EXPECT_EQ(problem_of(std::string(kBytes + 1, ' ')).status, 413);
  EXPECT_TRUE(api::parse_json("{\"" + std::string(1024, 'a') + "\":1}", kBytes));
  EXPECT_EQ(problem_of("{\"" + std::string(1025, 'a') + "\":1}").errors[0].detail,
            "has a member name longer than 1024 bytes");
}

TEST(ParseJson, ReadsManyMembersInLinearTime) {
  // A quadratic search through 100,000 members would take minutes.
  std::string text = "{";
  for (int i = 0; i < 100000; ++i) {
    text += (i == 0 ? "\"" : ",\"") + std::to_string(i) + "\":1";
  }
  const auto parsed = api::parse_json(text + "}", std::size_t{4} << 20U);
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->size(), 100000U);
}

TEST(ParseJson, KeepsValuesAndTheirOrder) {
  const std::string text = R"({"z":[1,-2,2.5,true,null,"ü"],"a":{"b":18446744073709551615}})";
  const auto parsed = api::parse_json(text, kBytes);
  ASSERT_TRUE(parsed);
  EXPECT_EQ(api::dump(*parsed), text);
}

TEST(DumpJson, WritesNullForNanAndInfinity) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double inf = std::numeric_limits<double>::infinity();
  EXPECT_EQ(api::dump(api::Json::array({nan, inf, -inf, 1.5})), "[null,null,null,1.5]");
  EXPECT_EQ(api::dump(api::Json("a\xff")), "\"a\xEF\xBF\xBD\"");
}

TEST(ShortestDouble, RoundTripsTheFloat) {
  EXPECT_EQ(api::shortest_double(0.8F), 0.8);
  EXPECT_EQ(api::shortest_double(1.5F), 1.5);
  std::uint32_t state = 1;
  for (int i = 0; i < 100000; ++i) {
    state = state * 1664525U + 1013904223U;
    float value = 0;
    static_assert(sizeof value == sizeof state);
    std::memcpy(&value, &state, sizeof value);
    if (std::isfinite(value)) {
      ASSERT_EQ(static_cast<float>(api::shortest_double(value)), value);
    }
  }
}

TEST(NumberText, IsShort) {
  EXPECT_EQ(api::number_text(16384), "16384");
  EXPECT_EQ(api::number_text(9007199254740991.0), "9007199254740991");
  EXPECT_EQ(api::number_text(0.9999), "0.9999");
  EXPECT_EQ(api::number_text(1e-5), "1e-05");
  EXPECT_EQ(api::number_text(-0.5), "-0.5");
}

TEST(JoinPointer, EscapesTildeAndSlash) {
  EXPECT_EQ(api::join_pointer("/a", "b~/c"), "/a/b~0~1c");
  EXPECT_EQ(api::join_pointer("", ""), "/");
}

}  // namespace
