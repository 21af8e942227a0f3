/// Access to the arrays of a wave in lanes.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>

#include "core/accel/accel.h"
#include "core/math/lane_math.h"
#include "core/samplers/path_sampler.h"
#include "core/wave/lane_camera.h"
#include "core/wave/wave.h"

namespace core {

template <std::size_t N>
Vec3s<N> load(const WaveVec3& from, std::size_t first) {
  return {load<N>(from.x.at + first), load<N>(from.y.at + first), load<N>(from.z.at + first)};
}
template <std::size_t N, typename T>
auto load(const WaveArray<T>& from, std::size_t first) {
  if constexpr (std::is_same_v<T, std::uint64_t>) {
    return Hashes<N>::load(from.at + first);
  } else {
    return load<N>(from.at + first);
  }
}
template <std::size_t N>
void store(WaveVec3& to, std::size_t first, Vec3s<N> value) {
  store(to.x.at + first, value.x);
  store(to.y.at + first, value.y);
  store(to.z.at + first, value.z);
}
template <typename T, typename Values>
void compress(WaveArray<T>& to, std::size_t first, Values values, unsigned taken) {
  compress(to.at + first, values, taken);
}
template <std::size_t N>
void compress(WaveVec3& to, std::size_t first, Vec3s<N> values, unsigned taken) {
  compress(to.x, first, values.x, taken);
  compress(to.y, first, values.y, taken);
  compress(to.z, first, values.z, taken);
}

/// A PathMembers of lanes.
template <typename T, std::size_t N>
struct LanesOf;
template <std::size_t N>
struct LanesOf<Vec3, N> {
  using Type = Vec3s<N>;
};
template <std::size_t N>
struct LanesOf<float, N> {
  using Type = Floats<N>;
};
template <std::size_t N>
struct LanesOf<std::int32_t, N> {
  using Type = Ints<N>;
};
template <std::size_t N>
struct LanesOf<std::uint32_t, N> {
  using Type = Words<N>;
};
template <std::size_t N>
struct LanesOf<std::uint64_t, N> {
  using Type = Hashes<N>;
};
template <std::size_t N>
struct Wide {
  template <typename T>
  using Of = const typename LanesOf<T, N>::Type&;
};
/// Refers to the lanes, so that they need not be copied.
template <std::size_t N>
using PathLanes = PathMembers<Wide<N>::template Of>;

// A slot holds, from its lowest bits: the index of the path's sum in WaveResults::radiance; the
// index of its sample; 1 plus the number of the continuation of a split path, or 0 if it was not
// split. Each continuation has a sum of its own, so that no order of paths matters.
inline constexpr int kSampleShift = 10;
inline constexpr int kContinuationShift = 2 * kSampleShift;
static_assert(kWaveRoom <= 1U << kSampleShift);
inline std::int32_t slot_of_sample(std::size_t i) {
  return static_cast<std::int32_t>(i | i << kSampleShift);
}
inline std::size_t sum_of(std::int32_t slot) {
  return static_cast<std::size_t>(slot) & ((1U << kSampleShift) - 1);
}
inline std::size_t sample_of(std::int32_t slot) {
  return static_cast<std::size_t>(slot >> kSampleShift) & ((1U << kSampleShift) - 1);
}
inline std::size_t sample_of(const WavePaths& paths, std::size_t i) {
  return sample_of(paths.slot.at[i]);
}
inline int continuation_of(std::int32_t slot) {
  return (slot >> kContinuationShift) & ((1 << kSampleShift) - 1);
}
/// Number of samples of a wave, or of the sums of the k-th continuations.
inline std::size_t samples_of_wave(int continuations) {
  return kWavePaths / static_cast<std::size_t>(continuations) / 8 * 8;
}
/// What is added to the slot of a path of its k-th continuation.
inline std::int32_t slot_of_branch(int k, int count) {
  return ((k + 1) << kContinuationShift) + k * static_cast<std::int32_t>(samples_of_wave(count));
}
/// State from which the random numbers of N paths are drawn: PathSampler's base and index with
/// reversed bits.
template <std::size_t N>
struct PathNumbers {
  Hashes<N> base;
  Words<N> index_reversed;
  Ints<N> slot;

  static PathNumbers load(const WavePaths& paths, std::size_t first) {
    return {Hashes<N>::load(paths.base.at + first), core::load<N>(paths.index_reversed.at + first),
            core::load<N>(paths.slot.at + first)};
  }
  /// PathSampler::branch()
  PathNumbers branch(int k, int count) const {
    const auto n = static_cast<std::uint32_t>(count);
    return {hash_combine(base, PathSampler::branch_key(n)),
            reverse_bits(reverse_bits(index_reversed) * n + static_cast<std::uint32_t>(k)),
            slot + Ints<N>(slot_of_branch(k, count))};
  }
};
inline void add_radiance(WaveResults& results, std::int32_t slot, Vec3 value) {
  const std::size_t sum = sum_of(slot);
  results.radiance.set(sum, results.radiance.get(sum) + value);
}
/// Stores the camera rays of paths `to`, ..., whose results are `slot`, ....
template <std::size_t N>
void store_rays(Wave& wave, std::size_t to, std::size_t slot, const CameraRayLanes<N>& rays) {
  store(wave.paths.origin, to, rays.origin);
  store(wave.paths.direction, to, rays.direction);
  store(wave.paths.cone_width_m.at + to, rays.width_m);
  store(wave.paths.cone_spread_rad.at + to, rays.spread_rad);
  store(wave.results.weight.at + slot, rays.weight);
  store(wave.results.start_m.at + slot, rays.start_m);
  store(wave.results.t_max.at + slot, rays.t_max);
}
template <std::size_t N>
struct FirstSurface {
  Vec3s<N> albedo, normal;
  Floats<N> depth_m;
};
/// The results from `slot` on, in the lanes of `on`.
template <std::size_t N>
void keep_first_surface(WaveResults& to, std::size_t slot, Mask<N> on, const FirstSurface<N>& s) {
  const auto keep = [&](WaveFloats& floats, Floats<N> value) {
    store(floats.at + slot, select(on, value, load<N>(floats.at + slot)));
  };
  keep(to.albedo.x, s.albedo.x);
  keep(to.albedo.y, s.albedo.y);
  keep(to.albedo.z, s.albedo.z);
  keep(to.normal.x, s.normal.x);
  keep(to.normal.y, s.normal.y);
  keep(to.normal.z, s.normal.z);
  keep(to.depth_m, s.depth_m);
  store(to.hit.at + slot, select(on, Ints<N>(1), load<N>(to.hit.at + slot)));
}
/// Multiplies the first `count` results by the filter weights, with their alpha if asked, and sets
/// non-finite ones and their weights to zero; returns the number of these.
template <std::size_t N>
std::uint64_t apply_filter_weights(WaveResults& results, std::size_t count, bool has_alpha) {
  std::uint64_t rejected = 0;
  for (std::size_t first = 0; first < count; first += N) {
    const Floats<N> weight = load<N>(results.weight.at + first);
    const Vec3s<N> radiance = load<N>(results.radiance, first) * weight;
    Mask<N> finite = is_finite(radiance.x + radiance.y + radiance.z);
    if (has_alpha) {
      const Floats<N> alpha = load<N>(results.alpha.at + first) * weight;
      finite = finite & is_finite(alpha);
      store(results.alpha.at + first, select(finite, alpha, Floats<N>(0)));
    }
    store(results.radiance, first, select(finite, radiance, Vec3s<N>(Vec3{})));
    store(results.weight.at + first, select(finite, weight, Floats<N>(0)));
    const auto there = static_cast<unsigned>((1ULL << std::min(N, count - first)) - 1);
    rejected += static_cast<std::uint64_t>(std::popcount(~finite.bits() & there));
  }
  return rejected;
}
/// Returns the times of the lanes of `on` with these slots.
template <std::size_t N>
Floats<N> times_of(const Wave& wave, const std::int32_t* slots, unsigned on) {
  Floats<N> out(0);
  for (; on != 0; on &= on - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(on));
    out.v[k] = wave.results.time.at[sample_of(slots[k])];
  }
  return out;
}
/// Returns the bits of the paths from `first` on that are in a solid.
template <std::size_t N>
unsigned in_media(const WaveArray<std::int32_t>& medium, std::size_t first) {
  return (Ints<N>(0) < load<N>(medium.at + first)).bits();
}
inline unsigned lanes_below(std::size_t count) { return count >= 8 ? 0xffU : (1U << count) - 1; }
/// Fills the packet of eight that starts at `first`.
inline void fill(RayPacket& packet, const WaveVec3& origin, const WaveVec3& direction,
                 std::size_t first) {
  std::copy_n(origin.x.at + first, 8, packet.origin_x);
  std::copy_n(origin.y.at + first, 8, packet.origin_y);
  std::copy_n(origin.z.at + first, 8, packet.origin_z);
  std::copy_n(direction.x.at + first, 8, packet.direction_x);
  std::copy_n(direction.y.at + first, 8, packet.direction_y);
  std::copy_n(direction.z.at + first, 8, packet.direction_z);
}

}  // namespace core
