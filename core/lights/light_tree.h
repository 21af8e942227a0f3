/// LightTree: picks one of many bounded lights with probability near its contribution.
///
/// Nodes store a bounding box, an emission cone and power. The tree is built as a binary tree, by
/// cost, and stored with up to four children per node, whose importance at a point is computed
/// together. This halves the number of steps, and each choice is among tighter boxes. Source: Conty
/// Estevez and Kulla, Importance Sampling of Many Lights with Adaptive Tree Splitting, 2018.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/lights/light.h"
#include "core/lights/light_importance.h"
#include "core/math/bounds.h"
#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

/// Bounds of a light or a group of lights.
struct LightBounds {
  Bounds box;
  Vec3 axis = {0, 0, 1};  ///< axis of the cone of normals, unit
  float cos_theta_o = 1;  ///< half-angle of the normals around the axis
  float cos_theta_e = 0;  ///< half-angle of emission beyond the normals
  float power = 0;        ///< luminance times area (times 4 pi for points)
  bool two_sided = false;
};

/// Returns the bounds of a punctual light that is not directional.
LightBounds light_bounds(const PunctualLight& light);

class LightTree {
 public:
  LightTree() = default;
  /// Lights without power are left out and never picked.
  explicit LightTree(std::span<const LightBounds> lights);

  template <std::size_t N>
  struct Picks {
    Ints<N> light;
    Floats<N> prob_light;  ///< 0: no light can contribute at this point
  };
  /// For the lanes in `asked`; the results of the others are unspecified, but lights. normal_world:
  /// of the surface at `point`; {0,0,0} if light may come from anywhere.
  template <std::size_t N>
  Picks<N> pick(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal_world, Floats<N> u) const noexcept;
  /// Returns whether pick_few() can be used.
  bool is_few() const noexcept { return groups_.size() == 1; }
  /// As pick(), inlined, in trees with at most as many lights as a group has.
  template <std::size_t N>
  Picks<N> pick_few(Vec3s<N> point, Vec3s<N> normal_world, Floats<N> u) const noexcept;
  float prob_light(Vec3 point, Vec3 normal_world, std::uint32_t light) const noexcept;
  /// Returns the tree's estimate of the unshadowed irradiance from all of its lights at `point`
  /// [W/m^2, luminance]; 0 if no light can arrive.
  float importance(Vec3 point, Vec3 normal_world) const noexcept;
  /// As above, for several points.
  template <std::size_t N>
  Floats<N> importance(Vec3s<N> point, Vec3s<N> normal_world) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  static constexpr std::uint32_t kWidth = 4;
  static constexpr std::uint32_t kNoPlace = 0xffffffffU;
  /// A node of the binary tree during the build.
  struct Node {
    LightBounds bounds;
    std::uint32_t right = 0;  ///< second child (the first follows its parent); of a leaf: the light
    bool leaf = false;
  };
  using Four = std::array<float, kWidth>;
  /// Up to four children; missing ones have no power.
  struct alignas(16) Group {
    Four center_x{};
    Four center_y{};
    Four center_z{};
    Four half_x{};  ///< half diagonal
    Four half_y{};
    Four half_z{};
    Four radius{};  ///< of the half diagonal
    Four axis_x{};
    Four axis_y{};
    Four axis_z{};
    Four axis_reach{};  ///< extent of the box along the axis; infinite if points behind the lights
                        ///< receive light
    Four power{};
    Four cos_theta_o{};
    Four sin_theta_o{};
    Four cos_theta_e{};
    std::array<std::int32_t, kWidth> sign{};   ///< bits of the cosine to the axis to keep: the sign
                                               ///< bit is cleared for two-sided lights
    std::array<std::int32_t, kWidth> child{};  ///< a group, or the complement of a light
    std::uint32_t parent = 0;  ///< position of this group in its parent: group * kWidth + child
  };
  /// A light during the build.
  struct Item {
    LightBounds bounds;
    Vec3 center;
    std::uint32_t light = 0;
    std::uint8_t bucket[3] = {};  ///< along each axis, in the group being split
  };
  struct Split {
    double cost = 1e300;
    int axis = -1;   ///< -1: none
    int bucket = 0;  ///< first bucket of the upper side
  };
  static Split best_split(std::span<Item> items, const Bounds& centers, Vec3 diagonal);
  static std::uint32_t build(std::vector<Node>& nodes, std::span<Item> items);
  void collapse(const std::vector<Node>& nodes);
  static void set_child(Group& group, std::size_t lane, const Node& node);
  /// Returns whether the group holds a single light, as its first child.
  static bool is_alone(const Group& group) noexcept {
    return group.child[0] < 0 && group.power[1] == 0;
  }
  static Floats<4> importance(const Group& group, Vec3 point, Vec3 normal) noexcept;
  template <std::size_t N>
  static std::array<Floats<N>, kWidth> importances(const Group& group, Vec3s<N> point,
                                                   Vec3s<N> normal_world) noexcept;
  /// As above, of one group for each point in `asked`.
  template <std::size_t N>
  static std::array<Floats<N>, kWidth> importances(const Group* const (&groups)[N], unsigned asked,
                                                   Vec3s<N> point, Vec3s<N> normal_world) noexcept;
  template <std::size_t N>
  static LightNodes<N> node(const Group& g, std::size_t k) noexcept;
  /// The nodes of a group, or of two, four lanes each; lanes(member): of theirs.
  template <std::size_t N, typename Lanes>
  static LightNodes<N> nodes(const Lanes& lanes, Ints<N> sign) noexcept;
  template <std::size_t N>
  struct Step {
    Ints<N> child;
    Floats<N> prob;
    Floats<N> rest;    ///< of u times the sum of the weights
    Floats<N> weight;  ///< of the child
  };
  /// Picks among children in proportion to their weights.
  template <std::size_t N>
  static Step<N> choose(const std::array<Floats<N>, kWidth>& weights,
                        const Ints<N> (&children)[kWidth], Floats<N> u) noexcept;
  template <std::size_t N>
  [[gnu::noinline]] Picks<N> descend(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal_world,
                                     Floats<N> u) const noexcept;

  std::vector<Group> groups_;
  std::vector<std::uint32_t> leaf_of_;  ///< by light: group * kWidth + child, or kNoPlace
};

template <std::size_t N>
LightNodes<N> LightTree::node(const Group& g, std::size_t k) noexcept {
  return {{g.center_x[k], g.center_y[k], g.center_z[k]},
          {g.half_x[k], g.half_y[k], g.half_z[k]},
          g.radius[k],
          {g.axis_x[k], g.axis_y[k], g.axis_z[k]},
          g.axis_reach[k],
          g.power[k],
          g.cos_theta_o[k],
          g.sin_theta_o[k],
          g.cos_theta_e[k],
          Ints<N>(g.sign[k])};
}

template <std::size_t N>
auto LightTree::importances(const Group& group, Vec3s<N> point, Vec3s<N> normal_world) noexcept
    -> std::array<Floats<N>, kWidth> {
  std::array<Floats<N>, kWidth> out;
  for (std::size_t k = 0; k < kWidth; ++k) {
    out[k] = group.power[k] > 0 ? light_importance(node<N>(group, k), point, normal_world)
                                : Floats<N>(0);
  }
  return out;
}

template <std::size_t N>
Floats<N> LightTree::importance(Vec3s<N> point, Vec3s<N> normal_world) const noexcept {
  if (groups_.empty()) {
    return Floats<N>(0);
  }
  const auto weights = importances(groups_[0], point, normal_world);
  return (weights[0] + weights[1]) + (weights[2] + weights[3]);
}

template <std::size_t N, typename Lanes>
LightNodes<N> LightTree::nodes(const Lanes& lanes, Ints<N> sign) noexcept {
  return {{lanes(&Group::center_x), lanes(&Group::center_y), lanes(&Group::center_z)},
          {lanes(&Group::half_x), lanes(&Group::half_y), lanes(&Group::half_z)},
          lanes(&Group::radius),
          {lanes(&Group::axis_x), lanes(&Group::axis_y), lanes(&Group::axis_z)},
          lanes(&Group::axis_reach),
          lanes(&Group::power),
          lanes(&Group::cos_theta_o),
          lanes(&Group::sin_theta_o),
          lanes(&Group::cos_theta_e),
          sign};
}

template <std::size_t N>
auto LightTree::importances(const Group* const (&groups)[N], unsigned asked, Vec3s<N> point,
                            Vec3s<N> normal_world) noexcept -> std::array<Floats<N>, kWidth> {
  alignas(32) float weights[kWidth * (N + 1)];
  const float* rows[N];
  std::fill_n(rows, N, weights);
  float* to = weights;
  if constexpr (N == 1) {
    store(weights, importance(*groups[0], point.lane(0), normal_world.lane(0)));
  } else {
    for (; asked != 0; to += 2 * kWidth) {  // two groups at a time
      const auto i = static_cast<std::size_t>(std::countr_zero(asked));
      asked &= asked - 1;
      const auto k = asked != 0 ? static_cast<std::size_t>(std::countr_zero(asked)) : i;
      asked &= asked - 1;
      const auto both = [i, k](Vec3s<N> v) {
        return Vec3s<N>(halves<N>(v.x.v[i], v.x.v[k]), halves<N>(v.y.v[i], v.y.v[k]),
                        halves<N>(v.z.v[i], v.z.v[k]));
      };
      const auto of_both = [a = groups[i], b = groups[k]](auto Group::*member) {
        return load_halves<N>((a->*member).data(), (b->*member).data());
      };
      store(to, light_importance(nodes<N>(of_both, of_both(&Group::sign)), both(point),
                                 both(normal_world)));
      rows[i] = to;
      rows[k] = k == i ? to : to + kWidth;
    }
  }
  Floats<N> columns[kWidth];
  transpose(rows, columns);
  return {columns[0], columns[1], columns[2], columns[3]};
}

template <std::size_t N>
auto LightTree::choose(const std::array<Floats<N>, kWidth>& weights,
                       const Ints<N> (&children)[kWidth], Floats<N> u) noexcept -> Step<N> {
  const Floats<N> zero(0);
  const Floats<N> sum = (weights[0] + weights[1]) + (weights[2] + weights[3]);
  Floats<N> rest = u * sum;
  Mask<N> found = Mask<N>::of(0);
  Floats<N> weight = zero;
  Ints<N> child(~0);
  for (std::size_t k = 0; k < kWidth; ++k) {
    const Mask<N> open = ~found & (weights[k] > zero);
    child = select(open, children[k], child);
    weight = select(open, weights[k], weight);
    found = found | (open & (rest < weights[k]));
    rest = select(open & ~found, rest - weights[k], rest);
  }
  return {child, select(sum > zero, weight / sum, zero), rest, weight};
}

template <std::size_t N>
LightTree::Picks<N> LightTree::pick(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal_world,
                                    Floats<N> u) const noexcept {
  if (groups_.empty()) {
    return {Ints<N>(0), Floats<N>(0)};
  }
  return is_few() ? pick_few(point, normal_world, u) : descend(asked, point, normal_world, u);
}

template <std::size_t N>
LightTree::Picks<N> LightTree::pick_few(Vec3s<N> point, Vec3s<N> normal_world,
                                        Floats<N> u) const noexcept {
  const Group& root = groups_[0];
  if (is_alone(root)) {
    return {Ints<N>(~root.child[0]), Floats<N>(1)};
  }
  const Ints<N> children[kWidth] = {root.child[0], root.child[1], root.child[2], root.child[3]};
  const Step<N> step = choose(importances(root, point, normal_world), children, u);
  return {Ints<N>(~step.child.v), step.prob};
}

template <std::size_t N>
LightTree::Picks<N> LightTree::descend(Mask<N> asked, Vec3s<N> point, Vec3s<N> normal_world,
                                       Floats<N> u) const noexcept {
  Ints<N> at = select(asked, Ints<N>(0), Ints<N>(~0));
  Floats<N> prob(1);
  for (Mask<N> inner = asked; inner.any(); inner = ~(at < Ints<N>(0))) {
    const Group* groups[N];
    const std::int32_t* rows[N];
    for (std::size_t k = 0; k < N; ++k) {
      groups[k] = &groups_[static_cast<std::size_t>(std::max(at.v[k], 0))];
      rows[k] = groups[k]->child.data();
    }
    Ints<N> children[kWidth];
    transpose(rows, children);
    const Step<N> step =
        choose(importances(groups, inner.bits(), point, normal_world), children, u);
    at = select(inner, step.child, at);
    prob = select(inner, prob * step.prob, prob);
    // Rounding may leave slightly more than the last weight.
    u = min(max(step.rest / step.weight, Floats<N>(0)), Floats<N>(kOneMinusEpsilon));
  }
  return {Ints<N>(~at.v), prob};
}

/// Returns the smallest bounds of both. Exposed for tests.
LightBounds merge_bounds(const LightBounds& a, const LightBounds& b);

}  // namespace core
