/// What is under the centres of pixels, and how deep: depth images and masks of a world that is
/// seen once and then moves. Nothing else of a scene is built, and trees of meshes can be kept.
#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <stop_token>
#include <string_view>
#include <vector>

#include "core/accel/accel.h"
#include "core/base/result.h"
#include "core/camera/camera.h"
#include "core/description/scene_description.h"
#include "core/math/bounds.h"

namespace core {

/// A mesh with the tree over its triangles, in object space.
struct MeshTree {
  std::vector<Vec3> positions;  ///< one more than the vertex count: Embree reads past the end
  std::vector<std::uint32_t> indices;
  Bounds bounds;
  std::unique_ptr<const Accel> accel;

  std::size_t bytes() const noexcept;
  /// Errors: of Accel::build().
  static Result<std::shared_ptr<const MeshTree>> build(const PrimitiveDescription& mesh,
                                                       int threads, std::string_view isa,
                                                       const std::stop_token& stop);
};

struct FirstSurface {
  double depth_m = std::numeric_limits<double>::infinity();  ///< along Camera::forward()
  int material = -1;  ///< of the description; -1 also for glTF's default material
};

/// Makes or finds the tree of a mesh.
using FindTree =
    std::function<Result<std::shared_ptr<const MeshTree>>(const PrimitiveDescription&)>;

/// Returns the nearest triangle under the centre of each pixel, row by row. Holes by alpha count as
/// there. Pre: camera.is_pinhole(). Errors: of find; kCancelled.
Result<std::vector<FirstSurface>> first_surfaces(const SceneDescription& scene,
                                                 const Camera& camera, int width, int height,
                                                 const FindTree& find, const std::stop_token& stop);

}  // namespace core
