/// The node hierarchy at one time: world matrices in double precision.
#pragma once

#include <array>
#include <vector>

#include "core/base/result.h"
#include "core/math/place.h"
#include "core/math/transform.h"
#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// An affine map like Transform, in double, to stay accurate in deep hierarchies.
struct Affine {
  /// Columns x, y, z, t.
  std::array<std::array<double, 3>, 4> column = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {0, 0, 0}}};

  /// Returns the map whose images count from another place.
  Affine from(Place origin) const noexcept;
  Transform to_transform() const noexcept;
  bool is_finite() const noexcept;  ///< after conversion to floats
};
Affine operator*(const Affine& a, const Affine& b) noexcept;

/// translation * rotation * scale. Scales of 0 are 1e-100, which is 0 in floats, so that the
/// directions of axes remain.
Affine affine_from_parts(Vec3 translation, Vec4 rotation, Vec3 scale) noexcept;

/// Returns the map with axes of length 1; those of length 0 remain.
Affine without_scale(Affine map) noexcept;

/// Returns the world matrices of all nodes. Pre: parse_model() accepted the nodes. Errors:
/// kInvalidArgument at the node whose matrix does not fit in floats.
Result<std::vector<Affine>> world_matrices(const tinygltf::Model& model,
                                           const AnimatedNodes& animated);

/// Returns the nodes below the roots of a scene, parents first. scene_index -1: the file's default
/// scene, or all roots if the file has no scenes. Errors: kInvalidArgument at "/scene_index".
Result<std::vector<int>> nodes_of_scene(const tinygltf::Model& model, int scene_index);

/// Returns the selected scene, or -1 if the file has none. Errors: as nodes_of_scene().
Result<int> chosen_scene(const tinygltf::Model& model, int scene_index);

/// Returns whether a node hides nothing (KHR_node_visibility).
bool is_shown(const tinygltf::Node& node);

/// Returns for each node whether it and all its ancestors are visible; those with is_shown_once
/// count as visible.
std::vector<bool> visible_nodes(const tinygltf::Model& model, const AnimatedNodes& animated = {});

}  // namespace core
