#include "core/lights/light_tree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/math/numbers.h"

namespace core {
namespace {

constexpr int kBuckets = 12;
constexpr double kPiExact = 3.14159265358979;

constexpr float kOneDirection = 0.9999999F;  ///< cosine for a cone of normals with a single
                                             ///< direction

/// Returns the extent of a box with this half diagonal along a direction, from its centre.
float reach(Vec3 half, Vec3 along) {
  return std::fabs(along.x) * half.x + std::fabs(along.y) * half.y + std::fabs(along.z) * half.z;
}

float component(Vec3 v, int axis) { return v[axis]; }

/// Returns the integral over the directions of a cone of normals and the emission around each.
double cone_measure(float cos_theta_o, float cos_theta_e) {
  const double cos_o = std::clamp(static_cast<double>(cos_theta_o), -1.0, 1.0);
  const double sin_o = std::sqrt(1 - cos_o * cos_o);
  if (cos_theta_e == 0) {  // theta_e = pi/2, so that theta_w = min(theta_o + pi/2, pi)
    const double emission = cos_o > 0   ? 0.5 * kPiExact * sin_o + cos_o
                            : sin_o > 0 ? (kPiExact - std::acos(cos_o)) * sin_o
                                        : 0.0;
    return kPiExact * (2 * (1 - cos_o) + emission);
  }
  const double theta_o = std::acos(cos_o);
  const double theta_e = std::acos(std::clamp(static_cast<double>(cos_theta_e), -1.0, 1.0));
  const double theta_w = std::min(theta_o + theta_e, kPiExact);
  return kPiExact *
         (2 * (1 - cos_o) + 0.5 * (2 * theta_w * sin_o - std::cos(theta_o - 2 * theta_w) -
                                   2 * theta_o * sin_o + cos_o));
}

/// Returns the cost of a group: power times surface times the measure of its cone of directions.
/// Source: Conty Estevez and Kulla 2018, eq. 1. Pre: the diagonal is above 0 along the axis.
double orientation_cost(const LightBounds& b, Vec3 parent_diagonal, int axis) {
  const Vec3 d = b.box.diagonal();
  const double area = 2.0 * static_cast<double>(d.x * d.y + d.y * d.z + d.z * d.x);
  const float longest = max_component(parent_diagonal);
  const double regular =
      static_cast<double>(longest) / static_cast<double>(component(parent_diagonal, axis));
  return static_cast<double>(b.power) * cone_measure(b.cos_theta_o, b.cos_theta_e) * regular *
         std::max(area, 1e-12 * static_cast<double>(longest) * static_cast<double>(longest));
}

}  // namespace

LightBounds light_bounds(const PunctualLight& light) {
  LightBounds b;
  b.box.add(light.position);
  b.power = luminance(light.intensity);
  b.axis = light.direction;
  b.cos_theta_e = -1;
  if (light.type == PunctualType::kSpot) {
    b.cos_theta_e = light.cos_outer - 1e-4F;
  } else if (light.type == PunctualType::kProfile) {
    // A cone beyond a right angle would be weighted by negative cosines, so all directions are
    // used.
    const float edge = light.profile->cos_reach() - 1e-4F;
    b.cos_theta_e = edge > 0 ? edge : -1.0F;
    // The mean intensity over directions with emission.
    b.power *= light.shape_integral_sr() / (kTwoPi * (1 - b.cos_theta_e));
  }
  if (b.cos_theta_e == -1) {
    b.axis = {0, 0, 1};
    b.cos_theta_o = -1;
  }
  return b;
}

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
  // Returns the cone around both cones. Source: PBR 4th ed. 3.8.4. First tests by cosines whether
  // one contains the other: the larger half-angle is at least the angle between the axes plus the
  // smaller half-angle.
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
  const Vec3 k = normalize(turn);  // Rodrigues' formula; k is orthogonal to a.axis
  out.axis = normalize(a.axis * std::cos(theta_r) + cross(k, a.axis) * std::sin(theta_r));
  out.cos_theta_o = std::cos(theta_o);
  return out;
}

LightTree::LightTree(std::span<const LightBounds> lights) {
  leaf_of_.assign(lights.size(), kNoPlace);
  std::vector<Item> items;
  items.reserve(lights.size());
  for (std::size_t i = 0; i < lights.size(); ++i) {
    if (lights[i].power > 0) {
      items.push_back({lights[i], lights[i].box.center(), static_cast<std::uint32_t>(i), {}});
    }
  }
  if (items.empty()) {
    return;
  }
  std::vector<Node> nodes;
  nodes.reserve(2 * items.size());
  build(nodes, items);
  collapse(nodes);
}

/// Returns the cheapest split between buckets along any axis. Skips empty buckets. Lower sides
/// accumulate from the left, upper sides from the right, so each bucket is merged twice.
LightTree::Split LightTree::best_split(std::span<Item> items, const Bounds& centers,
                                       Vec3 diagonal) {
  Split best;
  const Vec3 extent = centers.diagonal();
  if (items.size() == 2) {  // all splits are equal except for the regularity factor of the axis
    for (int axis = 0; axis < 3; ++axis) {
      const bool longer =
          best.axis < 0 || component(diagonal, axis) > component(diagonal, best.axis);
      if (component(extent, axis) > 0 && longer) {
        best.axis = axis;
      }
    }
    if (best.axis >= 0) {
      best.bucket = 1;
      for (Item& item : items) {
        item.bucket[best.axis] =
            component(item.center, best.axis) > component(centers.min, best.axis) ? 1 : 0;
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
      const int b =
          std::clamp(static_cast<int>((component(item.center, axis) - low) / width * kBuckets), 0,
                     kBuckets - 1);
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

std::uint32_t LightTree::build(std::vector<Node>& nodes, std::span<Item> items) {
  Bounds centers;
  Node node;
  for (const Item& item : items) {
    node.bounds = merge_bounds(node.bounds, item.bounds);
    centers.add(item.center);
  }
  const auto index = static_cast<std::uint32_t>(nodes.size());
  node.leaf = items.size() == 1;
  if (node.leaf) {
    node.right = items[0].light;
    nodes.push_back(node);
    return index;
  }
  nodes.push_back(node);

  std::size_t middle = items.size() / 2;
  const Split split = best_split(items, centers, node.bounds.box.diagonal());
  if (split.axis >= 0) {
    const auto at = std::stable_partition(items.begin(), items.end(), [&split](const Item& item) {
      return item.bucket[split.axis] < split.bucket;
    });
    const auto count = static_cast<std::size_t>(at - items.begin());
    if (count > 0 && count < items.size()) {
      middle = count;
    }
  }
  build(nodes, items.subspan(0, middle));
  const std::uint32_t right = build(nodes, items.subspan(middle));
  nodes[index].right = right;
  return index;
}

void LightTree::set_child(Group& group, std::size_t lane, const Node& node) {
  const LightBounds& b = node.bounds;
  const Vec3 center = b.box.center();
  const Vec3 half = b.box.diagonal() * 0.5F;
  group.center_x[lane] = center.x;
  group.center_y[lane] = center.y;
  group.center_z[lane] = center.z;
  group.half_x[lane] = half.x;
  group.half_y[lane] = half.y;
  group.half_z[lane] = half.z;
  group.radius[lane] = length(half);
  group.axis_x[lane] = b.axis.x;
  group.axis_y[lane] = b.axis.y;
  group.axis_z[lane] = b.axis.z;
  const bool one_way = !b.two_sided && b.cos_theta_o > kOneDirection && b.cos_theta_e >= 0;
  group.axis_reach[lane] = one_way ? reach(half, b.axis) : std::numeric_limits<float>::infinity();
  group.power[lane] = b.power;
  group.cos_theta_o[lane] = b.cos_theta_o;
  group.sin_theta_o[lane] = safe_sqrt(1 - b.cos_theta_o * b.cos_theta_o);
  group.cos_theta_e[lane] = b.cos_theta_e;
  group.sign[lane] = b.two_sided ? 0x7fffffff : ~0;
  if (node.leaf) {
    group.child[lane] = ~static_cast<std::int32_t>(node.right);
  }
}

/// Collects the children of a group: those of the binary node; the largest is replaced by its own
/// two until there are four.
void LightTree::collapse(const std::vector<Node>& nodes) {
  struct Open {
    std::uint32_t node;
    std::uint32_t place;  ///< its position as a child in its group
  };
  std::vector<Open> open = {{0, 0}};
  for (std::size_t next = 0; next < open.size(); ++next) {
    const Open from = open[next];
    const auto index = static_cast<std::uint32_t>(groups_.size());
    Group& group = groups_.emplace_back();
    group.parent = from.place;
    if (index > 0) {
      groups_[from.place / kWidth].child[from.place % kWidth] = static_cast<std::int32_t>(index);
    }
    std::array<std::uint32_t, kWidth> members{};
    std::size_t count = 1;
    members[0] = from.node;
    while (count < kWidth) {
      std::size_t largest = kWidth;
      float size2 = -1;
      for (std::size_t k = 0; k < count; ++k) {
        const Node& node = nodes[members[k]];
        const float here = length_squared(node.bounds.box.diagonal());
        if (!node.leaf && here > size2) {
          largest = k;
          size2 = here;
        }
      }
      if (largest == kWidth) {
        break;
      }
      const std::uint32_t parent = members[largest];
      members[largest] = parent + 1;
      members[count++] = nodes[parent].right;
    }
    for (std::size_t k = 0; k < count; ++k) {
      const Node& node = nodes[members[k]];
      const std::uint32_t place = index * kWidth + static_cast<std::uint32_t>(k);
      set_child(group, k, node);
      if (node.leaf) {
        leaf_of_[node.right] = place;
      } else {
        open.push_back({members[k], place});
      }
    }
  }
}

/// Returns the importance of all children; 0 for those that send no light.
Floats<4> LightTree::importance(const Group& g, Vec3 point, Vec3 normal) noexcept {
  const auto of_group = [&g](auto Group::*member) { return load<4>((g.*member).data()); };
  const LightNodes<4> all = nodes<4>(of_group, of_group(&Group::sign));
  return light_importance(all, Vec3s<4>(point), Vec3s<4>(normal));
}

float LightTree::importance(Vec3 point, Vec3 normal_world) const noexcept {
  if (groups_.empty()) {
    return 0;
  }
  alignas(16) Four weights;
  store(weights.data(), importance(groups_[0], point, normal_world));
  return (weights[0] + weights[1]) + (weights[2] + weights[3]);
}

float LightTree::prob_light(Vec3 point, Vec3 normal_world, std::uint32_t light) const noexcept {
  std::uint32_t place = leaf_of_[light];
  if (place == kNoPlace) {
    return 0;
  }
  if (is_alone(groups_[0])) {
    return 1;
  }
  float prob = 1;
  while (true) {
    const Group& group = groups_[place / kWidth];
    alignas(16) Four weights;
    store(weights.data(), importance(group, point, normal_world));
    const float sum = (weights[0] + weights[1]) + (weights[2] + weights[3]);
    if (!(sum > 0)) {
      return 0;
    }
    prob *= weights[place % kWidth] / sum;
    if (place < kWidth) {
      return prob;
    }
    place = group.parent;
  }
}

std::size_t LightTree::bytes() const noexcept {
  return groups_.size() * sizeof(Group) + leaf_of_.size() * sizeof(std::uint32_t);
}

}  // namespace core
