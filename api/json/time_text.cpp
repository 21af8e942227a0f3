#include "api/json/time_text.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace api {
namespace {

namespace chrono = std::chrono;

constexpr chrono::sys_seconds kFirst = chrono::sys_days{chrono::year{0} / 1 / 1};
constexpr chrono::sys_seconds kEnd = chrono::sys_days{chrono::year{10000} / 1 / 1};
/// Ticks per second. Not microseconds: from 2106 on, doubles in seconds cannot distinguish adjacent
/// ones.
constexpr std::int64_t kMilli = 1000;

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

/// Reads seconds east of Greenwich.
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
  const chrono::year year(cursor.digits(4));
  cursor.literal('-');
  const chrono::month month(static_cast<unsigned>(cursor.digits(2)));
  cursor.literal('-');
  const chrono::day day(static_cast<unsigned>(cursor.digits(2)));
  const char separator = cursor.any();
  const int hour = cursor.digits(2);
  cursor.literal(':');
  const int minute = cursor.digits(2);
  cursor.literal(':');
  const int second = cursor.digits(2);
  const std::int64_t milli = read_fraction(cursor);
  const std::int64_t offset = read_offset(cursor);
  const chrono::year_month_day date(year, month, day);
  if (!cursor.good() || !cursor.at_end() || (separator != 'T' && separator != 't') || !date.ok() ||
      hour > 23 || minute > 59 || second > 60) {
    return {};
  }
  const chrono::sys_seconds time = chrono::sys_days(date) + chrono::hours(hour) +
                                   chrono::minutes(minute) + chrono::seconds(second - offset);
  return static_cast<double>(time.time_since_epoch().count() * kMilli + milli) /
         static_cast<double>(kMilli);
}

std::string rfc3339(double unix_seconds) {
  const double inside =
      std::clamp(unix_seconds, static_cast<double>(kFirst.time_since_epoch().count()),
                 static_cast<double>(kEnd.time_since_epoch().count() - 1));
  const chrono::sys_time<chrono::milliseconds> time{
      chrono::milliseconds(std::llround(inside * static_cast<double>(kMilli)))};
  const auto midnight = chrono::floor<chrono::days>(time);
  const chrono::year_month_day date(midnight);
  const chrono::hh_mm_ss clock(time - midnight);
  std::array<char, 64> text{};
  std::snprintf(text.data(), text.size(), "%04d-%02u-%02uT%02d:%02d:%02d.%03dZ",
                static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                static_cast<unsigned>(date.day()), static_cast<int>(clock.hours().count()),
                static_cast<int>(clock.minutes().count()),
                static_cast<int>(clock.seconds().count()),
                static_cast<int>(clock.subseconds().count()));
  return text.data();
}

std::string short_rfc3339(double unix_seconds) {
  std::string text = rfc3339(unix_seconds);
  text.pop_back();  // Z
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') {
    text.pop_back();
  }
  return text + "Z";
}

}  // namespace api
