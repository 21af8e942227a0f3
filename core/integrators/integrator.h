/// Integrator: the light that comes along one camera ray.
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

/// One of several camera paths that may share what they find.
struct GroupPath {
  Camera::CameraRay camera_ray;
  PathSampler sampler;  ///< started for the pixel and sample
  PathSample out{};
};

/// Follows groups of paths, one group after another; for one thread.
class GroupTracer {
 public:
  virtual ~GroupTracer() = default;
  /// Fills out. At most kGroupMost paths, all of one replicate, `each` of every pixel. rays: counts
  /// those traced.
  virtual void trace(std::span<GroupPath> paths, int each, std::uint64_t& rays) noexcept = 0;
};
inline constexpr std::size_t kGroupMost = SharedSamples::kMost;

/// Takes what light paths bring to the camera.
class CameraSplats {
 public:
  virtual ~CameraSplats() = default;
  virtual const Camera& camera() const noexcept = 0;
  /// Does any pixel of the film take light from there?
  virtual bool reaches(Vec2 film_px) const noexcept = 0;
  /// film_px: of the full film, where ray() of the camera begins; value: what one light path for
  /// each pixel of the film would add to a pixel of box filter.
  virtual void add(Vec2 film_px, Rgb value) noexcept = 0;
  /// The same for a share of the film's light, by its number.
  virtual void add_to_share(Vec2 /*film_px*/, std::size_t /*share*/, Rgb /*value*/) noexcept {}
};

/// Names a Markov chain: light sample `sample` of a unit whose corner is pixel (x, y).
struct ChainStart {
  int x = 0;
  int y = 0;
  int sample = 0;
  int mutations = 0;  ///< pixels of the unit
};

/// One camera path. Immutable and shared by all threads.
class Integrator {
 public:
  virtual ~Integrator() = default;
  /// The sampler has been started for this pixel and sample. rays: counts those traced.
  virtual PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                           std::uint64_t& rays) const noexcept = 0;
  /// The same, and adds what the path found to the film's shares of the light, which begin black.
  /// For integrators that keep shares.
  virtual PathSample trace_shares(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                                  std::uint64_t& rays, std::span<Rgb> /*shares*/) const noexcept {
    return trace(camera_ray, sampler, rays);
  }
  /// One light path, for integrators that splat: as many as camera paths. The sampler has been
  /// started for a pixel and sample, of a stream of its own.
  virtual void trace_light(const PathSampler&, std::uint64_t&, CameraSplats&) const noexcept {}
  /// True: trace_chain() stands for trace_light().
  virtual bool has_chains() const noexcept { return false; }
  /// Adds what `mutations` light paths would.
  virtual void trace_chain(const ChainStart&, std::uint64_t& /*rays*/, CameraSplats&) const {}
  /// Null: samples need none.
  virtual std::unique_ptr<Prepass> start_prepass(int /*sample*/) const { return nullptr; }
  /// Each part once, by any thread. rays: counts those traced.
  virtual void run_prepass(Prepass&, int /*part*/, std::uint64_t& /*rays*/) const {}
  /// As trace(), where samples need a pass before; it is ready, and serves this sample.
  virtual PathSample gather(const Camera::CameraRay&, const PathSampler&, const Prepass&,
                            std::uint64_t&) const noexcept {
    return {};
  }
  /// Null: paths do not share anything.
  virtual std::unique_ptr<GroupTracer> make_group_tracer() const { return nullptr; }
};

struct IntegratorInput {
  const SceneData& scene;
  const Environment* environment;  ///< null: black
  const RenderSettings& settings;
  const Camera* camera = nullptr;  ///< for integrators with light paths: of the view
  /// path: light samples choose distances in media too (core/integrators/path_media.h).
  bool aims_in_media = false;
};

/// As the settings name it. Pre: the name is a row of integrators().
std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input);

}  // namespace core
