/// Shadow catcher: a diffuse ground of which the image shows only the changes that the model makes.
///
/// Let B be the ground's radiance without the model, and W = B - blocked + bounced its radiance
/// with the model, where `blocked` is light from the lights that the model occludes and `bounced`
/// is light that arrives by way of the model. Alpha is a = blocked / B, as luminances, and the
/// premultiplied colour is C = W - (1 - a) B. Then C + (1 - a) X equals W over a ground that looks
/// like X = B, whatever the noise; where the model changes nothing, a and C are exactly 0, because
/// the samples that hit the model themselves estimate the blocked light. If the background X is
/// known, the shadow takes the colour of the light: W over it is X (1 - blocked / B) + bounced, per
/// channel. B has a closed form: distant lights are the same everywhere on the ground, and punctual
/// lights are summed. Light from emitters of the model counts as bounced. Source of the idea:
/// Debevec, Rendering Synthetic Objects into Real Scenes, SIGGRAPH 1998.
#pragma once

#include <array>

#include "core/integrators/path_tracer.h"

namespace core {

/// Computes the radiance of a horizontal diffuse surface lit by the lights alone.
class BareGround {
 public:
  BareGround(const SceneData& scene, const Environment* environment, Rgb albedo);
  /// Returns the radiance at a point, on the side of the normal (0, up, 0); up: 1 or -1.
  Rgb radiance(Vec3 point, float up) const noexcept;

 private:
  const SceneData& scene_;
  Rgb albedo_;
  std::array<Rgb, 2> distant_;  ///< irradiance from the environment, from above and from below
};

/// Returns the irradiance of a horizontal surface from the environment, from above (up 1) or below
/// (up -1).
Rgb level_irradiance(const Environment& environment, float up);

/// Path tracer for jobs with a catcher. Paths that leave the ground are traced with the given
/// Options.
template <typename Options>
class CatcherTracer final : public Integrator {
 public:
  explicit CatcherTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        bare_(input.scene, input.environment, input.settings.ground.color),
        paths_(input) {}
  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;

 private:
  /// The change of the ground's light due to the model. blocked: the light that the model occludes.
  struct Change {
    Rgb more;
    Rgb blocked;
  };
  void add_light_sample(TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                        Change& change) const noexcept;
  void add_direction(TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                     Change& change) const noexcept;

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  BareGround bare_;
  PathTracer<Options> paths_;
};

}  // namespace core
