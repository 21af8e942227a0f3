#include "core/scene_io/gltf_deform.h"

#include <algorithm>
#include <utility>

namespace core {
namespace {

void turn_triangle(std::vector<std::uint32_t>& indices, std::size_t triangle) {
  std::swap(indices[triangle * 3 + 1], indices[triangle * 3 + 2]);
}

Vec4 moved_tangent(const Transform& m, Vec4 tangent) {
  const Vec3 t = normalize_or(m.vector({tangent.x, tangent.y, tangent.z}), {1, 0, 0});
  // The bitangent is cross(n, t) * w; a mirror flips the cross product but not the bitangent.
  return {t.x, t.y, t.z, m.determinant() < 0 ? -tangent.w : tangent.w};
}

Transform weighted_sum(const GltfPrimitive& primitive, std::size_t vertex,
                       std::span<const Transform> joints) {
  Transform sum{{0, 0, 0}, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
  float total = 0;
  for (const JointSet& set : primitive.joint_sets) {
    const Vec4 w = set.weights[vertex];
    const std::array<float, 4> weights = {w.x, w.y, w.z, w.w};
    for (std::size_t i = 0; i < 4; ++i) {
      if (weights[i] > 0) {
        const Transform& joint = joints[set.joints[vertex][i]];
        sum.x += joint.x * weights[i];
        sum.y += joint.y * weights[i];
        sum.z += joint.z * weights[i];
        sum.t += joint.t * weights[i];
        total += weights[i];
      }
    }
  }
  if (!(total > 0)) {
    return joints[0];
  }
  const float scale = 1 / total;
  return {sum.x * scale, sum.y * scale, sum.z * scale, sum.t * scale};
}

}  // namespace

void apply_morph_targets(GltfPrimitive& primitive, std::span<const float> weights) {
  PrimitiveDescription& base = primitive.base;
  const std::size_t count = std::min(weights.size(), primitive.targets.size());
  for (std::size_t t = 0; t < count; ++t) {
    const MorphTarget& target = primitive.targets[t];
    const float w = weights[t];
    if (w == 0) {
      continue;
    }
    for (std::size_t i = 0; i < target.positions.size(); ++i) {
      base.positions[i] += target.positions[i] * w;
    }
    for (std::size_t i = 0; i < std::min(target.normals.size(), base.normals.size()); ++i) {
      base.normals[i] += target.normals[i] * w;
    }
    for (std::size_t i = 0; i < std::min(target.tangents.size(), base.tangents.size()); ++i) {
      Vec4& tangent = base.tangents[i];
      const Vec3 d = target.tangents[i] * w;
      tangent = {tangent.x + d.x, tangent.y + d.y, tangent.z + d.z, tangent.w};
    }
    for (std::size_t set = 0; set < 2; ++set) {
      for (std::size_t i = 0; i < std::min(target.uv[set].size(), base.uv[set].size()); ++i) {
        base.uv[set][i] = base.uv[set][i] + target.uv[set][i] * w;
      }
    }
    for (std::size_t i = 0; i < std::min(target.colors.size(), base.colors.size()); ++i) {
      Vec4& c = base.colors[i];
      const Vec4 d = target.colors[i];
      const auto sum = [w](float a, float b) { return std::clamp(a + w * b, 0.0F, 1.0F); };
      c = {sum(c.x, d.x), sum(c.y, d.y), sum(c.z, d.z), sum(c.w, d.w)};
    }
  }
}

std::size_t without_joints(const GltfPrimitive& primitive) {
  std::size_t count = 0;
  for (std::size_t v = 0; v < primitive.base.positions.size(); ++v) {
    const bool follows = std::any_of(primitive.joint_sets.begin(), primitive.joint_sets.end(),
                                     [v](const JointSet& set) {
                                       const Vec4 w = set.weights[v];
                                       return w.x > 0 || w.y > 0 || w.z > 0 || w.w > 0;
                                     });
    count += follows ? 0 : 1;
  }
  return count;
}

Status apply_skin(GltfPrimitive& primitive, std::span<const Transform> joint_matrices,
                  const std::string& where) {
  for (std::size_t set = 0; set < primitive.joint_sets.size(); ++set) {
    const JointSet& joints = primitive.joint_sets[set];
    for (std::size_t v = 0; v < joints.joints.size(); ++v) {
      const Vec4 w = joints.weights[v];
      const std::array<float, 4> weights = {w.x, w.y, w.z, w.w};
      for (std::size_t i = 0; i < 4; ++i) {
        if (weights[i] > 0 && joints.joints[v][i] >= joint_matrices.size()) {
          return Error{ErrorCode::kInvalidArgument,
                       "vertex " + std::to_string(v) + " follows joint " +
                           std::to_string(joints.joints[v][i]) + ", but the skin has " +
                           std::to_string(joint_matrices.size()),
                       where + "/attributes/JOINTS_" + std::to_string(set)};
        }
      }
    }
  }
  PrimitiveDescription& base = primitive.base;
  std::vector<bool> mirrored(base.positions.size(), false);
  for (std::size_t v = 0; v < base.positions.size(); ++v) {
    const Transform m = weighted_sum(primitive, v, joint_matrices);
    base.positions[v] = m.point(base.positions[v]);
    if (!base.normals.empty()) {
      base.normals[v] = normalize_or(m.normal(base.normals[v]), base.normals[v]);
    }
    if (!base.tangents.empty()) {
      base.tangents[v] = moved_tangent(m, base.tangents[v]);
    }
    mirrored[v] = m.determinant() < 0;
  }
  for (std::size_t t = 0; t < base.indices.size() / 3; ++t) {
    if (mirrored[base.indices[t * 3]]) {
      turn_triangle(base.indices, t);
    }
  }
  return ok_status();
}

void apply_transform(PrimitiveDescription& primitive, const Transform& transform) {
  for (Vec3& p : primitive.positions) {
    p = transform.point(p);
  }
  for (Vec3& n : primitive.normals) {
    n = normalize_or(transform.normal(n), n);
  }
  for (Vec4& t : primitive.tangents) {
    t = moved_tangent(transform, t);
  }
  if (transform.determinant() < 0) {
    for (std::size_t t = 0; t < primitive.indices.size() / 3; ++t) {
      turn_triangle(primitive.indices, t);
    }
  }
}

}  // namespace core
