/// Which surfaces rays can hit: alpha may hide whole triangles. And the bounds of those.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/description/scene_description.h"
#include "core/math/bounds.h"
#include "core/textures/marked_blocks.h"

namespace core {

/// Alpha that is equal to the cutoff may be less by this factor after the roundings of its sum over
/// the corners of a triangle and of texels, and of its products: at most 16, each of 2^-24.
inline constexpr float kAlphaRounding = 1 - 0x1p-20F;

/// Returns the least alpha of the base colour texture, in [0, 1], with which a point of the
/// material is not a hole; more than 1 if every point is one. most: the largest product of the
/// other factors, those of the material and the vertices. Source: glTF 2.0, 3.9.4.
float least_drawn_alpha(const MaterialDescription& material, float most) noexcept;

/// Returns whether rays can hit a surface of the material: its alpha factor, which textures and
/// vertex colours only reduce, does not remove it.
bool is_drawn(const MaterialDescription& material) noexcept;

/// Returns the corners of a triangle in the coordinates of a texture. uv: of the vertices; if
/// empty, all are at 0.
std::array<Vec2, 3> corners_in(const TextureDescription& texture, const std::vector<Vec2>& uv,
                               const std::array<std::size_t, 3>& vertices);

/// Returns false only if no texel is marked that the triangle shows; see MarkedBlocks::has_mark().
bool has_mark(const MarkedBlocks& blocks, const TextureDescription& texture,
              const std::array<Vec2, 3>& corners);

/// Returns the extreme points [m] of what is drawn of the instances that are not ground. Left out
/// are triangles all of whose alpha is 0 or below the cutoff, by factor, vertices and texture, and
/// instances scaled to a line or a point.
std::vector<Vec3> extreme_points_of(const SceneDescription& scene);

/// Returns scene.framed, or extreme_points_of() if there are none.
std::vector<Vec3> framed_points_of(const SceneDescription& scene);

/// Returns the bounds [m] of framed_points_of(). Automatic cameras frame them.
Bounds bounds_of(const SceneDescription& scene);

}  // namespace core
