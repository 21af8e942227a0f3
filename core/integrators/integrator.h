/// Integrator: the light that comes along one camera ray.
#pragma once

#include <cstdint>
#include <memory>

#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/lights/environment.h"
#include "core/render/settings.h"
#include "core/samplers/path_sampler.h"
#include "core/scene/scene_data.h"

namespace core {

/// One camera path. Immutable and shared by all threads.
class Integrator {
 public:
  virtual ~Integrator() = default;
  /// The sampler has been started for this pixel and sample. rays: counts those traced.
  virtual PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                           std::uint64_t& rays) const noexcept = 0;
};

struct IntegratorInput {
  const SceneData& scene;
  const Environment* environment;  ///< null: black
  const RenderSettings& settings;
};

/// Pre: the name is a row of integrators().
std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input);

}  // namespace core
