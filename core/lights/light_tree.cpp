#include "core/lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/math/numbers.h"

namespace core {
namespace {

constexpr int kBuckets = 12;

/// cos(max(0, a - b)) from sines and cosines.
float cos_sub_clamped(float sin_a, float cos_a, float sin_b, float cos_b) {
  return cos_a > cos_b ? 1.0F : cos_a * cos_b + sin_a * sin_b;
}

constexpr float kOneDirection = 0.9999999F;  ///< cosine of a cone of normals that is one direction

/// How far a box with this half diagonal reaches from its centre along a direction.
float reach(Vec3 half, Vec3 along) {
  return std::fabs(along.x) * half.x + std::fabs(along.y) * half.y + std::fabs(along.z) * half.z;
}

float component(Vec3 v, int axis) { return v[axis]; }

/// The cost of a group: power times surface times the measure of its cone of directions.
/// Source: Conty Estevez and Kulla 2018, eq. 1.
double orientation_cost(const LightBounds& b, Vec3 parent_diagonal, int axis) {
  const double theta_o = std::acos(std::clamp(static_cast<double>(b.cos_theta_o), -1.0, 1.0));
  const double theta_e = std::acos(std::clamp(static_cast<double>(b.cos_theta_e), -1.0, 1.0));
  const double theta_w = std::min(theta_o + theta_e, 3.14159265358979);
  const double sin_o = std::sin(theta_o);
  const double cos_o = std::cos(theta_o);
  const double measure =
      6.28318530717959 * (1 - cos_o) +
      1.57079632679490 * (2 * theta_w * sin_o - std::cos(theta_o - 2 * theta_w) -
                          2 * theta_o * sin_o + cos_o);
  const Vec3 d = b.box.diagonal();
  const double area = 2.0 * static_cast<double>(d.x * d.y + d.y * d.z + d.z * d.x);
  const float longest = max_component(parent_diagonal);
  const double regular = static_cast<double>(longest) /
                         std::max(1e-12, static_cast<double>(component(parent_diagonal, axis)));
  return static_cast<double>(b.power) * measure * regular * std::max(area, 1e-12);
}

}  // namespace

LightBounds merge_bounds(const LightBounds& a, const LightBounds& b) {
  if (!(a.power > 0)) {
    return b;
  }
  if (!(b.power > 0)) {
    return a;
  }
  LightBounds out;
  out.box = a.box;
  out.box.add(b.box);
  out.power = a.power + b.power;
  out.two_sided = a.two_sided || b.two_sided;
  out.cos_theta_e = std::min(a.cos_theta_e, b.cos_theta_e);
  // The cone around both cones. Source: PBR 4th ed. 3.8.4. First whether one holds the other, by cosines alone:
  // the larger half-angle is at least the angle between the axes plus the smaller one.
  const float cos_d = std::clamp(dot(a.axis, b.axis), -1.0F, 1.0F);
  const float sin_d = safe_sqrt(1 - cos_d * cos_d);
  const auto holds = [cos_d, sin_d](float cos_outer, float cos_inner) {
    const float sin_inner = safe_sqrt(1 - cos_inner * cos_inner);
    return cos_outer <= -1 || (cos_d > -cos_inner && cos_d * cos_inner - sin_d * sin_inner >= cos_outer);
  };
  if (holds(a.cos_theta_o, b.cos_theta_o)) {
    out.axis = a.axis;
    out.cos_theta_o = a.cos_theta_o;
    return out;
  }
  if (holds(b.cos_theta_o, a.cos_theta_o)) {
    out.axis = b.axis;
    out.cos_theta_o = b.cos_theta_o;
    return out;
  }
  const float theta_a = std::acos(std::clamp(a.cos_theta_o, -1.0F, 1.0F));
  const float theta_b = std::acos(std::clamp(b.cos_theta_o, -1.0F, 1.0F));
  const float theta_d = std::acos(cos_d);
  const float theta_o = (theta_a + theta_d + theta_b) * 0.5F;
  const Vec3 turn = cross(a.axis, b.axis);
  if (theta_o >= kPi || !(dot(turn, turn) > 1e-12F)) {
    out.axis = a.axis;
    out.cos_theta_o = -1;
    return out;
  }
  const float theta_r = theta_o - theta_a;
  const Vec3 k = normalize(turn);  // Rodrigues; k is at right angles to a.axis
  out.axis = normalize(a.axis * std::cos(theta_r) + cross(k, a.axis) * std::sin(theta_r));
  out.cos_theta_o = std::cos(theta_o);
  return out;
}

LightTree::LightTree(std::span<const LightBounds> lights) {
  leaf_of_.assign(lights.size(), 0);
  if (lights.empty()) {
    return;
  }
  nodes_.reserve(2 * lights.size());
  std::vector<std::uint32_t> order(lights.size());
  std::iota(order.begin(), order.end(), 0U);
  build(lights, order, 0);
}

std::uint32_t LightTree::build(std::span<const LightBounds> lights, std::span<std::uint32_t> order,
                               std::uint32_t parent) {
  LightBounds all;
  Bounds centers;
  for (const std::uint32_t i : order) {
    all = merge_bounds(all, lights[i]);
    centers.add(lights[i].box.center());
  }
  const auto index = static_cast<std::uint32_t>(nodes_.size());
  Node node;
  node.center = all.box.center();
  node.half = all.box.diagonal() * 0.5F;
  node.radius2 = length_squared(node.half);
  node.axis = all.axis;
  node.power = all.power;
  node.cos_theta_o = all.cos_theta_o;
  node.sin_theta_o = safe_sqrt(1 - all.cos_theta_o * all.cos_theta_o);
  node.cos_theta_e = all.cos_theta_e;
  node.two_sided = all.two_sided;
  node.parent = parent;
  node.leaf = order.size() == 1;
  if (node.leaf) {
    node.right = order[0];
    leaf_of_[order[0]] = index;
    nodes_.push_back(node);
    return index;
  }
  nodes_.push_back(node);

  std::size_t middle = order.size() / 2;
  double best = 1e300;
  int best_axis = -1;
  int best_split = 0;
  const Vec3 extent = centers.diagonal();
  const auto bucket_of = [&](std::uint32_t i, int axis) {
    const float at = (component(lights[i].box.center(), axis) - component(centers.min, axis)) /
                     component(extent, axis);
    return std::clamp(static_cast<int>(at * kBuckets), 0, kBuckets - 1);
  };
  for (int axis = 0; axis < 3; ++axis) {
    if (!(component(extent, axis) > 0)) {
      continue;
    }
    std::array<LightBounds, kBuckets> buckets{};
    for (const std::uint32_t i : order) {
      auto& bucket = buckets[static_cast<std::size_t>(bucket_of(i, axis))];
      bucket = merge_bounds(bucket, lights[i]);
    }
    for (int split = 1; split < kBuckets; ++split) {
      LightBounds low;
      LightBounds high;
      for (int b = 0; b < kBuckets; ++b) {
        LightBounds& side = b < split ? low : high;
        side = merge_bounds(side, buckets[static_cast<std::size_t>(b)]);
      }
      if (!(low.power > 0) || !(high.power > 0)) {
        continue;
      }
      const Vec3 diagonal = all.box.diagonal();
      const double cost = orientation_cost(low, diagonal, axis) + orientation_cost(high, diagonal, axis);
      if (cost < best) {
        best = cost;
        best_axis = axis;
        best_split = split;
      }
    }
  }
  if (best_axis >= 0) {
    const auto split = std::stable_partition(order.begin(), order.end(), [&](std::uint32_t i) {
      return bucket_of(i, best_axis) < best_split;
    });
    const auto count = static_cast<std::size_t>(split - order.begin());
    if (count > 0 && count < order.size()) {
      middle = count;
    }
  }
  build(lights, order.subspan(0, middle), index);
  const std::uint32_t right = build(lights, order.subspan(middle), index);
  nodes_[index].right = right;
  return index;
}

float LightTree::importance(const Node& node, Vec3 point, Vec3 normal) noexcept {
  if (!(node.power > 0)) {
    return 0;
  }
  const Vec3 to_point = point - node.center;
  // The sphere around the box, used below, is generous; nothing of a box wholly below the surface arrives, nor
  // of lights that face one way and have the point behind them.
  if (dot(normal, to_point) >= reach(node.half, normal) && dot(normal, normal) > 0) {
    return 0;
  }
  if (!node.two_sided && node.cos_theta_o > kOneDirection && node.cos_theta_e >= 0 &&
      dot(node.axis, to_point) <= -reach(node.half, node.axis)) {
    return 0;
  }
  const float distance2 = dot(to_point, to_point);
  const float d2 = std::max(std::max(distance2, node.radius2), 1e-20F);
  const bool inside = distance2 <= node.radius2 * 1.0001F;
  const float inverse = distance2 > 0 ? 1 / std::sqrt(distance2) : 0.0F;
  float cos_w = dot(node.axis, to_point) * inverse;
  if (node.two_sided) {
    cos_w = std::fabs(cos_w);
  }
  const float sin_w = safe_sqrt(1 - cos_w * cos_w);
  const float sin2_b = inside ? 0.0F : node.radius2 / distance2;
  const float cos_b = inside ? -1.0F : safe_sqrt(1 - sin2_b);
  const float sin_b = inside ? 0.0F : std::sqrt(sin2_b);
  const float cos_x = cos_sub_clamped(sin_w, cos_w, node.sin_theta_o, node.cos_theta_o);
  const float sin_x = safe_sqrt(1 - cos_x * cos_x);
  const float cos_p = cos_sub_clamped(sin_x, cos_x, sin_b, cos_b);
  if (cos_p <= node.cos_theta_e) {
    return 0;
  }
  // With emission over the whole sphere (points) the cosine says nothing about power.
  float value = node.power * (node.cos_theta_e < -0.99F ? 1.0F : cos_p) / d2;
  if (dot(normal, normal) > 0) {
    const float cos_i = -dot(to_point, normal) * inverse;
    const float sin_i = safe_sqrt(1 - cos_i * cos_i);
    value *= std::max(cos_sub_clamped(sin_i, cos_i, sin_b, cos_b), 0.0F);
  }
  return value;
}

LightTree::Pick LightTree::pick(Vec3 point, Vec3 normal_world, float u) const noexcept {
  if (nodes_.empty()) {
    return {};
  }
  std::uint32_t at = 0;
  float prob = 1;
  while (!nodes_[at].leaf) {
    const std::uint32_t left = at + 1;
    const std::uint32_t right = nodes_[at].right;
    const float a = importance(nodes_[left], point, normal_world);
    const float b = importance(nodes_[right], point, normal_world);
    const float sum = a + b;
    if (!(sum > 0)) {
      return {};
    }
    const float p = a / sum;
    if (u < p) {
      at = left;
      u = std::min(u / p, kOneMinusEpsilon);
      prob *= p;
    } else {
      at = right;
      u = std::min((u - p) / (1 - p), kOneMinusEpsilon);
      prob *= 1 - p;
    }
  }
  return {nodes_[at].right, prob, std::max(u, 0.0F)};
}

float LightTree::prob_light(Vec3 point, Vec3 normal_world, std::uint32_t light) const noexcept {
  std::uint32_t at = leaf_of_[light];
  float prob = 1;
  while (at != 0) {
    const std::uint32_t parent = nodes_[at].parent;
    const float a = importance(nodes_[parent + 1], point, normal_world);
    const float b = importance(nodes_[nodes_[parent].right], point, normal_world);
    const float sum = a + b;
    if (!(sum > 0)) {
      return 0;
    }
    const float p = a / sum;
    prob *= at == parent + 1 ? p : 1 - p;
    at = parent;
  }
  return prob;
}

std::size_t LightTree::bytes() const noexcept {
  return nodes_.size() * sizeof(Node) + leaf_of_.size() * sizeof(std::uint32_t);
}

}  // namespace core
