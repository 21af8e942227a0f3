/// Integrator: estimates the radiance along a camera ray.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include "core/camera/camera.h"
#include "core/film/film.h"
#include "core/integrators/prepass.h"
#include "core/lights/environment.h"
#include "core/samplers/path_sampler.h"
#include "core/sampling/shared_samples.h"
#include "core/scene/scene_data.h"
#include "core/settings/settings.h"

namespace core {

/// One of several camera paths that may share samples.
struct GroupPath {
  Camera::CameraRay camera_ray;
  PathSampler sampler;  ///< started for the pixel and sample
  PathSample out{};
};

/// Traces groups of paths, one group at a time; used by one thread.
class GroupTracer {
 public:
  virtual ~GroupTracer() = default;
  /// Traces the paths and fills their `out`. At most kGroupMost paths, all of one replicate, with
  /// `each` paths per pixel. rays: adds the rays traced.
  virtual void trace(std::span<GroupPath> paths, int each, std::uint64_t& rays) noexcept = 0;
};
inline constexpr std::size_t kGroupMost = SharedSamples::kMost;

/// Receives the contributions of light paths to the film.
class CameraSplats {
 public:
  virtual ~CameraSplats() = default;
  virtual const Camera& camera() const noexcept = 0;
  /// Returns whether light at this film position contributes to any pixel.
  virtual bool reaches(Vec2 film_px) const noexcept = 0;
  /// Adds a contribution. film_px: position on the full film, as in the camera's ray(); value: the
  /// value of a pixel with a box filter, if there were one light path per pixel of the film.
  virtual void add(Vec2 film_px, Rgb value) noexcept = 0;
  /// As add(), to share number `share` of the film's light.
  virtual void add_to_share(Vec2 /*film_px*/, std::size_t /*share*/, Rgb /*value*/) noexcept {}
};

/// Identifies a Markov chain: light sample `sample` of the unit whose corner is pixel (x, y).
struct ChainStart {
  int x = 0;
  int y = 0;
  int sample = 0;
  int mutations = 0;  ///< number of pixels of the unit
};

/// Traces single paths. Immutable and shared by all threads.
class Integrator {
 public:
  virtual ~Integrator() = default;
  /// Traces one camera path. The sampler has been started for the pixel and sample. rays: adds the
  /// rays traced.
  virtual PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                           std::uint64_t& rays) const noexcept = 0;
  /// As trace(), and adds the path's light to the film's shares, which start at zero. For
  /// integrators that support shares.
  virtual PathSample trace_shares(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                  std::uint64_t& rays, std::span<Rgb> /*shares*/) const noexcept {
    return trace(camera_ray, sampler, rays);
  }
  /// Traces one light path, for integrators that splat; called as often as trace(). The sampler has
  /// been started for a pixel and sample of a separate stream.
  virtual void trace_light(const PathSampler&, std::uint64_t&, CameraSplats&) const noexcept {}
  /// Returns whether trace_chain() replaces trace_light().
  virtual bool has_chains() const noexcept { return false; }
  /// Adds the contributions of `mutations` light paths.
  virtual void trace_chain(const ChainStart&, std::uint64_t& /*rays*/, CameraSplats&) const {}
  /// Returns the prepass of a sample; null if it needs none.
  virtual std::unique_ptr<Prepass> start_prepass(int /*sample*/) const { return nullptr; }
  /// Runs each part once, on any thread. rays: adds the rays traced.
  virtual void run_prepass(Prepass&, int /*part*/, std::uint64_t& /*rays*/) const {}
  /// As trace(), for samples with a prepass, which is complete and serves this sample.
  virtual PathSample gather(const Camera::CameraRay&, const PathSampler&, const Prepass&,
                            std::uint64_t&) const noexcept {
    return {};
  }
  /// Returns null if paths share no samples.
  virtual std::unique_ptr<GroupTracer> make_group_tracer() const { return nullptr; }
};

struct IntegratorInput {
  const SceneData& scene;
  const Environment* environment;  ///< null: black
  const RenderSettings& settings;
  const Camera* camera = nullptr;  ///< the view's camera, for integrators with light paths
  /// For path: light samples also choose distances in media (core/integrators/path/path_media.h).
  bool aims_in_media = false;
};

/// Creates the integrator that the settings name. Pre: the name is a row of integrators().
std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input);

}  // namespace core
