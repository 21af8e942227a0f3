/// Shadow and reflection catcher: a ground of which the camera sees only the changes that the model
/// makes to it. It is diffuse, with or without a smooth clear coat.
///
/// B is the radiance of the ground without the model; `blocked` is light of the lights that the
/// model keeps from it, `bounced` the light that comes from the model. B has a closed form: distant
/// lights are the same everywhere on the ground, punctual ones are sums, and a smooth coat mirrors
/// one direction of the environment. A mirrored part of the model blocks what the coat would mirror
/// without it. Lights of the model are bounced. Blocked light is that of the very samples that meet
/// the model, so where the model changes nothing there is no noise. ShadowSettings::strength scales
/// the diffuse blocked light. Source of the idea: Debevec, Rendering Synthetic Objects into Real
/// Scenes, SIGGRAPH 1998.
///
/// physical: W = B - blocked + bounced is the radiance with the model. Alpha a = blocked / B, as
/// luminances, and the colour, premultiplied, C = W - (1 - a) B: C + (1 - a) X is W over a ground
/// that looks like X = B, whatever the noise. Where the background X is known the shadow is
/// coloured as the light is: W over it is X (1 - blocked / B) + bounced, by channel.
///
/// neutral: a = (blocked - bounced) / B, as luminances, of the diffuse ground, times a factor that
/// falls to 0 at the border of the film, plus what the mirrored model blocks; C is what the coat
/// mirrors of the model. So over any X the shadow is X darkened, as much as B would be; light that
/// the model adds to the diffuse ground only weakens its shadow. Source: Cycles' shadow catcher,
/// whose alpha is 1 less the mean of the channels of W / B.
#pragma once

#include <array>

#include "core/integrators/path/path_tracer.h"

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
        shadow_(input.settings.ground.shadow),
        film_(input.settings.film),
        has_border_(input.camera != nullptr && input.camera->type() != CameraType::kPanorama),
        paths_(input) {}
  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;

  // Steps of trace(), for paths that are traced together (core/wave).

  /// The change of the ground's light due to the model.
  struct Change {
    Rgb blocked;
    Rgb bounced;
  };
  struct Changes {
    Change diffuse;
    Change mirrored;
  };
  /// What the camera sees of the ground.
  struct Caught {
    Rgb color;
    float alpha = 1;
  };
  /// Returns whether the path ends here, on ground that the camera sees.
  bool catches(const TracedPath& path, const PathVertex& vertex) const noexcept {
    return scene_.ground && vertex.point.placed == *scene_.ground &&
           (path.depth == 0 || paths_.sees_backdrop(path));
  }
  /// Ends the path on the ground.
  void catch_light(TracedPath& path, PathVertex& vertex, Vec2 film_px) const noexcept;
  /// Returns whether the path may be split here: branches would not be caught behind glass.
  bool may_split(const PathVertex& vertex) const noexcept {
    return !(backdrop_.is_through_glass() && vertex.shading.bsdf.transmission > 0);
  }
  /// bare: BareGround::radiance(). direction: of the camera path, unit.
  Caught caught(Changes changes, Rgb bare, Vec3 direction, Vec2 film_px) const noexcept;
  const BareGround& bare_ground() const noexcept { return bare_; }
  /// Returns whether a light sample is of the model's own light, which is bounced.
  static bool is_of_model(const LightSample& light) noexcept { return light.triangle != kNoLight; }
  /// Returns whether lights of the shadow are widened.
  bool is_soft() const noexcept { return shadow_.softness > 0; }

 private:
  void add_light_sample(TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                        Changes& changes) const noexcept;
  void add_direction(TracedPath& path, const PathVertex& vertex, const Bsdf& bsdf,
                     Changes& changes) const noexcept;
  /// Returns a direction within the softness of wi, above the ground. u in [0,1)^2.
  Vec3 soft(const PathVertex& vertex, Vec3 wi_world, Vec2 u) const noexcept;
  /// Returns the factor of a neutral shadow at a film position.
  float inside_border(Vec2 film_px) const noexcept;

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  BareGround bare_;
  ShadowSettings shadow_;
  FilmSettings film_;
  bool has_border_;
  PathTracer<Options> paths_;
};

}  // namespace core
