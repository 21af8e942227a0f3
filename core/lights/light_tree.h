/// LightTree: picks one of many bounded lights with probability near its contribution.
///
/// A binary tree whose nodes know bounding box, cone of emission and power.
/// Source: Conty Estevez and Kulla, Importance Sampling of Many Lights with Adaptive Tree Splitting, 2018; the
/// importance is PBR 4th ed. 12.6.3.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/math/bounds.h"
#include "core/math/vec.h"

namespace core {

/// What the tree knows of a light or of a group of them.
struct LightBounds {
  Bounds box;
  Vec3 axis = {0, 0, 1};   ///< of the normals' cone, unit
  float cos_theta_o = 1;   ///< half-angle of the normals around the axis
  float cos_theta_e = 0;   ///< emission beyond the normals
  float power = 0;         ///< luminance times area (or 4 pi for points)
  bool two_sided = false;
};

class LightTree {
 public:
  LightTree() = default;
  explicit LightTree(std::span<const LightBounds> lights);

  struct Pick {
    std::uint32_t light = 0;
    float prob_light = 0;  ///< 0: nothing can contribute at this point
    float u_left = 0;      ///< what remains of u, again uniform in [0,1)
  };
  /// normal_world: of the surface at `point`; {0,0,0} where light may come from anywhere.
  Pick pick(Vec3 point, Vec3 normal_world, float u) const noexcept;
  float prob_light(Vec3 point, Vec3 normal_world, std::uint32_t light) const noexcept;
  std::size_t size() const noexcept { return leaf_of_.size(); }
  std::size_t bytes() const noexcept;

 private:
  struct Node {
    Vec3 center;
    float radius2 = 0;       ///< squared half diagonal
    Vec3 half;               ///< half diagonal
    Vec3 axis;
    float power = 0;
    float cos_theta_o = 1;
    float sin_theta_o = 0;
    float cos_theta_e = 0;
    std::uint32_t right = 0;  ///< second child; the first follows its parent. Leaf: the light
    std::uint32_t parent = 0;
    bool leaf = false;
    bool two_sided = false;
  };
  /// A light on its way to its leaf.
  struct Item {
    LightBounds bounds;
    Vec3 center;
    std::uint32_t light = 0;
    std::uint8_t bucket[3] = {};  ///< along each axis, in the group that is being split
  };
  struct Split {
    double cost = 1e300;
    int axis = -1;  ///< none
    int bucket = 0;  ///< the first of the high side
  };
  static Split best_split(std::span<Item> items, const Bounds& centers, Vec3 diagonal);
  std::uint32_t build(std::span<Item> items, std::uint32_t parent);
  static float importance(const Node& node, Vec3 point, Vec3 normal) noexcept;

  std::vector<Node> nodes_;
  std::vector<std::uint32_t> leaf_of_;
};

/// The smallest bounds of both. Exposed for tests.
LightBounds merge_bounds(const LightBounds& a, const LightBounds& b);

}  // namespace core
