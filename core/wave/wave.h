/// Waves: many camera paths that go from surface to surface together, in lanes.
///
/// All paths of a wave take their next segment, meet their surfaces, sample lights and directions
/// before any of them goes on; those that end leave the arrays, the others close up. A path gets
/// the same random numbers as in PathTracer and what it finds is a function of them alone, equal to
/// the scalar one's up to rounding: which paths travel together does not matter. Surfaces that the
/// lanes do not know (glass, layers, holes) hand their path to PathTracer, which gives it back
/// behind them.
/// Source of the order of work: Laine, Karras and Aila, Megakernels Considered Harmful, 2013; Lee
/// et al., Vectorized Production Path Tracing, 2017.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "core/film/due_sample.h"
#include "core/film/filter.h"
#include "core/integrators/integrator.h"

namespace core {

/// Paths of a wave at most: the arrays below then stay within the L2 cache.
inline constexpr std::size_t kWavePaths = 512;
/// Lanes may read and write past the last path, up to their width.
inline constexpr std::size_t kWaveRoom = kWavePaths + 8;

template <typename T>
struct alignas(32) WaveArray {
  T at[kWaveRoom];
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

/// PathState, one array a member; entries [first, first + count) are the paths under way.
struct WavePaths {
  WaveVec3 origin;
  WaveVec3 direction;
  WaveVec3 beta;
  WaveFloats pdf_bsdf;  ///< LastScattering
  WaveVec3 last_origin;
  WaveVec3 last_normal;
  WaveFloats cone_width_m;
  WaveFloats cone_spread_rad;
  WaveArray<std::int32_t> is_sharp;
  WaveArray<std::uint64_t> base;  ///< of the path's sampler, with sobol
  WaveArray<std::uint32_t> index_reversed;
  WaveArray<std::int32_t> slot;  ///< see slot_of()
  /// Camera paths stand at the end, so that their continuations find room before them.
  std::size_t first = 0;
  std::size_t count = 0;
};

/// What the paths have met.
struct WaveHits {
  WaveArray<std::uint32_t> instance;
  WaveArray<std::uint32_t> geometry;
  WaveArray<std::uint32_t> primitive;
  WaveArray<std::uint32_t> is_hit;  ///< one bit a path for each packet of eight
};

/// Light samples whose shadow rays wait.
struct WaveShadows {
  WaveVec3 origin;
  WaveVec3 direction;
  WaveFloats t_max;
  WaveVec3 value;  ///< for the pixel if nothing is in the way
  WaveFloats cone_width_m;
  WaveArray<std::int32_t> is_sharp;
  WaveArray<std::int32_t> slot;
  std::size_t count = 0;
};

/// A path that PathTracer gives back; members as in WavePaths.
struct WaitingPath {
  int depth = 0;  ///< surfaces met: where it joins the others
  std::int32_t slot = 0;
  std::uint64_t base = 0;
  std::uint32_t index_reversed = 0;
  Vec3 origin, direction;
  Vec3 beta;
  float pdf_bsdf = 0;
  Vec3 last_origin, last_normal;
  float cone_width_m = 0;
  float cone_spread_rad = 0;
  bool is_sharp = true;
};

/// PathSample, one array a member; entry i is the i-th path that was added.
struct WaveResults {
  WaveVec3 radiance;
  WaveFloats alpha;
  WaveVec3 albedo;
  WaveVec3 normal;
  WaveFloats depth_m;
  WaveFloats weight;  ///< of the film's filter
  WaveArray<std::int32_t> hit;
};

/// What the paths of a picture begin with.
struct WaveStart {
  const Camera& camera;
  const FilterSampler& filter;
  PathSampler sampler;  ///< to be started for each sample
};

/// A wave under way; for one thread.
class Wave {
 public:
  /// Of the i-th sample of begin().
  PathSample result(std::size_t i) const noexcept;

  WavePaths paths;
  WaveHits hits;
  WaveShadows shadows;
  WaveResults results;
  std::vector<PathSampler> samplers;
  std::vector<WaitingPath> waiting;  ///< empty when the wave has ended
};

/// Follows the paths of waves. Immutable and shared by all threads.
class WaveTracer {
 public:
  virtual ~WaveTracer() = default;
  /// Samples of a wave at most: continuations of a path that is split take places of their own.
  virtual std::size_t samples_max() const noexcept = 0;
  /// One path for each sample.
  virtual void begin(Wave& wave, const WaveStart& start, std::span<const DueSample> due) const = 0;
  /// Follows all paths to their ends. rays: counts those traced; rejected: the samples that are not
  /// finite, which become zero.
  virtual void trace(Wave& wave, std::uint64_t& rays, std::uint64_t& rejected) const noexcept = 0;
};

}  // namespace core
