#include "core/integrators/maps/photon_map.h"

namespace core {
namespace {

constexpr float kSteps = 32767;

float sign_of(float v) noexcept { return v < 0 ? -1.0F : 1.0F; }

}  // namespace

PackedDirection::PackedDirection(Vec3 unit) noexcept {
  const float sum = std::fabs(unit.x) + std::fabs(unit.y) + std::fabs(unit.z);
  if (!(sum > 0)) {
    return;
  }
  float x = unit.x / sum;
  float y = unit.y / sum;
  if (unit.z < 0) {
    const float folded = (1 - std::fabs(y)) * sign_of(x);
    y = (1 - std::fabs(x)) * sign_of(y);
    x = folded;
  }
  x_ = static_cast<std::int16_t>(std::nearbyint(x * kSteps));
  y_ = static_cast<std::int16_t>(std::nearbyint(y * kSteps));
}

Vec3 PackedDirection::unpacked() const noexcept {
  float x = static_cast<float>(x_) / kSteps;
  float y = static_cast<float>(y_) / kSteps;
  const float z = 1 - std::fabs(x) - std::fabs(y);
  if (z < 0) {
    const float unfolded = (1 - std::fabs(y)) * sign_of(x);
    y = (1 - std::fabs(x)) * sign_of(y);
    x = unfolded;
  }
  return normalize({x, y, z});
}

}  // namespace core
