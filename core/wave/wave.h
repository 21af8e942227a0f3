/// Waves: many camera paths that advance together from surface to surface, in lanes.
///
/// All paths of a wave trace their next segment, evaluate their surfaces, and sample lights and
/// directions before any of them continues; terminated paths are removed and the arrays compacted.
/// A path uses the same random numbers as in PathTracer, and its result is a function of them
/// alone, equal to the scalar result up to rounding: it does not depend on the other paths of the
/// wave. At surfaces that lanes do not support (unlit ones, nested solids) a path is
/// handed to PathTracer, which returns it after them. On a catcher the light that the model blocks
/// is summed beside the light that it bounces, and both are combined at the end. Source of the
/// order of work: Laine, Karras and Aila, Megakernels Considered Harmful, 2013; Lee et al.,
/// Vectorized Production Path Tracing, 2017.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <type_traits>
#include <vector>

#include "core/color/wavelengths.h"
#include "core/film/due_sample.h"
#include "core/film/filter.h"
#include "core/integrators/integrator.h"

namespace core {

/// Maximum number of paths of a wave: the arrays below fit in the L2 cache.
inline constexpr std::size_t kWavePaths = 512;
/// Lanes may read and write past the last path, up to their width.
inline constexpr std::size_t kWaveRoom = kWavePaths + 8;

template <typename T>
struct alignas(32) WaveArray {
  T at[kWaveRoom];
  void set(std::size_t i, T value) noexcept { at[i] = value; }
  T get(std::size_t i) const noexcept { return at[i]; }
};
using WaveFloats = WaveArray<float>;
struct WaveVec3 {
  WaveFloats x, y, z;
  void set(std::size_t i, Vec3 v) noexcept {
    x.at[i] = v.x;
    y.at[i] = v.y;
    z.at[i] = v.z;
  }
  Vec3 get(std::size_t i) const noexcept { return {x.at[i], y.at[i], z.at[i]}; }
};

class MovingCamera;

/// What a path carries from surface to surface. Of<T>: one T, an array of them, or lanes.
template <template <typename> typename Of>
struct PathMembers {
  Of<Vec3> origin;
  Of<Vec3> direction;
  Of<Vec3> beta;
  Of<float> pdf_bsdf;  ///< as in LastScattering
  Of<Vec3> last_origin;
  Of<Vec3> last_normal;
  Of<float> cone_width_m;
  Of<float> cone_spread_rad;
  Of<std::int32_t> is_sharp;
  Of<std::int32_t> medium;  ///< the solid around the segment, from 1; 0: none
  Of<std::uint64_t> base;   ///< of the path's sampler, for sobol
  Of<std::uint32_t> index_reversed;
  Of<std::int32_t> slot;                ///< see sum_of()
  Of<std::int32_t> medium_scatterings;  ///< as in PathState; of jobs with media
  Of<std::int32_t> null_scatterings;    ///< as in PathState; of scenes with clear surfaces
};
/// Visits the members, as functions from PathMembers of any kind to theirs. kHasMedia: of jobs that
/// have media. has_clear: of scenes with clear surfaces.
template <bool kHasMedia, typename Visit>
[[gnu::always_inline]] inline void for_each_member(bool has_clear, Visit&& visit) {
  visit([](auto& p) -> auto& { return p.origin; });
  visit([](auto& p) -> auto& { return p.direction; });
  visit([](auto& p) -> auto& { return p.beta; });
  visit([](auto& p) -> auto& { return p.pdf_bsdf; });
  visit([](auto& p) -> auto& { return p.last_origin; });
  visit([](auto& p) -> auto& { return p.last_normal; });
  visit([](auto& p) -> auto& { return p.cone_width_m; });
  visit([](auto& p) -> auto& { return p.cone_spread_rad; });
  visit([](auto& p) -> auto& { return p.is_sharp; });
  visit([](auto& p) -> auto& { return p.medium; });
  visit([](auto& p) -> auto& { return p.base; });
  visit([](auto& p) -> auto& { return p.index_reversed; });
  visit([](auto& p) -> auto& { return p.slot; });
  if constexpr (kHasMedia) {
    visit([](auto& p) -> auto& { return p.medium_scatterings; });
  }
  if (has_clear) {
    visit([](auto& p) -> auto& { return p.null_scatterings; });
  }
}

template <typename T>
using Single = T;
using WavePath = PathMembers<Single>;

template <typename T>
using Column = std::conditional_t<std::is_same_v<T, Vec3>, WaveVec3, WaveArray<T>>;

/// Entries [first, first + count) are the active paths.
struct WavePaths : PathMembers<Column> {
  /// Camera paths are at the end, so that their continuations fit before them.
  std::size_t first = 0;
  std::size_t count = 0;

  template <bool kHasMedia>
  WavePath get(std::size_t i, bool has_clear) const noexcept {
    WavePath out{};
    for_each_member<kHasMedia>(has_clear, [&](auto member) { member(out) = member(*this).get(i); });
    return out;
  }
  template <bool kHasMedia>
  void add(const WavePath& path, bool has_clear) noexcept {
    for_each_member<kHasMedia>(
        has_clear, [&](auto member) { member(*this).set(first + count, member(path)); });
    ++count;
  }
};

/// The hits of the paths.
struct WaveHits {
  WaveArray<std::uint32_t> instance;
  WaveArray<std::uint32_t> geometry;
  WaveArray<std::uint32_t> primitive;
  WaveArray<std::uint32_t> is_hit;  ///< one bit per path for each packet of eight, as below
  WaveArray<std::uint32_t> holes;   ///< hits that are holes among solids, or behind holes
};

/// Light samples with pending shadow rays.
struct WaveShadows {
  WaveVec3 origin;
  WaveVec3 direction;
  WaveFloats t_max;
  WaveVec3 value;  ///< added to the pixel if unoccluded
  WaveFloats cone_width_m;
  WaveArray<std::int32_t> is_sharp;
  WaveArray<std::int32_t> medium;            ///< as of paths; unset in scenes without solids
  WaveArray<std::int32_t> null_scatterings;  ///< as of paths; for shares of the light
  WaveArray<std::int32_t> slot;
  WaveArray<std::int32_t> light;  ///< as in LightSample; for shares of the light
  std::size_t count = 0;
};

/// Paths that end on a catcher; their radiance in WaveResults is what they find of the model beyond
/// it.
struct WaveCaught {
  WaveArray<std::int32_t> on;           ///< whether the path is one of them
  WaveArray<std::int32_t> is_mirrored;  ///< whether the catcher's coat mirrors it
  WaveVec3 blocked;                     ///< light samples that the model blocks
  WaveVec3 lit;                         ///< light samples of the model's lights
  WaveVec3 kept_away;                   ///< light of the environment behind the model
  WaveVec3 bare;                        ///< BareGround::radiance()
  WaveVec3 direction;                   ///< of the camera ray
  WaveFloats film_x_px;
  WaveFloats film_y_px;
};

/// A path returned by PathTracer.
struct ReturnedPath {
  int depth;  ///< surfaces hit: the depth at which it rejoins the wave
  WavePath path;
};

/// PathSample as a structure of arrays; entry i is the i-th path added.
struct WaveResults {
  WaveVec3 radiance;  ///< before the end, of continuations (sum_of())
  WaveFloats alpha;
  WaveVec3 albedo;
  WaveVec3 normal;
  WaveFloats depth_m;
  WaveFloats start_m;  ///< of the camera ray
  WaveFloats t_max;    ///< of the camera ray
  WaveFloats weight;   ///< of the reconstruction filter
  WaveFloats time;     ///< of the path, while the shutter is open
  WaveArray<std::int32_t> hit;
};

/// Input shared by all camera paths of an image.
struct WaveStart {
  const Camera& camera;
  const MovingCamera* moving;  ///< while the shutter is open; null if the camera is at rest
  const FilterSampler& filter;
  PathSampler sampler;  ///< started anew for each sample
};

/// Paths that advance together.
struct WaveFront {
  WavePaths paths;
  WaveHits hits;
};

/// The state of a wave; used by one thread.
class Wave : public WaveFront {
 public:
  /// Result of the i-th sample of begin().
  PathSample result(std::size_t i) const noexcept;

  WaveShadows shadows;
  WaveResults results;
  std::vector<PathSampler> samplers;
  std::vector<Wavelengths> wavelengths;  ///< of each sample; of spectral jobs
  std::vector<ReturnedPath> waiting;     ///< empty when the wave has ended
  std::vector<Rgb> shares;               ///< of the light, as radiance; [sample * shares + share]
  std::unique_ptr<WaveCaught> caught;    ///< null without a catcher
  std::unique_ptr<WaveFront> aside;      ///< empty between steps; null if surfaces are alike
};

/// Traces the paths of waves. Immutable and shared by all threads.
class WaveTracer {
 public:
  virtual ~WaveTracer() = default;
  /// Maximum number of samples of a wave: continuations of split paths also occupy entries.
  virtual std::size_t samples_max() const noexcept = 0;
  /// Starts one path for each sample.
  virtual void begin(Wave& wave, const WaveStart& start, std::span<const DueSample> due) const = 0;
  /// Traces all paths to their ends. Adds the number of rays to `rays` and the number of non-finite
  /// samples, which become zero, to `rejected`.
  virtual void trace(Wave& wave, std::uint64_t& rays, std::uint64_t& rejected) const noexcept = 0;
};

}  // namespace core
