/// Emitted light, as every choice and sample of lights reads it.
#pragma once

#include <vector>

#include "core/lights/environment.h"
#include "core/scene/scene_data.h"

namespace core {

/// Power that each light sends into the scene, as luminance [W]: triangles, punctual lights, the
/// environment (null: none). Never below a millionth of the whole, so that each is sampled: 2^-20
/// is 16 steps of a float below 1. Zero for triangles without area and for those
/// that shine nowhere.
std::vector<float> light_powers(const SceneData& scene, const Environment* environment);

/// Radius of the disk through which far lights light the scene.
float light_disk_radius_m(const SceneData& scene) noexcept;

/// Radiance of a triangle light at barycentric weights of vertices 1 and 2.
Rgb triangle_radiance(const SceneData& scene, const TriangleLight& light, Vec2 weights) noexcept;

}  // namespace core
