#include "core/lights/triangle_irradiance.h"

#include <array>
#include <cmath>
#include <cstddef>

namespace core {
namespace {

struct Direction {
  double x = 0, y = 0, z = 0;

  double length() const { return std::sqrt(x * x + y * y + z * z); }
};

Direction cross_of(const Direction& a, const Direction& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

double dot_of(const Direction& a, const Direction& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

}  // namespace

double triangle_irradiance(Vec3 point, Vec3 normal, Vec3 a, Vec3 b, Vec3 c) noexcept {
  // A triangle clipped by a plane has at most four vertices.
  const std::array<Vec3, 3> corners = {a - point, b - point, c - point};
  std::array<double, 3> height{};
  for (std::size_t i = 0; i < 3; ++i) {
    height[i] = static_cast<double>(corners[i].x) * static_cast<double>(normal.x) +
                static_cast<double>(corners[i].y) * static_cast<double>(normal.y) +
                static_cast<double>(corners[i].z) * static_cast<double>(normal.z);
  }
  std::array<Direction, 4> above{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::size_t next = (i + 1) % 3;
    const Direction from{static_cast<double>(corners[i].x), static_cast<double>(corners[i].y),
                         static_cast<double>(corners[i].z)};
    if (height[i] > 0) {
      above[count++] = from;
    }
    if ((height[i] > 0) != (height[next] > 0)) {
      const double t = height[i] / (height[i] - height[next]);
      above[count++] = {from.x + t * (static_cast<double>(corners[next].x) - from.x),
                        from.y + t * (static_cast<double>(corners[next].y) - from.y),
                        from.z + t * (static_cast<double>(corners[next].z) - from.z)};
    }
  }
  const Direction up{static_cast<double>(normal.x), static_cast<double>(normal.y),
                     static_cast<double>(normal.z)};
  double sum = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Direction& from = above[i];
    const Direction& to = above[(i + 1) % count];
    const Direction turn = cross_of(from, to);
    const double sine = turn.length();
    if (sine > 0) {
      sum += std::atan2(sine, dot_of(from, to)) * dot_of(turn, up) / sine;
    }
  }
  return 0.5 * std::fabs(sum);
}

}  // namespace core
