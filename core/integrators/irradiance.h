/// IrradianceTracer: light that falls on a point, by path tracing with next-event estimation.
#pragma once

#include <cstdint>

#include "core/integrators/path_tracer.h"

namespace core {

class IrradianceTracer {
 public:
  /// Of the settings: depth (the point is the first surface that a path scatters at), medium. Scene
  /// and environment must outlive it.
  explicit IrradianceTracer(const IntegratorInput& input);

  /// One sample of the integral of radiance times cosine over the hemisphere around `normal`
  /// (unit), in the scene's units. The sampler has been started for this sample. rays: counts those
  /// traced.
  Rgb sample(Vec3 point, Vec3 normal, const PathSampler& sampler,
             std::uint64_t& rays) const noexcept;
  /// The same where a camera ray first meets a surface, on the side that it sees; black where it
  /// meets none.
  Rgb sample_seen(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                  std::uint64_t& rays) const noexcept;

 private:
  /// From a path that has reached the point: media and ray cone are its own.
  Rgb sample_at(TracedPath& path, Vec3 point, Vec3 normal, Vec3 side) const noexcept;

  const SceneData& scene_;
  WholeTracer paths_;
};

}  // namespace core
