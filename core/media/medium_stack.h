/// Solids, and the stack of solids around a point.
///
/// Where solids share space, it belongs to one of them, and the surfaces of the others do not exist
/// there. Source: Schmidt and Budge, Simple Nested Dielectrics in Ray Traced Images, Journal of
/// Graphics Tools 7(2), 2002. The order is the same from all sides, so light and camera paths
/// agree.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/math/bounds.h"
#include "core/math/vec.h"

namespace core {

struct Material;

enum class SolidKind : std::uint8_t {
  kClosed,  ///< its surface is closed
  kOpen,    ///< its surface has a border: water that ends at walls, a bottle without a bottom
  kCavity,  ///< its surface is closed and faces inwards: a bubble in another solid
};

/// A volume that triangles bound.
struct Solid {
  const Material* material = nullptr;  ///< of the interior
  SolidKind kind = SolidKind::kClosed;
  bool is_inside_out = false;  ///< closed, but its triangles face inwards, outside other solids
  std::uint32_t rank = 0;      ///< shared space belongs to the highest
  bool shares_space = false;   ///< may touch or overlap others
  bool scatters = false;       ///< its interior
  Bounds box;                  ///< world, at all times
  /// Index of refraction of the interior at 587.6 nm. 1 if no material of the surface has specular
  /// transmission: light that only diffuse transmission lets in meets no index.
  float ior = 1;
};

/// Returns whether a path that meets the front or the back of a triangle enters its solid.
inline bool is_inwards(const Solid& solid, bool meets_front) noexcept {
  return meets_front != solid.is_inside_out;
}
/// As above, in this direction. normal_geometric: on the triangle's front side.
inline bool is_inwards(const Solid& solid, Vec3 normal_geometric, Vec3 direction) noexcept {
  return is_inwards(solid, dot(normal_geometric, direction) < 0);
}

/// A face of a solid at an end of a segment, or none. is_hole: the path passes a hole in it.
struct SolidFace {
  const Solid* solid = nullptr;
  bool is_hole = false;
};

class MediumStack {
 public:
  /// More than a scene can be expected to nest. Beyond it the lowest are lost.
  static constexpr std::size_t kMax = 32;

  // Copies what it holds: most paths are in no solid.
  MediumStack() noexcept {}  // NOLINT(modernize-use-equals-default): leaves solids_ unset
  MediumStack(const MediumStack& other) noexcept { *this = other; }
  MediumStack& operator=(const MediumStack& other) noexcept {
    count_ = other.count_;
    start_ = other.start_;
    std::copy_n(other.solids_, count_, solids_);
    return *this;
  }

  /// Whether they hold the same solids.
  friend bool operator==(const MediumStack& a, const MediumStack& b) noexcept {
    return std::equal(a.solids_, a.solids_ + a.count_, b.solids_, b.solids_ + b.count_);
  }
  bool empty() const noexcept { return count_ == 0; }
  std::size_t size() const noexcept { return count_; }
  bool holds(const Solid& solid) const noexcept {
    return std::find(solids_, solids_ + count_, &solid) != solids_ + count_;
  }
  /// The solid to which the space belongs; null outside of all.
  const Solid* top() const noexcept { return count_ > 0 ? solids_[count_ - 1] : nullptr; }
  const Material* material() const noexcept { return count_ > 0 ? top()->material : nullptr; }

  void enter(const Solid& solid) noexcept {
    if (count_ == kMax) {
      remove(0);
    }
    std::size_t at = count_++;
    for (; at > 0 && solids_[at - 1]->rank > solid.rank; --at) {
      solids_[at] = solids_[at - 1];
    }
    solids_[at] = &solid;
  }
  /// Solids end where their surface ends. One that was not entered: an open surface ends another
  /// (the two are sides of one solid), a cavity ends the solid that it is cut out of, and a closed
  /// surface the cavity that was entered from it.
  void leave(const Solid& solid) noexcept {
    const auto newest = [&](auto&& fits) {
      for (std::size_t i = count_; i-- > 0;) {
        if (fits(*solids_[i])) {
          remove(i);
          return true;
        }
      }
      return false;
    };
    if (newest([&](const Solid& s) { return &s == &solid; })) {
      return;
    }
    const auto is = [](SolidKind kind) {
      return [kind](const Solid& s) { return s.kind == kind; };
    };
    switch (solid.kind) {
      case SolidKind::kOpen:
        newest(is(SolidKind::kOpen));
        break;
      case SolidKind::kClosed:
        newest(is(SolidKind::kCavity));
        break;
      case SolidKind::kCavity:
        if (!newest([&](const Solid& s) { return s.material == solid.material; }) && count_ > 0) {
          remove(count_ - 1);
        }
        break;
    }
  }
  void cross(const Solid& solid, bool inwards) noexcept { inwards ? enter(solid) : leave(solid); }

  /// Begins a segment at a face, or elsewhere.
  void begin_segment(SolidFace at = {}) noexcept { start_ = at; }
  /// The medium of the segment that ends at `end`; null outside of all solids. A hole in a solid
  /// that only absorbs does not let a path enter or leave its medium: a segment within the solid
  /// that begins or ends at a hole, and at the surface at neither end, is free of it. This depends
  /// on the segment alone, so it is the same from both ends. Media that scatter are not left out,
  /// nor do they take the place of another one: paths end segments in them, and could not know
  /// whether a hole lies behind.
  const Material* medium_to(SolidFace end) const noexcept {
    const Solid* solid = top();
    const auto at = [solid](SolidFace face, bool is_hole) {
      return face.solid == solid && face.is_hole == is_hole;
    };
    if (solid == nullptr || solid->scatters || !(at(start_, true) || at(end, true)) ||
        at(start_, false) || at(end, false)) {
      return material();
    }
    const Solid* around = count_ > 1 ? solids_[count_ - 2] : nullptr;
    return around != nullptr && !around->scatters ? around->material : nullptr;
  }

 private:
  void remove(std::size_t at) noexcept {
    std::copy(solids_ + at + 1, solids_ + count_, solids_ + at);
    --count_;
  }

  std::size_t count_ = 0;
  SolidFace start_{};
  const Solid* solids_[kMax];  ///< by rank
};

/// The solids around the origins of rays.
struct StartMedia {
  MediumStack media{};
  bool varies = false;  ///< with the ray
};

}  // namespace core
