/// Bounds: an axis-aligned box in metres; empty until a point is added.
#pragma once

#include <algorithm>
#include <limits>

#include "core/math/vec.h"

namespace core {

struct Bounds {
  static constexpr float kInf = std::numeric_limits<float>::infinity();
  Vec3 min = {kInf, kInf, kInf};
  Vec3 max = {-kInf, -kInf, -kInf};

  constexpr bool empty() const noexcept { return !(min.x <= max.x); }
  constexpr void add(Vec3 p) noexcept {
    min = {std::min(min.x, p.x), std::min(min.y, p.y), std::min(min.z, p.z)};
    max = {std::max(max.x, p.x), std::max(max.y, p.y), std::max(max.z, p.z)};
  }
  constexpr void add(const Bounds& b) noexcept {
    if (!b.empty()) {
      add(b.min);
      add(b.max);
    }
  }
  constexpr Vec3 center() const noexcept { return (min + max) * 0.5F; }
  constexpr Vec3 diagonal() const noexcept { return max - min; }
  /// Half the diagonal; `otherwise` for an empty box or a point, which have no size.
  float radius_or(float otherwise) const noexcept {
    const float radius = empty() ? 0.0F : 0.5F * length(diagonal());
    return radius > 0 ? radius : otherwise;
  }
};

struct Extent {
  float least = Bounds::kInf;
  float most = -Bounds::kInf;
};

/// Returns the extent of a box from a point along a direction.
inline Extent extent_along(const Bounds& box, Vec3 from, Vec3 direction) noexcept {
  Extent out;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 p = {(corner & 1) != 0 ? box.max.x : box.min.x,
                    (corner & 2) != 0 ? box.max.y : box.min.y,
                    (corner & 4) != 0 ? box.max.z : box.min.z};
    const float at = dot(p - from, direction);
    out.least = std::min(out.least, at);
    out.most = std::max(out.most, at);
  }
  return out;
}

}  // namespace core
