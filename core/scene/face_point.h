/// face_point(): the part of a SurfacePoint that tells where a ray goes on behind a surface.
#pragma once

#include "core/scene/scene_data.h"

namespace core {

/// The members are those of SurfacePoint.
struct FacePoint {
  Vec3 position;
  Vec3 normal_geometric;
  float error_m = 0;
};

FacePoint face_point(const SceneData& scene, const RawHit& hit, const Ray& ray) noexcept;

}  // namespace core
