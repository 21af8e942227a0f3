/// Applies morph targets and skins to a primitive's vertices.
#pragma once

#include <span>
#include <string>

#include "core/base/result.h"
#include "core/math/transform.h"
#include "core/scene_io/gltf_primitive.h"

namespace core {

/// Adds weight times target to the base; a missing weight is 0.
void apply_morph_targets(GltfPrimitive& primitive, std::span<const float> weights);

/// Returns the number of vertices whose weights are all 0.
std::size_t without_joints(const GltfPrimitive& primitive);

/// Moves the vertices by their joints. joint_matrices: joint to world times inverse bind matrix, so
/// the result is in world space. Weights are normalised by their sum; a vertex without weight
/// follows the first joint. Errors: kInvalidArgument for a joint that the skin does not have.
Status apply_skin(GltfPrimitive& primitive, std::span<const Transform> joint_matrices,
                  const std::string& where);

/// Transforms vertices, normals and tangents, also by a singular transform; reverses the triangles
/// if it mirrors.
void apply_transform(PrimitiveDescription& primitive, const Transform& transform);

}  // namespace core
