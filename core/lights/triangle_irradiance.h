/// Irradiance from a uniform triangle in closed form.
#pragma once

#include "core/math/vec.h"

namespace core {

/// Integral of the cosine to `normal` over the directions from `point` in which the triangle lies,
/// sr: the irradiance from unit radiance when nothing is in between. The part below the plane of
/// `normal` does not count; which side of the triangle faces the point does not matter. 0 where the
/// point lies in the triangle's plane. normal: unit. In double: the sum cancels to the solid angle,
/// 1e-8 of its terms for a small light. Source: Lambert, Photometria, 1760; as Baum, Rushmeier and
/// Winget 1989, eq. 4, after clipping to the horizon.
double triangle_irradiance(Vec3 point, Vec3 normal, Vec3 a, Vec3 b, Vec3 c) noexcept;

}  // namespace core
