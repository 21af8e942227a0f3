#include "api/time_text.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace api {
namespace {

constexpr std::int64_t kSecondsPerDay = 86400;
constexpr std::int64_t kFirstSecond = -62167219200;  // 0000-01-01T00:00:00Z
constexpr std::int64_t kLastSecond = 253402300799;   // 9999-12-31T23:59:59Z
/// Ticks of a second. Not milliseconds: from 2106 on, doubles of seconds cannot tell two of them
/// apart.
constexpr std::int64_t kMilli = 1000;

struct Date {
  int year = 1970;
  int month = 1;
  int day = 1;
};

/// Days since 1970-01-01 of the proleptic Gregorian calendar, by counting from 1 March in eras of
/// 400 years: leap days then come last in a year.
std::int64_t days_from_date(const Date& date) {
  const std::int64_t year = date.month <= 2 ? date.year - 1 : date.year;
  const std::int64_t era = (year >= 0 ? year : year - 399) / 400;
  const std::int64_t year_of_era = year - era * 400;
  const std::int64_t month_from_march = (date.month + 9) % 12;
  const std::int64_t day_of_year = (153 * month_from_march + 2) / 5 + date.day - 1;
  const std::int64_t day_of_era =
      year_of_era * 365 + year_of_era / 4 - year_of_era / 100 + day_of_year;
  return era * 146097 + day_of_era - 719468;
}

Date date_from_days(std::int64_t days) {
  days += 719468;
  const std::int64_t era = (days >= 0 ? days : days - 146096) / 146097;
  const std::int64_t day_of_era = days - era * 146097;
  const std::int64_t year_of_era =
      (day_of_era - day_of_era / 1460 + day_of_era / 36524 - day_of_era / 146096) / 365;
  const std::int64_t day_of_year =
      day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
  const std::int64_t month_from_march = (5 * day_of_year + 2) / 153;
  const auto day = static_cast<int>(day_of_year - (153 * month_from_march + 2) / 5 + 1);
  const auto month =
      static_cast<int>(month_from_march < 10 ? month_from_march + 3 : month_from_march - 9);
  const auto year = static_cast<int>(year_of_era + era * 400 + (month <= 2 ? 1 : 0));
  return {year, month, day};
}

int days_in_month(int year, int month) {
  constexpr std::array kDays = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
  const bool leap = year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
  return month == 2 && leap ? 29 : kDays[static_cast<std::size_t>(month - 1)];
}

/// Reads fixed-width decimal fields one after another.
class Cursor {
 public:
  explicit Cursor(std::string_view text) : text_(text) {}

  int digits(std::size_t count) {
    int value = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!at_digit()) {
        good_ = false;
        return 0;
      }
      value = value * 10 + (text_[at_++] - '0');
    }
    return value;
  }
  void literal(char expected) {
    good_ = good_ && at_ < text_.size() && text_[at_] == expected;
    ++at_;
  }
  char any() { return at_ < text_.size() ? text_[at_++] : '\0'; }
  bool at_digit() const { return at_ < text_.size() && text_[at_] >= '0' && text_[at_] <= '9'; }
  bool at(char c) const { return at_ < text_.size() && text_[at_] == c; }
  bool good() const { return good_; }
  bool at_end() const { return at_ == text_.size(); }
  void fail() { good_ = false; }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  bool good_ = true;
};

/// Milliseconds of ".123", or 0 when there is no fraction.
std::int64_t read_fraction(Cursor& cursor) {
  if (!cursor.at('.')) {
    return 0;
  }
  cursor.literal('.');
  if (!cursor.at_digit()) {
    cursor.fail();
  }
  std::int64_t milli = 0;
  for (std::int64_t place = kMilli / 10; cursor.at_digit(); place /= 10) {
    milli += place * cursor.digits(1);
  }
  return milli;
}

/// Seconds east of Greenwich.
std::int64_t read_offset(Cursor& cursor) {
  const char sign = cursor.any();
  if (sign == 'Z' || sign == 'z') {
    return 0;
  }
  if (sign != '+' && sign != '-') {
    cursor.fail();
    return 0;
  }
  const int hours = cursor.digits(2);
  cursor.literal(':');
  const int minutes = cursor.digits(2);
  if (hours > 23 || minutes > 59) {
    cursor.fail();
  }
  const std::int64_t seconds = hours * 3600 + minutes * 60;
  return sign == '-' ? -seconds : seconds;
}

}  // namespace

std::optional<double> parse_rfc3339(std::string_view text) {
  Cursor cursor(text);
  Date date;
  date.year = cursor.digits(4);
  cursor.literal('-');
  date.month = cursor.digits(2);
  cursor.literal('-');
  date.day = cursor.digits(2);
  const char separator = cursor.any();
  const int hour = cursor.digits(2);
  cursor.literal(':');
  const int minute = cursor.digits(2);
  cursor.literal(':');
  const int second = cursor.digits(2);
  const std::int64_t milli = read_fraction(cursor);
  const std::int64_t offset = read_offset(cursor);
  if (!cursor.good() || !cursor.at_end() || (separator != 'T' && separator != 't')) {
    return {};
  }
  if (date.month < 1 || date.month > 12 || date.day < 1 ||
      date.day > days_in_month(date.year, date.month) || hour > 23 || minute > 59 || second > 60) {
    return {};
  }
  const std::int64_t seconds =
      days_from_date(date) * kSecondsPerDay + hour * 3600 + minute * 60 + second - offset;
  return static_cast<double>(seconds * kMilli + milli) / static_cast<double>(kMilli);
}

std::string rfc3339(double unix_seconds) {
  const double inside =
      std::clamp(unix_seconds, static_cast<double>(kFirstSecond), static_cast<double>(kLastSecond));
  const std::int64_t total = std::llround(inside * static_cast<double>(kMilli));
  const std::int64_t milli = ((total % kMilli) + kMilli) % kMilli;
  const std::int64_t seconds = (total - milli) / kMilli;
  const std::int64_t second_of_day = ((seconds % kSecondsPerDay) + kSecondsPerDay) % kSecondsPerDay;
  const Date date = date_from_days((seconds - second_of_day) / kSecondsPerDay);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02d-%02dT%02d:%02d:%02d", date.year, date.month,
                date.day, static_cast<int>(second_of_day / 3600),
                static_cast<int>(second_of_day / 60 % 60), static_cast<int>(second_of_day % 60));
  std::string result = text.data();
  if (milli != 0) {
    std::snprintf(text.data(), text.size(), ".%03d", static_cast<int>(milli));
    result += text.data();
    result.erase(result.find_last_not_of('0') + 1);
  }
  return result + "Z";
}

}  // namespace api
