/// Bidirectional path tracing: connects every vertex of a camera subpath to every vertex of a light
/// subpath. Strategy (s, t) has s vertices of the light subpath and t of the camera subpath; those
/// with t = 1 splat (trace_light(), a separate light subpath), the others add to the pixel of the
/// camera path. Weights: core/integrators/bidirectional/bdpt_weights.h. Surfaces that a path passes
/// without a change of direction are not vertices.
///
/// vcm: besides, photons of separate light subpaths merge with the camera subpath at surfaces near
/// theirs, as one more strategy for each vertex. Disks shrink from sample to sample as those of
/// sppm do.
///
/// path-caustics: camera subpaths alone, with light samples, which merge with photons that came by
/// sharp scattering only: light that such subpaths find badly or, of points, never.
///
/// Vertices lie on surfaces and in media. Both subpaths sample distances in scattering media, and
/// connections are multiplied by the transmittance of media.
///
/// Sources: Veach 1997, ch. 10; media: PBR 3rd ed., 16.3; merging: Georgiev and others 2012, "Light
/// Transport Simulation with Vertex Connection and Merging".
/// Dispersion: the subpaths of a sample share the wavelength that refraction by dispersive solids
/// leaves them; its colour is a factor of each whole path with such a refraction.
#pragma once

#include <optional>

#include "core/integrators/bidirectional/bdpt_vertex.h"
#include "core/integrators/bidirectional/bdpt_weights.h"
#include "core/integrators/bidirectional/caustic_aim.h"
#include "core/integrators/bidirectional/merged_photons.h"
#include "core/integrators/path/light_ledger.h"
#include "core/light_samplers/emission_sampler.h"
#include "core/light_samplers/light_sampler.h"
#include "core/lights/backdrop.h"
#include "core/media/fog.h"
#include "core/transport/visibility.h"

namespace core {

/// The strategies to trace: all of them, with Russian roulette, or a single one without.
struct Strategies {
  std::optional<SubpathLengths> only{};

  bool has(int light, int camera) const noexcept {
    return !only || (only->light == light && only->camera == camera);
  }
  bool has_light_vertices(int count) const noexcept { return !only || count <= only->light; }
  bool has_camera_vertices(int count) const noexcept { return !only || count <= only->camera; }
};

/// The start of a camera subpath and the numbers of both subpaths.
struct SubpathPair {
  Camera::CameraRay camera_ray;
  PathSampler from_camera;
  PathSampler from_light;
};

class BidirectionalPathTracer final : public Integrator {
 public:
  explicit BidirectionalPathTracer(const IntegratorInput& input)
      : scene_(input.scene),
        settings_(input.settings),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        lights_(input.scene, input.environment, LightPick::kTree),
        emission_(input.scene, input.environment),
        weights_(input, lights_, emission_),
        ledger_(input),
        max_depth_(input.settings.max_depth),
        merging_(input) {
    for (const Material& material : scene_.materials) {
      has_dispersion_ = has_dispersion_ || material.factors.dispersion > 0;
    }
    if (input.settings.fog) {
      fog_.emplace(*input.settings.fog, scene_.center, scene_.radius_m, scene_.origin.y);
    }
    if (merging_.is_on && !weights_.connects()) {
      aim_at_caustics(input, emission_);
    }
  }

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override {
    return trace_shares(camera_ray, sampler, rays, {});
  }
  PathSample trace_shares(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                          std::uint64_t& rays, std::span<Rgb> shares) const noexcept override;
  void trace_light(const PathSampler& sampler, std::uint64_t& rays,
                   CameraSplats& splats) const noexcept override;
  std::unique_ptr<Prepass> start_prepass(int sample) const override;
  void run_prepass(Prepass& pass, int part, std::uint64_t& rays) const override;
  PathSample gather(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                    const Prepass& pass, std::uint64_t& rays) const noexcept override;
  /// Adds the contributions of strategies to `out`. Unlike trace() and trace_light(), strategies
  /// with t = 1 use the same light subpath as the others. film: decides which splats are needed.
  void trace_strategies(const SubpathPair& from, const Strategies& strategies, std::uint64_t& rays,
                        const CameraSplats& film, StrategyLights& out) const noexcept;

 private:
  /// Fills in what the subpaths of a sample share. numbers: of the sample.
  void begin(Subpath& path, const PathSampler& numbers) const noexcept;
  enum class Event { kEscape, kSurface, kMedium };
  /// Follows the subpath's ray to the next surface and fills `met`, or to a scattering event in a
  /// medium before it and fills `sample`.
  Event next_event(Subpath& path, PathVertex& met, MediumSample& sample) const noexcept;
  /// Traces a camera subpath, and a light subpath to connect it to. photons: to merge it with;
  /// null: none.
  PathSample trace_pair(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                        std::uint64_t& rays, std::span<Rgb> shares,
                        const MergedPhotons* photons) const noexcept;
  /// Follows a light subpath and calls visit(path, vertex) for each of its vertices.
  template <typename Visit>
  void follow_light(Subpath& path, const Strategies& strategies, Visit& visit) const noexcept;
  template <typename LightVertices>
  void follow_camera(CameraSubpath& path, const Strategies& strategies,
                     const LightVertices& light_vertices) const noexcept;
  bool extend(Subpath& path, const Vertex& vertex, TransportMode mode) const noexcept;
  /// Returns whether a path may have this many scattering events.
  bool is_allowed(int surfaces, int in_media) const noexcept {
    return surfaces <= max_depth_ && in_media <= kMediumScatterings * max_depth_;
  }
  Visibility visibility_of(PathState& path, const Vertex& vertex, Vec3 wi, Vec3 target, bool is_far,
                           Rgb& flight_depth) const noexcept;

  /// Adds a contribution to the image and to its light shares.
  void credit(CameraSubpath& path, const Found& found, const LightOrigin& from) const noexcept;
  std::uint32_t group_at(const PathVertex& met) const noexcept {
    return scene_.placed[met.point.placed].group;
  }
  /// Returns whether a subpath has only passed clear surfaces if it goes on from the vertex towards
  /// wi, where they show the backdrop: environment light along such paths is left out.
  bool shows_backdrop(const Vertex& vertex, Vec3 wi) const noexcept {
    return backdrop_.is_through_glass() && vertex.is_clear && vertex.medium == nullptr &&
           passes_clear(vertex.surface, wi);
  }
  bool is_environment(std::uint32_t light) const noexcept {
    return scene_.group_of_light(light) == kEnvironmentGroup;
  }
  void add_background(CameraSubpath& path) const noexcept;
  void add_emission(CameraSubpath& path, const Vertex& vertex) const noexcept;
  void add_light_sample(CameraSubpath& path, const Vertex& vertex) const noexcept;
  template <typename LightVertices>
  void add_connections(CameraSubpath& path, const Vertex& vertex, const Strategies& strategies,
                       const LightVertices& light_vertices) const noexcept;
  Found connection(Subpath& path, const Vertex& vertex, const Vertex& from_light) const noexcept;
  /// Adds the light of the photons near a vertex.
  void add_photons(CameraSubpath& path, const Vertex& vertex) const noexcept;
  void splat(Subpath& path, const Vertex& vertex, CameraSplats& splats) const noexcept;

  const SceneData& scene_;
  RenderSettings settings_;
  const Environment* environment_;
  Backdrop backdrop_;
  LightSampler lights_;
  EmissionSampler emission_;
  BdptWeights weights_;
  LightLedger ledger_;
  int max_depth_;
  Merging merging_;
  std::optional<Fog> fog_;
  bool has_dispersion_ = false;
};

}  // namespace core
