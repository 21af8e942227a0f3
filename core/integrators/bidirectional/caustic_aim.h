/// Aims the light paths of path-caustics at the surfaces that make the visible caustics.
#pragma once

#include <vector>

#include "core/integrators/integrator.h"
#include "core/light_samplers/emission_sampler.h"

namespace core {

/// A point of a surface, and how much it counts.
struct AimPoint {
  Vec3 position;
  float weight = 0;
};

/// Returns balls that together contain the points, each with about as many of them; their shares
/// are those of the weights and add up to `share`. Empty if no point has a weight.
std::vector<EmissionTarget> balls_around(std::vector<AimPoint> points, float share);

/// Aims `emission`, first at the visible surfaces, then, in rounds, at those that particles met
/// first on their way to a visible caustic. Returns the fraction of the light on visible surfaces
/// that is caustics. A function of scene, camera and settings without the seed. This is importance
/// sampling of the first segment by a pilot: Jensen 1996 calls it projection maps; the visible
/// photons are those of Hachisuka and Jensen 2011, "Robust Adaptive Photon Tracing using Photon
/// Path Visibility".
double aim_at_caustics(const IntegratorInput& input, EmissionSampler& emission);

}  // namespace core
