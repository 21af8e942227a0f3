/// Holes of surfaces (MASK and BLEND) on the way of eight rays, as in core/transport/intersect.cpp
/// and core/transport/visibility.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/accel/accel.h"
#include "core/scene/face_point.h"
#include "core/transport/intersect.h"
#include "core/wave/lane_surfaces.h"

namespace core {

/// Eight rays and their hits.
struct TracedPacket {
  RayPacket rays;
  HitPacket hits;
  unsigned met = 0;  ///< bits of the rays that meet a surface

  RawHit hit(std::size_t k) const noexcept {
    return {0, hits.instance[k], hits.geometry[k], hits.primitive[k]};
  }
  Ray ray(std::size_t k) const noexcept {
    return {{rays.origin_x[k], rays.origin_y[k], rays.origin_z[k]},
            {rays.direction_x[k], rays.direction_y[k], rays.direction_z[k]},
            0,
            rays.t_max[k],
            rays.time[k]};
  }
  /// Moves the origin of ray k behind its hit; returns the distance.
  float go_behind(const SceneData& scene, std::size_t k) noexcept {
    const Ray from = ray(k);
    const FacePoint point = face_point(scene, hit(k), from);
    const Ray behind = ray_behind(point, from);
    rays.origin_x[k] = behind.origin.x;
    rays.origin_y[k] = behind.origin.y;
    rays.origin_z[k] = behind.origin.z;
    return length(point.position - from.origin);
  }
};

/// Traces the rays that have met holes on behind them; in scenes with solids, finds the holes only.
/// draw(k, i): the i-th random number of ray k. Returns the rays that have met holes, and adds to
/// `rays` those traced.
template <typename Draw>
[[gnu::noinline]] unsigned pass_holes(const SceneData& scene, const LaneSurfaces& surfaces,
                                      TracedPacket& packet, Draw&& draw, std::uint64_t& rays) {
  std::array<std::uint32_t, 8> draws{};
  unsigned all = 0;
  unsigned unknown = packet.met;
  for (int pass = 0; unknown != 0; ++pass) {
    unsigned holes = 0;
    for (; unknown != 0; unknown &= unknown - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(unknown));
      const float coverage = surfaces.coverage(packet.hit(k), packet.ray(k));
      // Where solids have holes, the number depends on whether the hit is of a solid.
      const bool is_hole = scene.has_solid_holes
                               ? coverage < 1
                               : passes_hole(coverage, [&] { return draw(k, draws[k]++); });
      holes |= (is_hole ? 1U : 0U) << k;
    }
    all |= holes;
    if (scene.has_volumes || holes == 0) {
      break;
    }
    for (unsigned rest = holes; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      packet.rays.t_max[k] -= packet.go_behind(scene, k);
    }
    rays += static_cast<std::uint64_t>(std::popcount(holes));
    HitPacket next;
    unknown = pass + 1 < kNullScatteringMax ? scene.accel->intersect8(packet.rays, holes, next) : 0;
    packet.met &= ~holes | unknown;
    for (unsigned rest = unknown; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      packet.hits.instance[k] = next.instance[k];
      packet.hits.geometry[k] = next.geometry[k];
      packet.hits.primitive[k] = next.primitive[k];
    }
  }
  return all;
}

/// Returns what surfaces on the way of shadow rays `on` let through by their holes. Pre: nothing
/// else transmits. Adds to `rays` those traced beyond the first surfaces.
[[gnu::noinline]] inline std::array<float, 8> pass_light(const SceneData& scene,
                                                         const LaneSurfaces& surfaces,
                                                         TracedPacket& packet, unsigned on,
                                                         std::uint64_t& rays) {
  std::array<float, 8> open;
  open.fill(1);
  std::array<Vec3, 8> ends;
  for (std::size_t k = 0; k < 8; ++k) {
    const Ray ray = packet.ray(k);
    ends[k] = ray.origin + ray.direction;
  }
  for (int pass = 0; on != 0; ++pass) {
    packet.met = scene.accel->intersect8(packet.rays, on, packet.hits);
    on = 0;
    for (unsigned rest = packet.met; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      const float coverage = surfaces.coverage(packet.hit(k), packet.ray(k));
      open[k] *= pass + 1 < kNullScatteringMax ? 1 - coverage : 0;
      if (!(open[k] > 0)) {
        continue;
      }
      on |= 1U << k;
      packet.go_behind(scene, k);
      if (!(packet.rays.t_max[k] > 1)) {  // towards a point
        const Vec3 direction = ends[k] - packet.ray(k).origin;
        packet.rays.direction_x[k] = direction.x;
        packet.rays.direction_y[k] = direction.y;
        packet.rays.direction_z[k] = direction.z;
      }
    }
    rays += static_cast<std::uint64_t>(std::popcount(on));
  }
  return open;
}

}  // namespace core
