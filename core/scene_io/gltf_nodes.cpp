#include "core/scene_io/gltf_nodes.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/scene_io/gltf_model.h"

namespace core {
namespace {

using Column = std::array<double, 3>;

Column image_of(const Affine& a, const Column& v) noexcept {
  Column out{};
  for (std::size_t r = 0; r < 3; ++r) {
    out[r] = a.column[0][r] * v[0] + a.column[1][r] * v[1] + a.column[2][r] * v[2];
  }
  return out;
}

Affine from_parts(const Column& t, std::array<double, 4> q, Column s) noexcept {
  std::replace(s.begin(), s.end(), 0.0, 1e-100);
  const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  q = length > 0 ? std::array{q[0] / length, q[1] / length, q[2] / length, q[3] / length}
                 : std::array<double, 4>{0, 0, 0, 1};
  const auto [x, y, z, w] = q;
  Affine m;
  m.column[0] = {(1 - 2 * (y * y + z * z)) * s[0], 2 * (x * y + w * z) * s[0],
                 2 * (x * z - w * y) * s[0]};
  m.column[1] = {2 * (x * y - w * z) * s[1], (1 - 2 * (x * x + z * z)) * s[1],
                 2 * (y * z + w * x) * s[1]};
  m.column[2] = {2 * (x * z + w * y) * s[2], 2 * (y * z - w * x) * s[2],
                 (1 - 2 * (x * x + y * y)) * s[2]};
  m.column[3] = t;
  return m;
}

Column widened(Vec3 v) noexcept {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}
std::array<double, 4> widened(Vec4 v) noexcept {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z),
          static_cast<double>(v.w)};
}

Affine local_matrix(const tinygltf::Node& node, const AnimatedNode* animated) {
  if (node.matrix.size() == 16 && animated == nullptr) {
    Affine m;
    for (std::size_t c = 0; c < 4; ++c) {
      m.column[c] = {node.matrix[c * 4], node.matrix[c * 4 + 1], node.matrix[c * 4 + 2]};
    }
    return m;
  }
  Column t = {0, 0, 0};
  Column s = {1, 1, 1};
  std::array<double, 4> q = {0, 0, 0, 1};
  if (node.translation.size() == 3) {
    std::copy_n(node.translation.begin(), 3, t.begin());
  }
  if (node.rotation.size() == 4) {
    std::copy_n(node.rotation.begin(), 4, q.begin());
  }
  if (node.scale.size() == 3) {
    std::copy_n(node.scale.begin(), 3, s.begin());
  }
  if (animated != nullptr) {
    t = animated->translation ? widened(*animated->translation) : t;
    q = animated->rotation ? widened(*animated->rotation) : q;
    s = animated->scale ? widened(*animated->scale) : s;
  }
  return from_parts(t, q, s);
}

// Returns null if only weights are animated, which do not move the node.
const AnimatedNode* moving(const AnimatedNodes& animated, int node) {
  const auto it = animated.find(node);
  const bool moves =
      it != animated.end() && (it->second.translation || it->second.rotation || it->second.scale);
  return moves ? &it->second : nullptr;
}

std::vector<int> roots(const tinygltf::Model& model) {
  std::vector<bool> is_child(model.nodes.size(), false);
  for (const tinygltf::Node& node : model.nodes) {
    for (const int child : node.children) {
      is_child[static_cast<std::size_t>(child)] = true;
    }
  }
  std::vector<int> out;
  for (std::size_t i = 0; i < is_child.size(); ++i) {
    if (!is_child[i]) {
      out.push_back(static_cast<int>(i));
    }
  }
  return out;
}

// Depth first in document order. A node listed twice counts once.
std::vector<int> below(const tinygltf::Model& model, const std::vector<int>& start) {
  std::vector<int> order;
  std::vector<bool> seen(model.nodes.size(), false);
  std::vector<int> open(start.rbegin(), start.rend());
  while (!open.empty()) {
    const int node = open.back();
    open.pop_back();
    if (seen[static_cast<std::size_t>(node)]) {
      continue;
    }
    seen[static_cast<std::size_t>(node)] = true;
    order.push_back(node);
    const auto& children = model.nodes[static_cast<std::size_t>(node)].children;
    open.insert(open.end(), children.rbegin(), children.rend());
  }
  return order;
}

}  // namespace

Affine Affine::from(Place origin) const noexcept {
  Affine out = *this;
  for (std::size_t r = 0; r < 3; ++r) {
    out.column[3][r] -= origin[static_cast<int>(r)];
  }
  return out;
}

Transform Affine::to_transform() const noexcept {
  const auto vec = [](const Column& c) {
    return Vec3{static_cast<float>(c[0]), static_cast<float>(c[1]), static_cast<float>(c[2])};
  };
  return {vec(column[0]), vec(column[1]), vec(column[2]), vec(column[3])};
}

bool Affine::is_finite() const noexcept {
  constexpr auto kMax = static_cast<double>(std::numeric_limits<float>::max());
  return std::all_of(column.begin(), column.end(), [](const Column& c) {
    return std::all_of(c.begin(), c.end(), [](double v) { return std::abs(v) <= kMax; });
  });
}

Affine operator*(const Affine& a, const Affine& b) noexcept {
  Affine out;
  for (std::size_t c = 0; c < 4; ++c) {
    out.column[c] = image_of(a, b.column[c]);
  }
  for (std::size_t r = 0; r < 3; ++r) {
    out.column[3][r] += a.column[3][r];
  }
  return out;
}

Affine affine_from_parts(Vec3 translation, Vec4 rotation, Vec3 scale) noexcept {
  return from_parts(widened(translation), widened(rotation), widened(scale));
}

Affine without_scale(Affine map) noexcept {
  for (std::size_t c = 0; c < 3; ++c) {
    Column& axis = map.column[c];
    const double size = std::hypot(axis[0], axis[1], axis[2]);
    for (double& v : axis) {
      v = size > 0 ? v / size : v;
    }
  }
  return map;
}

Result<std::vector<Affine>> world_matrices(const tinygltf::Model& model,
                                           const AnimatedNodes& animated) {
  std::vector<Affine> world(model.nodes.size());
  for (const int i : below(model, roots(model))) {
    const auto node = static_cast<std::size_t>(i);
    // Parents come first, so world[node] already holds the parent's matrix.
    world[node] = world[node] * local_matrix(model.nodes[node], moving(animated, i));
    if (!world[node].is_finite()) {
      return Error{ErrorCode::kInvalidArgument,
                   "the transform of the node is too large for a 32-bit float",
                   "/nodes/" + std::to_string(i)};
    }
    for (const int child : model.nodes[node].children) {
      world[static_cast<std::size_t>(child)] = world[node];
    }
  }
  return world;
}

Result<int> chosen_scene(const tinygltf::Model& model, int scene_index) {
  const auto count = static_cast<int>(model.scenes.size());
  if (scene_index >= count || scene_index < -1) {
    return Error{
        ErrorCode::kInvalidArgument,
        std::to_string(scene_index) + " names none of the " + std::to_string(count) + " scenes",
        "/scene_index"};
  }
  return count == 0 ? -1 : scene_index >= 0 ? scene_index : std::max(model.defaultScene, 0);
}

Result<std::vector<int>> nodes_of_scene(const tinygltf::Model& model, int scene_index) {
  const auto chosen = chosen_scene(model, scene_index);
  if (!chosen) {
    return chosen.error();
  }
  return below(model,
               *chosen < 0 ? roots(model) : model.scenes[static_cast<std::size_t>(*chosen)].nodes);
}

bool is_shown(const tinygltf::Node& node) {
  const auto* own = find_extension(node.extensions, "KHR_node_visibility");
  return own == nullptr || !own->Has("visible") || own->Get("visible").Get<bool>();
}

std::vector<bool> visible_nodes(const tinygltf::Model& model, const AnimatedNodes& animated) {
  std::vector<bool> visible(model.nodes.size(), true);
  for (const int i : below(model, roots(model))) {
    const auto node = static_cast<std::size_t>(i);
    const auto it = animated.find(i);
    if (!is_shown(model.nodes[node]) && !(it != animated.end() && it->second.is_shown_once)) {
      visible[node] = false;
    }
    // Parents come first.
    for (const int child : model.nodes[node].children) {
      visible[static_cast<std::size_t>(child)] = visible[node];
    }
  }
  return visible;
}

}  // namespace core
