#include "core/integrators/maps/photon_map.h"

#include <algorithm>
#include <bit>

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

PhotonMap::PhotonMap(std::vector<std::vector<Photon>>& parts, float radius_m)
    : radius_m_(radius_m) {
  std::size_t count = 0;
  for (const auto& part : parts) {
    count += part.size();
  }
  first_.assign(std::bit_ceil(std::max<std::size_t>(count, 16)) + 1, 0);
  for (const auto& part : parts) {
    for (const Photon& photon : part) {
      ++first_[bucket(cell_below(photon.position, 0))];
    }
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& first : first_) {
    sum += first;
    first = sum;
  }
  photons_.resize(count);
  // Goes backwards, so that the order is kept and first_ ends up at the beginnings.
  for (auto part = parts.rbegin(); part != parts.rend(); ++part) {
    for (auto photon = part->rbegin(); photon != part->rend(); ++photon) {
      photons_[--first_[bucket(cell_below(photon->position, 0))]] = *photon;
    }
    std::vector<Photon>().swap(*part);
  }
}

}  // namespace core
