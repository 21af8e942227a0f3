/// Bounds of counts of covered truths.
#pragma once

#include <cmath>

#include "core/base/statistics.h"

namespace test_support {

/// The probability that an interval of the stated level fails a test of one count.
inline constexpr double kFalseAlarm = 3e-3;

/// The largest count of n independent intervals that those of at least `level` stay below with
/// probability kFalseAlarm at most.
inline double least_covered(double n, double level = 0.95) {
  double k = std::floor(level * n);
  while (k > 0 && 1 - core::binomial_tail(k, n, level) > kFalseAlarm) {
    --k;
  }
  return k;
}

/// The smallest count of n independent intervals that those of at most `level` exceed with
/// probability kFalseAlarm at most.
inline double most_covered(double n, double level = 0.95) {
  double k = std::ceil(level * n);
  while (k < n && core::binomial_tail(k + 1, n, level) > kFalseAlarm) {
    ++k;
  }
  return k;
}

/// The same as fractions of n.
inline double least_fraction(double n, double level = 0.95) { return least_covered(n, level) / n; }
inline double most_fraction(double n, double level = 0.95) { return most_covered(n, level) / n; }

}  // namespace test_support
