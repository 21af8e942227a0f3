/// IrradianceTracer: estimates irradiance at points by path tracing with next-event estimation.
#pragma once

#include <cstdint>

#include "core/integrators/path/path_tracer.h"

namespace core {

class IrradianceTracer {
 public:
  /// Uses depth (the point counts as the first surface that scatters) and medium of the settings.
  /// Scene and environment must outlive it.
  explicit IrradianceTracer(const IntegratorInput& input);

  /// Returns one sample of the irradiance: the integral of radiance times cosine over the
  /// hemisphere around `normal` (unit), in the scene's units. The sampler has been started for this
  /// sample. media: media_at() the point. rays: adds the rays traced.
  Rgb sample(Vec3 point, Vec3 normal, const MediumStack& media, const PathSampler& sampler,
             std::uint64_t& rays) const noexcept;
  /// Returns the solids around a point on the side of its normal.
  MediumStack media_at(Vec3 point, Vec3 normal) const noexcept;
  /// As sample(), at the first surface that a camera ray hits, on the side facing the camera; black
  /// if the ray hits none.
  Rgb sample_seen(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                  std::uint64_t& rays) const noexcept;

 private:
  Vec3 origin_at(Vec3 point, Vec3 normal) const noexcept;
  /// Continues a path that has reached the point, with its media and ray cone.
  Rgb sample_at(TracedPath& path, Vec3 point, Vec3 normal, Vec3 origin) const noexcept;

  const SceneData& scene_;
  WholeTracer paths_;
};

}  // namespace core
