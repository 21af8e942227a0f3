/// Offsets ray origins from surfaces; all rays that leave a surface use this.
#pragma once

#include <bit>
#include <cmath>
#include <cstdint>

#include "core/math/vec.h"

namespace core {

/// Moves p to the side of the surface that n_geometric points to, by a number of float steps that
/// exceeds the error of a hit point computed from the triangle's vertices. Source: Waechter and
/// Binder, A Fast and Robust Method for Avoiding Self-Intersection, Ray Tracing Gems 2019, ch. 6.
inline Vec3 offset_ray(Vec3 p, Vec3 n_geometric) noexcept {
  constexpr float kOrigin = 1.0F / 32.0F;
  constexpr float kFloatScale = 1.0F / 65536.0F;
  constexpr float kIntScale = 256.0F;
  const auto moved = [](float x, float n) {
    const auto steps = static_cast<std::int32_t>(kIntScale * n);
    const float near_zero = x + kFloatScale * n;
    const auto bits = std::bit_cast<std::int32_t>(x) + (x < 0 ? -steps : steps);
    return std::fabs(x) < kOrigin ? near_zero : std::bit_cast<float>(bits);
  };
  return {moved(p.x, n_geometric.x), moved(p.y, n_geometric.y), moved(p.z, n_geometric.z)};
}

}  // namespace core
