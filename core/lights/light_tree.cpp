#include "core/lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/math/numbers.h"

namespace core {
namespace {

constexpr int kBuckets = 12;
constexpr double kPiExact = 3.14159265358979;

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

/// Integral over the directions of a cone of normals and of the emission around each.
double cone_measure(float cos_theta_o, float cos_theta_e) {
  const double cos_o = std::clamp(static_cast<double>(cos_theta_o), -1.0, 1.0);
  const double sin_o = std::sqrt(1 - cos_o * cos_o);
  if (cos_theta_e == 0) {  // theta_e = pi/2, so that theta_w = min(theta_o + pi/2, pi)
    const double emission = cos_o > 0 ? 0.5 * kPiExact * sin_o + cos_o
                                      : sin_o > 0 ? (kPiExact - std::acos(cos_o)) * sin_o : 0.0;
    return kPiExact * (2 * (1 - cos_o) + emission);
  }
  const double theta_o = std::acos(cos_o);
  const double theta_e = std::acos(std::clamp(static_cast<double>(cos_theta_e), -1.0, 1.0));
  const double theta_w = std::min(theta_o + theta_e, kPiExact);
  return kPiExact * (2 * (1 - cos_o) + 0.5 * (2 * theta_w * sin_o - std::cos(theta_o - 2 * theta_w) -
                                              2 * theta_o * sin_o + cos_o));
}

/// The cost of a group: power times surface times the measure of its cone of directions.
/// Source: Conty Estevez and Kulla 2018, eq. 1.
double orientation_cost(const LightBounds& b, Vec3 parent_diagonal, int axis) {
  const Vec3 d = b.box.diagonal();
  const double area = 2.0 * static_cast<double>(d.x * d.y + d.y * d.z + d.z * d.x);
  const float longest = max_component(parent_diagonal);
  const double regular = static_cast<double>(longest) /
                         std::max(1e-12, static_cast<double>(component(parent_diagonal, axis)));
  return static_cast<double>(b.power) * cone_measure(b.cos_theta_o, b.cos_theta_e) * regular * std::max(area, 1e-12);
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
  if (a.cos_theta_o <= -1 || b.cos_theta_o <= -1) {  // all directions
    out.axis = a.cos_theta_o <= -1 ? a.axis : b.axis;
    out.cos_theta_o = -1;
    return out;
  }
  // The cone around both cones. Source: PBR 4th ed. 3.8.4. First whether one holds the other, by cosines alone:
  // the larger half-angle is at least the angle between the axes plus the smaller one.
  const float cos_d = std::clamp(dot(a.axis, b.axis), -1.0F, 1.0F);
  const float sin_d = safe_sqrt(1 - cos_d * cos_d);
  const auto holds = [cos_d, sin_d](float cos_outer, float cos_inner) {
    const float sin_inner = safe_sqrt(1 - cos_inner * cos_inner);
    return cos_d > -cos_inner && cos_d * cos_inner - sin_d * sin_inner >= cos_outer;
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
  std::vector<Item> items;
  items.reserve(lights.size());
  for (const LightBounds& light : lights) {
    items.push_back({light, light.box.center(), static_cast<std::uint32_t>(items.size()), {}});
  }
  build(items, 0);
}

/// The cheapest of the splits between buckets along each axis. Buckets without lights make no split of
/// their own. Low sides grow from the left, high sides from the right, so that each bucket is merged twice.
LightTree::Split LightTree::best_split(std::span<Item> items, const Bounds& centers, Vec3 diagonal) {
  Split best;
  const Vec3 extent = centers.diagonal();
  if (items.size() == 2) {  // every split is the same but for the regularity of the axis
    for (int axis = 0; axis < 3; ++axis) {
      const bool longer = best.axis < 0 || component(diagonal, axis) > component(diagonal, best.axis);
      if (component(extent, axis) > 0 && longer) {
        best.axis = axis;
      }
    }
    if (best.axis >= 0) {
      best.bucket = 1;
      for (Item& item : items) {
        item.bucket[best.axis] = component(item.center, best.axis) > component(centers.min, best.axis) ? 1 : 0;
      }
    }
    return best;
  }
  std::array<std::array<LightBounds, kBuckets>, 3> buckets{};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(component(extent, axis) > 0)) {
      continue;
    }
    const float low = component(centers.min, axis);
    const float width = component(extent, axis);
    auto& along = buckets[static_cast<std::size_t>(axis)];
    for (Item& item : items) {
      const int b = std::clamp(static_cast<int>((component(item.center, axis) - low) / width * kBuckets), 0, kBuckets - 1);
      item.bucket[axis] = static_cast<std::uint8_t>(b);
      LightBounds& bucket = along[static_cast<std::size_t>(b)];
      bucket = merge_bounds(bucket, item.bounds);
    }
    std::array<double, kBuckets> cost_high{};  // of buckets from this one on
    LightBounds high;
    for (std::size_t b = kBuckets - 1; b > 0; --b) {
      if (along[b].power > 0) {
        high = merge_bounds(high, along[b]);
        cost_high[b] = orientation_cost(high, diagonal, axis);
      }
    }
    LightBounds side;
    for (std::size_t b = 0; b + 1 < kBuckets; ++b) {
      if (!(along[b].power > 0)) {
        continue;
      }
      side = merge_bounds(side, along[b]);
      std::size_t next = b + 1;
      while (next < kBuckets && !(along[next].power > 0)) {
        ++next;
      }
      if (next == kBuckets) {
        break;
      }
      const double cost = orientation_cost(side, diagonal, axis) + cost_high[next];
      if (cost < best.cost) {
        best = {cost, axis, static_cast<int>(b) + 1};
      }
    }
  }
  return best;
}

std::uint32_t LightTree::build(std::span<Item> items, std::uint32_t parent) {
  LightBounds all;
  Bounds centers;
  for (const Item& item : items) {
    all = merge_bounds(all, item.bounds);
    centers.add(item.center);
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
  node.leaf = items.size() == 1;
  if (node.leaf) {
    node.right = items[0].light;
    leaf_of_[items[0].light] = index;
    nodes_.push_back(node);
    return index;
  }
  nodes_.push_back(node);

  std::size_t middle = items.size() / 2;
  const Split split = best_split(items, centers, all.box.diagonal());
  if (split.axis >= 0) {
    const auto at = std::stable_partition(items.begin(), items.end(), [&split](const Item& item) {
      return item.bucket[split.axis] < split.bucket;
    });
    const auto count = static_cast<std::size_t>(at - items.begin());
    if (count > 0 && count < items.size()) {
      middle = count;
    }
  }
  build(items.subspan(0, middle), index);
  const std::uint32_t right = build(items.subspan(middle), index);
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
