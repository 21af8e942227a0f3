#include "core/lights/outdoor.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace core {

double horizontal_irradiance(const Environment& environment) {
  const Environment::Map map = environment.map();
  double sum = map.width == 0 ? std::numbers::pi * static_cast<double>(luminance(map.constant)) : 0;
  for (int y = 0; 2 * y < map.height; ++y) {
    // Rows are bands of theta from the zenith; the integral of cos sin is sin^2 / 2.
    const auto sine_squared = [&](int row) {
      const double theta = std::min(std::numbers::pi * row / map.height, std::numbers::pi / 2);
      return std::sin(theta) * std::sin(theta);
    };
    const double each =
        (sine_squared(y + 1) - sine_squared(y)) / 2 * 2 * std::numbers::pi / map.width;
    for (int x = 0; x < map.width; ++x) {
      sum += each * static_cast<double>(luminance(map.texels[std::ptrdiff_t{y} * map.width + x]));
    }
  }
  if (environment.has_sun()) {
    sum += static_cast<double>(luminance(environment.sun_irradiance())) *
           std::max(0.0, static_cast<double>(environment.sun_world().y));
  }
  return sum;
}

}  // namespace core
