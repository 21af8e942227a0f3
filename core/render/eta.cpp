#include "core/render/eta.h"

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
  // Ratio estimate: residuals of the passes around the common pace (Cochran, Sampling Techniques, 6.4).
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

double samples_for_error(double samples, double bound, double target) {
  return samples * (bound / target) * (bound / target);
}

}  // namespace core
