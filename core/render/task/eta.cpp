#include "core/render/task/eta.h"

#include <algorithm>
#include <cmath>

namespace core {

std::optional<Remaining> seconds_for(std::span<const PacePoint> points, double samples) {
  if (points.size() < 2) {
    return {};
  }
  const double seconds = points.back().elapsed_seconds - points.front().elapsed_seconds;
  const double done = points.back().samples - points.front().samples;
  if (!(seconds > 0) || !(done > 0)) {
    return {};
  }
  const double pace = seconds / done;
  Remaining out = {samples * pace, samples * pace / 2, samples * pace * 2};
  if (points.size() < 5) {
    return out;
  }
  // Ratio estimate: residuals of the passes about the common pace (Cochran, Sampling Techniques,
  // 6.4).
  double residuals = 0;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double r = points[i].elapsed_seconds - points[i - 1].elapsed_seconds -
                     pace * (points[i].samples - points[i - 1].samples);
    residuals += r * r;
  }
  const auto n = static_cast<double>(points.size() - 1);
  const double relative = std::sqrt(residuals * n / (n - 1)) / seconds;
  const double width = std::clamp(2 * relative, 0.05, 0.5);
  out.low = out.expected * (1 - width);
  out.high = out.expected / (1 - width);
  return out;
}

Remaining earlier(const Remaining& a, const Remaining& b) {
  return {std::min(a.expected, b.expected), std::min(a.low, b.low), std::min(a.high, b.high)};
}

double samples_for_error(double samples, double bound, double target, double exponent) {
  return samples * std::pow(bound / target, 1 / exponent);
}

double error_exponent(std::span<const SeenError> seen) {
  constexpr double kIndependent = 0.5;
  constexpr double kSpan = 16;
  constexpr double kLeastSpan = 4;
  while (!seen.empty() &&
         !(seen.front().error > 0 && seen.front().samples * kSpan >= seen.back().samples)) {
    seen = seen.subspan(1);
  }
  if (seen.size() < 4 || seen.back().samples < kLeastSpan * seen.front().samples) {
    return kIndependent;
  }
  const auto n = static_cast<double>(seen.size());
  double x = 0;
  double y = 0;
  for (const SeenError& s : seen) {
    x += std::log(s.samples) / n;
    y += std::log(s.error) / n;
  }
  double xx = 0;
  double xy = 0;
  for (const SeenError& s : seen) {
    xx += (std::log(s.samples) - x) * (std::log(s.samples) - x);
    xy += (std::log(s.samples) - x) * (std::log(s.error) - y);
  }
  const double exponent = -xy / xx;
  return exponent > kIndependent ? std::min(exponent, 1.0)
                                 : kIndependent;  // NaN: assume independent samples
}

}  // namespace core
