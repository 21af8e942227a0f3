/// Control variate: the unoccluded light of a uniform triangle on a Lambertian surface, in closed
/// form.
///
/// Let h = albedo / pi cos L be the unoccluded light of a Lambertian surface of the same albedo,
/// and H its integral over the light. Then H - h/p has mean 0; added to V f L / p it leaves only
/// the noise of shadows and of the difference between the BSDF and the Lambertian one. BSDF samples
/// that hit the light then count as zero, because light samples are not weighted.
#pragma once

#include "core/light_samplers/light_sampler.h"
#include "core/lights/light.h"
#include "core/materials/shade.h"

namespace core {

/// Returns whether the closed form is used: for uniform triangles that are large and close enough,
/// with the point clearly in front (or behind, if two-sided). In the plane of the triangle rounding
/// would decide which points count.
bool has_closed_form(const TriangleLight& light, Vec3 point) noexcept;

/// Returns H - h/p for a sample of `light`, per unit of throughput. Pre: has_closed_form().
Rgb light_control(const TriangleLight& light, const LightSample& sample, const Shading& shading,
                  Rgb albedo) noexcept;

}  // namespace core
