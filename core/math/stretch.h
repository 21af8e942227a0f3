/// Bound on the lengths that a transform makes of unit vectors.
#pragma once

#include <cmath>

#include "core/math/transform.h"

namespace core {

/// Returns the Frobenius norm of the linear part: no direction is stretched more, also by a shear.
inline float stretch_bound(const Transform& m) noexcept {
  return std::sqrt(dot(m.x, m.x) + dot(m.y, m.y) + dot(m.z, m.z));
}

}  // namespace core
