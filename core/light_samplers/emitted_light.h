/// Emitted power and radiance, shared by all light samplers.
#pragma once

#include <vector>

#include "core/lights/environment.h"
#include "core/scene/scene_data.h"

namespace core {

/// Returns the power that each light emits into the scene, as luminance [W], in the order
/// triangles, punctual lights, environment (null: none). At least a millionth of the total, so that
/// every light is sampled: 2^-20 is 16 steps of a float below 1. Zero for triangles without area or
/// emission.
std::vector<float> light_powers(const SceneData& scene, const Environment* environment);

/// Returns the radius of the disk through which distant lights light the scene.
float light_disk_radius_m(const SceneData& scene) noexcept;

/// Returns the radiance that a triangle light sends from `place`, a point on it, towards wo_world
/// on a side that emits: emitted() times coverage, which is the mean of what rays find there. Every
/// sample of a light and of emission has this radiance.
Rgb triangle_radiance(const SceneData& scene, const TriangleLight& light, Vec3 place,
                      Vec3 wo_world) noexcept;

}  // namespace core
