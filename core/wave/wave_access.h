/// The arrays of a wave in lanes.
#pragma once

#include <algorithm>
#include <cstddef>

#include "core/accel/accel.h"
#include "core/math/lane_math.h"
#include "core/wave/wave.h"

namespace core {

template <std::size_t N>
Vec3s<N> load(const WaveVec3& from, std::size_t first) {
  return {load<N>(from.x.at + first), load<N>(from.y.at + first), load<N>(from.z.at + first)};
}
template <std::size_t N>
void store(WaveVec3& to, std::size_t first, Vec3s<N> value) {
  store(to.x.at + first, value.x);
  store(to.y.at + first, value.y);
  store(to.z.at + first, value.z);
}
template <std::size_t N>
void compress(WaveVec3& to, std::size_t first, Vec3s<N> value, unsigned taken) {
  compress(to.x.at + first, value.x, taken);
  compress(to.y.at + first, value.y, taken);
  compress(to.z.at + first, value.z, taken);
}
inline std::size_t slot_of(const WavePaths& paths, std::size_t i) {
  return static_cast<std::size_t>(paths.slot.at[i]);
}
inline void add_radiance(WaveResults& results, std::size_t slot, Vec3 value) {
  results.radiance.set(slot, results.radiance.get(slot) + value);
}
inline unsigned lanes_below(std::size_t count) { return count >= 8 ? 0xffU : (1U << count) - 1; }
/// The packet of eight that begins at `first`.
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
