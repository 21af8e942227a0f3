/// PathTracer: path tracing with next-event estimation and BSDF sampling combined by MIS. Source:
/// Kajiya 1986; Veach 1997, chapters 9 and 10; PBR 4th ed., section 14.1.
#pragma once

#include <optional>

#include "core/integrators/integrator.h"
#include "core/integrators/path/path_options.h"
#include "core/light_samplers/light_sampler.h"
#include "core/lights/backdrop.h"
#include "core/transport/direct_light.h"
#include "core/transport/path_state.h"
#include "core/transport/scene_colors.h"
#include "core/transport/vertex.h"

namespace core {

class MediumStretch;
struct MediumAim;
struct MediumSample;

/// A path and its contributions.
struct TracedPath : PathState {
  PathSample out{};
  float u_roulette = -1;     ///< for this bounce; negative: not drawn yet
  float shared_samples = 0;  ///< number of shared light samples at the first surface; 0: not shared
  float branch_weight = 1;   ///< weight in the pixel; below 1 if the path was split
  std::uint32_t analog_draws = 0;
  bool last_controlled = false;  ///< the control variate replaced BSDF samples of closed-form
                                 ///< lights at the last vertex
  bool last_fitted = false;      ///< weights were fitted at the last vertex
  bool in_pair = false;   ///< no surface hit since, so a light sample could have found this light
                          ///< too
  Rgb* shares = nullptr;  ///< one sum per share; null if shares are not recorded
  const Wavelengths* wavelengths = nullptr;  ///< of throughput and radiance; null: RGB
};

/// A light sample of a path; `value` includes the throughput. Unoccluded it adds value * scale.
struct PathLight : DirectLight {
  float scale = 0;  ///< MIS weight over density
  float mis_weight = 1;
  Rgb control{};         ///< mean of the control variate minus the control variate; always added
  bool in_pair = false;  ///< unoccluded, so a BSDF sample could have found it
};

template <typename Options>
class PathTracer final : public Integrator {
 public:
  using Surface = typename Options::Surface;
  explicit PathTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        lights_(input.scene, input.environment, light_pick(input.settings.light_sampler),
                sky_density(input.settings)),
        options_(input.settings),
        ledger_(input),
        aims_in_media_(input.aims_in_media),
        shares_lights_(light_reuse(input.settings.light_sampler) == LightReuse::kShare &&
                       samples_lights()) {
    if (input.settings.fog) {
      fog_.emplace(*input.settings.fog, scene_.center, scene_.radius_m, scene_.origin.y);
    }
  }
  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override;
  PathSample trace_shares(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                          std::uint64_t& rays, std::span<Rgb> shares) const noexcept override;
  std::unique_ptr<GroupTracer> make_group_tracer() const override;

  // Steps of the loop, for tracers that share light samples
  // (core/integrators/path/shared_lights.cpp).

  /// Traces the path from its current ray to its end.
  void follow(TracedPath& path) const noexcept;
  /// Extends the path to its next surface and shades it. Returns false if the path ends.
  bool next_vertex(TracedPath& path, PathVertex& vertex) const noexcept;
  /// Shades the surface and samples the next direction, several times if `may_split`. Returns false
  /// if the path ends.
  bool go_on(TracedPath& path, PathVertex& vertex, bool may_split = true) const noexcept;
  /// Adds the emission of the surface. Returns false if the path ends.
  bool visit(TracedPath& path, PathVertex& vertex, const Surface& bsdf) const noexcept;
  bool is_at_max_depth(const PathState& path) const noexcept {
    return path.scatterings() >= options_.max_depth;
  }
  /// Returns whether the path shows the backdrop if it leaves the scene now.
  bool sees_backdrop(const PathState& path) const noexcept {
    return backdrop_.is_seen(path.depth, path.is_clear);
  }
  /// Adds a light sample (next-event estimation).
  void add_direct_light(TracedPath& path, const PathVertex& vertex,
                        const Surface& bsdf) const noexcept;
  /// Samples the next direction and applies Russian roulette. Returns false if the path ends.
  bool extend(TracedPath& path, const PathVertex& vertex, const Surface& bsdf) const noexcept;
  /// Returns the contribution of a light sample; traces its shadow ray.
  Rgb arriving(TracedPath& path, const PathVertex& vertex, PathLight& direct) const noexcept;

  Surface surface(const TracedPath& path, const PathVertex& vertex) const noexcept {
    if constexpr (Options::is_spectral) {
      return colors(path).bsdf(path, vertex);
    } else {
      return make_bsdf(vertex.shading, vertex.wo_world);
    }
  }
  auto colors(const TracedPath& path) const noexcept {
    if constexpr (Options::is_spectral) {
      return SpectralColors(*path.wavelengths);
    } else {
      return RgbColors{};
    }
  }

  const SceneData& scene() const noexcept { return scene_; }
  const MisLightSampler& lights() const noexcept { return lights_; }
  const Options& options() const noexcept { return options_; }
  /// The fog around the solids; null if there is none.
  const Fog* fog() const noexcept { return fog_ ? &*fog_ : nullptr; }

 private:
  bool samples_lights() const noexcept {
    return options_.strategy == Strategy::kMis || options_.strategy == Strategy::kLight;
  }
  int candidates(int depth) const noexcept {
    if (depth == 0) {
      return options_.first_candidates;
    }
    return options_.candidates;
  }
  /// Returns the number of light samples at the path's surface, for MIS weights.
  float light_samples(const TracedPath& path) const noexcept {
    return path.depth == 0 && path.shared_samples > 0 ? path.shared_samples
                                                      : static_cast<float>(candidates(path.depth));
  }
  /// Returns whether the control variate replaces BSDF samples at this surface.
  bool is_controlled(const Surface& bsdf) const noexcept {
    return options_.control_variate == ControlVariateType::kAnalytic && bsdf.is_diffuse_like() &&
           samples_lights();
  }
  /// Returns whether a light sample here uses a control variate with the pixel's fitted
  /// coefficient.
  bool fits_control(int depth, const Surface& bsdf) const noexcept {
    return options_.fit == FitType::kRegression && depth == 0 && bsdf.is_diffuse_like() &&
           samples_lights();
  }
  /// Returns whether MIS weights here come from the pixel's fitted 2x2 system.
  bool fits_weights(int depth, const Surface& bsdf) const noexcept {
    return options_.fit == FitType::kOptimalMis && depth == 0 && bsdf.has_spread() &&
           !lights_.empty();
  }
  MisRule rule(bool fitted) const noexcept {
    return fitted ? MisRule{MisType::kOptimal, 1} : options_.mis;
  }
  /// Adds light to the image and its shares. scatterings: on the whole path; group(): group of the
  /// light.
  template <typename Group>
  void credit(TracedPath& path, Rgb value, int scatterings, Group&& group) const noexcept {
    const Rgb color = colors(path).color(value);
    path.out.radiance += color;
    ledger_.add(path.shares, color * path.branch_weight, scatterings, group);
  }
  /// Extends the path to its next surface, through any media. Returns false if the path ends.
  bool reach_surface(TracedPath& path, PathVertex& vertex) const noexcept;
  bool reach_through_media(TracedPath& path, PathVertex& vertex) const noexcept;
  bool scatter_within(TracedPath& path, const MediumSample& sample,
                      const MediumAim* aim) const noexcept;
  void add_light_within(TracedPath& path, const MediumSample& sample, const MediumAim* aim,
                        Vec4 u) const noexcept;
  bool can_aim(const TracedPath& path, const MediumStretch& stretch) const noexcept;
  void add_light_along(TracedPath& path, const MediumAim& aim) const noexcept;
  void credit_medium_light(TracedPath& path, const Ray& shadow, Rgb value,
                           std::uint32_t light) const noexcept;
  void add_environment(TracedPath& path) const noexcept;
  void add_emission(TracedPath& path, const PathVertex& vertex) const noexcept;
  void add_found(TracedPath& path, const FoundLight& found, std::uint32_t group) const noexcept;
  PathLight sample_light(TracedPath& path, const PathVertex& vertex,
                         const Surface& bsdf) const noexcept;
  PathLight unoccluded(const TracedPath& path, const PathVertex& vertex, const Surface& bsdf,
                       LightSample light) const noexcept;
  BsdfSample sample_direction(TracedPath& path, const Surface& bsdf) const noexcept;
  void split(TracedPath& path, const PathVertex& vertex, const Surface& bsdf) const noexcept;
  bool survives(TracedPath& path, Rgb& factor) const noexcept;

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  MisLightSampler lights_;
  Options options_;
  [[no_unique_address]] typename Options::Ledger ledger_;
  std::optional<Fog> fog_;
  bool aims_in_media_;
  bool shares_lights_;
};

using WholeTracer = PathTracer<WholeOptions>;
using SpectralTracer = PathTracer<SpectralOptions>;

using StudyTracer = PathTracer<StudyOptions>;
std::unique_ptr<GroupTracer> make_shared_lights_tracer(const StudyTracer& owner);
/// Path tracing with the ground as shadow catcher.
std::unique_ptr<const Integrator> make_catcher(const IntegratorInput& input);

}  // namespace core
