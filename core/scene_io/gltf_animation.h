/// Evaluates the animations of a glTF file at one time: values that replace those of the nodes.
#pragma once

#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/math/vec.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/tinygltf.h"

namespace core {

struct AnimatedNode {
  std::optional<Vec3> translation;
  std::optional<Vec4> rotation;  ///< unit quaternion x, y, z, w
  std::optional<Vec3> scale;
  std::vector<float> weights;  ///< empty: not animated
  bool is_shown_once = false;  ///< by KHR_node_visibility, in the file or at some key
};

using AnimatedNodes = std::map<int, AnimatedNode>;

/// A value set by a channel of KHR_animation_pointer.
struct AnimatedValue {
  std::string path;  ///< JSON pointer into the document
  std::vector<float> values;
  bool is_boolean = false;
  bool is_array = false;  ///< false: a single number
};

struct AnimatedMoment {
  AnimatedNodes nodes;
  std::vector<AnimatedValue> values;
  /// The first and the last key of all; none: infinity and -infinity.
  double first_seconds = std::numeric_limits<double>::infinity();
  double last_seconds = -std::numeric_limits<double>::infinity();
  /// Some animated KHR_materials_emissive_strength is above 1 in the file or at some key.
  bool has_emissive_strength = false;
};

/// When animations are evaluated.
struct PlayTime {
  double seconds = 0;
  /// For samplers with STEP keys, except of visibility: the opening of the shutter, so that nothing
  /// is smeared over a jump. Jumps until `closing_seconds` are noted.
  double opening_seconds = 0;
  double closing_seconds = 0;
};

/// Evaluates all animations at once. Before its first and after its last key an animation holds
/// that key, as glTF 2.0 requires. An animation of a target that an earlier one already animates is
/// ignored with a warning. Values are clamped to the range of their member, which cubic splines may
/// exceed. An animation with a fault is not played. Errors: kTooLarge; strict: kInvalidArgument
/// with a JSON pointer.
Result<AnimatedMoment> evaluate_animations(const tinygltf::Model& model, GltfSource& source,
                                           const PlayTime& time, GltfRepairs& repairs);

}  // namespace core
