/// Irradiance from a uniform triangle in closed form.
#pragma once

#include "core/math/vec.h"

namespace core {

/// Returns the integral of the cosine to `normal` over the directions from `point` to the triangle
/// [sr]: the irradiance from unit radiance without occlusion. The part below the plane of `normal`
/// is clipped; the orientation of the triangle does not matter. 0 if the point lies in the
/// triangle's plane. normal: unit. Computed in double, because the sum cancels to the solid angle,
/// 1e-8 of its terms for a small light. Source: Lambert, Photometria, 1760; as Baum, Rushmeier and
/// Winget 1989, eq. 4, after clipping to the horizon.
double triangle_irradiance(Vec3 point, Vec3 normal, Vec3 a, Vec3 b, Vec3 c) noexcept;

}  // namespace core
