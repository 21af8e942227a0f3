/// Shadow and reflection catcher: a ground of which the camera sees only the changes that the model
/// makes to it. It is diffuse, with or without a smooth clear coat.
///
/// With B the radiance of the ground without the model, and the radiance with it
/// W = B - blocked + bounced, where `blocked` is light of the lights that does not arrive and
/// `bounced` the light that comes from the model: alpha a = blocked / B, as luminances, and the
/// colour, premultiplied, C = W - (1 - a) B. So C + (1 - a) X is W over a ground that looks like X
/// = B, whatever the noise, and where the model changes nothing a and C are 0 without noise:
/// blocked light is that of the very samples that meet the model. Where the background X is known
/// the shadow is coloured as the light is: W over it is X (1 - blocked / B) + bounced, by channel.
/// B has a closed form: distant lights are the same everywhere on the ground, punctual ones are
/// sums, and a smooth coat mirrors one direction of the environment. A mirrored part of the model
/// blocks what the coat would mirror without it. Lights of the model are bounced. Source of the
/// idea: Debevec, Rendering Synthetic Objects into Real Scenes, SIGGRAPH 1998.
#pragma once

#include <array>

#include "core/integrators/path_tracer.h"

namespace core {

/// Radiance of the ground under the lights alone.
class BareGround {
 public:
  BareGround(const SceneData& scene, const Environment* environment, const GroundSettings& ground);
  /// At a point, of the side that wo_world (unit, to the viewer) is on.
  Rgb radiance(Vec3 point, Vec3 wo_world) const noexcept;

 private:
  const SceneData& scene_;
  const Environment* environment_;
  Rgb albedo_;
  float coat_;
  std::array<Rgb, 2> distant_;  ///< irradiance below the coat: from above, from below
};

/// Irradiance by the environment of a level surface below a smooth clear coat of this weight: from
/// above (up 1) or below (-1). 0: without a coat.
Rgb level_irradiance(const Environment& environment, float up, float coat = 0);

/// Path tracer for jobs with a catcher. Paths that leave the ground are traced with the given
/// Options.
template <typename Options>
class CatcherTracer final : public Integrator {
 public:
  explicit CatcherTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        bare_(input.scene, input.environment, input.settings.ground),
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
