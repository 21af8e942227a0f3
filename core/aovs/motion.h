/// Motion vectors: the movement of the surface at a pixel until a second time, in the image.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <unordered_map>
#include <vector>

#include "core/camera/camera.h"
#include "core/description/scene_description.h"
#include "core/math/transform.h"
#include "core/math/vec.h"
#include "core/scene/scene_data.h"

namespace core {

/// The surfaces of a file at a second time: its vertices, moved by nodes, skins and morph targets.
class MotionTarget {
 public:
  /// later: from load_gltf() with geometry_only, from the same file as the scene.
  explicit MotionTarget(SceneDescription later);

  const std::vector<CameraDescription>& cameras() const noexcept { return cameras_; }
  std::size_t bytes() const noexcept;
  /// Returns the world position at the second time of a surface point of `now`; empty if it is
  /// hidden then.
  std::optional<Vec3> position(const SceneData& now, const SurfacePoint& point,
                               const SceneData::CornerWeights& at) const noexcept;

 private:
  struct Placed {
    std::uint32_t mesh = 0;
    std::uint32_t instance = 0;
  };
  std::vector<std::vector<Vec3>> meshes_;  ///< vertices in the order of the file
  std::vector<Transform> to_world_;
  std::unordered_map<std::uint64_t, Placed> placed_;  ///< by instance and primitive
  std::vector<CameraDescription> cameras_;
};

struct Motion {
  std::shared_ptr<const MotionTarget> target;
  Camera now;
  Camera later;
  float width_px = 0;  ///< of the full film

  /// Returns the motion in pixels to the right and up, as compositors read it (Nuke's forward
  /// vectors; in Blender the first two of four, for the other frame): the point's image position at
  /// the second time minus that of now, each through the camera of its time. On a panorama, the
  /// shorter way round. NaN if the point is hidden then, or behind the camera.
  Vec2 of(const SceneData& scene, const SurfacePoint& point,
          const SceneData::CornerWeights& at) const noexcept;
};

}  // namespace core
