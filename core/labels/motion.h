/// Motion vectors: how far what a pixel shows moves in the picture until a second time.
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

/// Where a file's surfaces are at a second time: its vertices, moved by nodes, skins and morphs.
class MotionTarget {
 public:
  /// later: of load_gltf() with geometry_only; the scene itself is of the same file.
  explicit MotionTarget(SceneDescription later);

  const std::vector<CameraDescription>& cameras() const noexcept { return cameras_; }
  std::size_t bytes() const noexcept;
  /// Of the point of a surface of `now`, in the world; empty: it is hidden at that time.
  std::optional<Vec3> position(const SceneData& now, const SurfacePoint& point,
                               const SceneData::CornerWeights& at) const noexcept;

 private:
  struct Placed {
    std::uint32_t mesh = 0;
    std::uint32_t instance = 0;
  };
  std::vector<std::vector<Vec3>> meshes_;  ///< vertices in the file's order
  std::vector<Transform> to_world_;
  std::unordered_map<std::uint64_t, Placed> placed_;  ///< by instance and primitive
  std::vector<CameraDescription> cameras_;
};

struct Motion {
  std::shared_ptr<const MotionTarget> target;
  Camera now;
  Camera later;
  float width_px = 0;  ///< of the full film

  /// Pixels to the right and up, as compositors read them (Nuke's forward vectors; Blender's of the
  /// other frame, the first two of its four): the point's place in the picture at the second time
  /// less that of now, through the camera of each time. Of the two ways round a panorama the
  /// shorter. NaN: it is hidden then, or behind the camera.
  Vec2 of(const SceneData& scene, const SurfacePoint& point,
          const SceneData::CornerWeights& at) const noexcept;
};

}  // namespace core
