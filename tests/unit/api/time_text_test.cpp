#include "api/json/time_text.h"

#include <gtest/gtest.h>

namespace {

struct Case {
  const char* text;
  double unix_seconds;
};

// Seconds from RFC 3339 section 5.8 and `date -u -d TEXT +%s`.
class Rfc3339 : public testing::TestWithParam<Case> {};

TEST_P(Rfc3339, IsReadWithItsOffset) {
  const auto seconds = api::parse_rfc3339(GetParam().text);
  ASSERT_TRUE(seconds.has_value());
  EXPECT_DOUBLE_EQ(*seconds, GetParam().unix_seconds);
}

INSTANTIATE_TEST_SUITE_P(
    Table, Rfc3339,
    testing::Values(Case{"1970-01-01T00:00:00Z", 0}, Case{"1985-04-12T23:20:50.52Z", 482196050.52},
                    Case{"1996-12-19T16:39:57-08:00", 851042397},
                    Case{"1990-12-31T23:59:60Z", 662688000},
                    Case{"1937-01-01T12:00:27.87+00:20", -1041337172.13},
                    Case{"2000-02-29t00:00:00z", 951782400},
                    Case{"2026-01-31T12:00:00.123456789+01:00", 1769857200.123},
                    Case{"0000-01-01T00:00:00Z", -62167219200},
                    Case{"9999-12-31T23:59:59Z", 253402300799}));

class NotRfc3339 : public testing::TestWithParam<const char*> {};

TEST_P(NotRfc3339, IsRefused) { EXPECT_FALSE(api::parse_rfc3339(GetParam()).has_value()); }

INSTANTIATE_TEST_SUITE_P(
    Table, NotRfc3339,
    testing::Values("", "2026", "2026-01-31", "2026-01-31T12:00:00", "2026-01-31T12:00Z",
                    "2026-01-31 12:00:00Z", "2026-02-29T00:00:00Z", "1900-02-29T00:00:00Z",
                    "2026-13-01T00:00:00Z", "2026-00-01T00:00:00Z", "2026-01-00T00:00:00Z",
                    "2026-01-32T00:00:00Z", "2026-01-31T24:00:00Z", "2026-01-31T23:60:00Z",
                    "2026-01-31T23:59:61Z", "2026-01-31T12:00:00.Z", "2026-01-31T12:00:00+24:00",
                    "2026-01-31T12:00:00+01:60", "2026-01-31T12:00:00+0100",
                    "2026-01-31T12:00:00ZZ", "-026-01-31T12:00:00Z", "2026-1-31T12:00:00Z",
                    "tomorrow"));

// Texts of one width sort by time, and every reader of three digits reads them.
TEST(Rfc3339Text, HasThreeDigitsAfterTheSecond) {
  EXPECT_EQ(api::rfc3339(0), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(api::rfc3339(951782399.5), "2000-02-28T23:59:59.500Z");
  EXPECT_EQ(api::rfc3339(-0.001), "1969-12-31T23:59:59.999Z");
}

TEST(Rfc3339Text, TimesOfRequestsHaveOnlyTheNeededDigits) {
  EXPECT_EQ(api::short_rfc3339(0), "1970-01-01T00:00:00Z");
  EXPECT_EQ(api::short_rfc3339(951782400), "2000-02-29T00:00:00Z");
  EXPECT_EQ(api::short_rfc3339(951782399.5), "2000-02-28T23:59:59.5Z");
}

TEST(Rfc3339Text, RoundTripsToTheMillisecond) {
  for (double days = -700000; days < 2900000; days += 977.123456) {
    const auto once = api::parse_rfc3339(api::rfc3339(days * 86400));
    ASSERT_TRUE(once.has_value());
    EXPECT_EQ(api::parse_rfc3339(api::rfc3339(*once)), once);
    EXPECT_NEAR(*once, days * 86400, 0.0006);
  }
}

TEST(Rfc3339Text, StaysInsideFourDigitYears) {
  EXPECT_EQ(api::rfc3339(1e300), "9999-12-31T23:59:59.000Z");
  EXPECT_EQ(api::rfc3339(-1e300), "0000-01-01T00:00:00.000Z");
}

}  // namespace
