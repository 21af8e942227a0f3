/// Control variate: the unoccluded light of a uniform triangle on a Lambert surface, in closed
/// form.
///
/// With h = albedo / pi cos L, the light that a Lambert surface of the same albedo would get if
/// nothing stood in between, and H its integral over the light, H - h/p has the mean 0: added to
/// V f L / p it leaves of the noise what comes from shadows and from the difference between the
/// BSDF and Lambert's. BSDF samples that find the light then count for nothing, since light samples
/// are not weighted.
#pragma once

#include "core/light_samplers/light_sampler.h"
#include "core/lights/light.h"
#include "core/materials/shade.h"

namespace core {

/// Uniform triangles that are not so small or far that it does not matter, with the point clearly
/// before them (on either side of two-sided ones): in their plane rounding would decide which of
/// their points count.
bool has_closed_form(const TriangleLight& light, Vec3 point) noexcept;

/// H - h/p for a sample of `light`, per unit of throughput. Pre: has_closed_form().
Rgb light_control(const TriangleLight& light, const LightSample& sample, const Shading& shading,
                  Rgb albedo) noexcept;

}  // namespace core
