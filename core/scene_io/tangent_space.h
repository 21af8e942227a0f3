/// Computes missing tangents by the rules of MikkTSpace, as glTF 2.0 requires.
///
/// Tangents of triangles that share an edge and have the same handedness of texture coordinates are
/// averaged at their common vertices, weighted by the angle; vertices are split where handedness or
/// groups differ. Source: M. Mikkelsen, Simulation of Wrinkled Surfaces Revisited, 2008, and the
/// description that accompanies mikktspace; an independent implementation for the default angular
/// threshold of 180 degrees. glTF's v points down, so w is the negative of MikkTSpace's sign.
#pragma once

#include <array>

#include "core/description/scene_description.h"

namespace core {

/// Fills primitive.tangents from uv[uv_set], transformed as by TextureDescription::uv_transform;
/// splits vertices, and computes flat normals (splitting for them) if there are none. Does nothing
/// if the uv set is empty.
void make_tangents(PrimitiveDescription& primitive, int uv_set,
                   const std::array<float, 6>& uv_transform = TextureDescription().uv_transform);

}  // namespace core
