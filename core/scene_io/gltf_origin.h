/// The origin of a scene: the point of the file's world from which its floats count.
#pragma once

#include <span>
#include <vector>

#include "core/description/scene_description.h"
#include "core/math/place.h"
#include "core/scene_io/gltf_nodes.h"

namespace core {

/// An axis-aligned box in double; empty until a place is added.
struct PlaceBox {
  Place min = {kNone, kNone, kNone};
  Place max = {-kNone, -kNone, -kNone};

  bool empty() const noexcept { return !(min.x <= max.x); }
  void add(Place p) noexcept;
  double radius() const noexcept;           ///< half the diagonal
  double reach(Place from) const noexcept;  ///< largest coordinate seen from a place

 private:
  static constexpr double kNone = 1e300;
};

/// Coordinates of up to this many radii keep 19 of the 24 bits of a float for the scene itself.
inline constexpr double kFarRadii = 32;

/// Returns an origin for what is in the box: zero unless it lies so many of its radii away, so that
/// most scenes keep the file's coordinates; else a multiple of a power of two of about the radius
/// near the centre, so that whole coordinates stay whole.
Place far_origin(const PlaceBox& box, double radii = kFarRadii) noexcept;

/// Returns far_origin() of the meshes, placed by the matrices of scene.instances; of one radius
/// where floats could not hold a mesh. Adds a warning where they cannot.
Place find_origin(const SceneDescription& scene, std::span<const Affine> to_world,
                  std::vector<Warning>& warnings);

}  // namespace core
