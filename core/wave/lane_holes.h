/// Holes of surfaces (MASK and BLEND) on the way of eight paths, as in
/// core/transport/intersect.cpp.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>

#include "core/accel/accel.h"
#include "core/transport/intersect.h"
#include "core/wave/lane_surfaces.h"
#include "core/wave/wave_access.h"

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
  void set(std::size_t k, const Ray& ray) noexcept {
    rays.origin_x[k] = ray.origin.x;
    rays.origin_y[k] = ray.origin.y;
    rays.origin_z[k] = ray.origin.z;
    rays.direction_x[k] = ray.direction.x;
    rays.direction_y[k] = ray.direction.y;
    rays.direction_z[k] = ray.direction.z;
    rays.t_max[k] = ray.t_max;
    rays.time[k] = ray.time;
  }
};

/// A ray of a wave that passes holes.
struct HoleRay {
  Ray ray;
  RawHit hit;               ///< of the last hole
  std::size_t index = 0;    ///< in the wave's arrays
  int passes = 0;           ///< holes behind it
  std::uint32_t draws = 0;  ///< random numbers taken
};

/// Traces rays on behind the holes that they meet, in packets that are kept full: a ray waits until
/// eight do. goes_on(ray, hit): visits a surface, or null where the ray has left the scene; returns
/// whether the ray is traced on behind it.
template <typename GoesOn>
class HoleQueue {
 public:
  /// rays: counts those traced.
  HoleQueue(const SceneData& scene, const LaneSurfaces& surfaces, std::uint64_t& rays,
            const GoesOn& goes_on)
      : scene_(scene), surfaces_(surfaces), rays_(rays), goes_on_(goes_on) {}

  /// Takes rays `on` of a packet that has been traced; ray k is number first + k of the wave.
  void add(const TracedPacket& packet, unsigned on, std::size_t first) {
    for (; on != 0; on &= on - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(on));
      HoleRay ray;
      ray.ray = packet.ray(k);
      ray.index = first + k;
      visit(ray, packet, k);
    }
    while (count_ >= 8) {
      trace();
    }
  }
  void finish() {
    while (count_ > 0) {
      trace();
    }
  }

 private:
  void trace() {
    const std::size_t taken = std::min(count_, std::size_t{8});
    count_ -= taken;
    TracedPacket packet{};
    std::array<HoleRay, 8> of;
    for (std::size_t k = 0; k < taken; ++k) {
      of[k] = waiting_[count_ + k];
      packet.set(k, of[k].ray);
      packet.hits.instance[k] = of[k].hit.instance;
      packet.hits.geometry[k] = of[k].hit.geometry;
      packet.hits.primitive[k] = of[k].hit.primitive;
    }
    const unsigned on = lanes_below(taken);
    const Floats<8> passed_m = surfaces_.go_behind(packet, on);
    for (std::size_t k = 0; k < taken; ++k) {
      of[k].ray.origin = packet.ray(k).origin;
      of[k].ray.t_max -= passed_m.v[k];
      packet.set(k, of[k].ray);
    }
    rays_ += taken;
    packet.met = scene_.accel->intersect8(packet.rays, on, packet.hits);
    for (std::size_t k = 0; k < taken; ++k) {
      visit(of[k], packet, k);
    }
  }
  void visit(HoleRay& ray, const TracedPacket& packet, std::size_t k) {
    ray.hit = packet.hit(k);
    if (goes_on_(ray, (packet.met >> k & 1U) != 0 ? &ray.hit : nullptr)) {
      waiting_[count_++] = ray;
    }
  }

  const SceneData& scene_;
  const LaneSurfaces& surfaces_;
  std::uint64_t& rays_;
  const GoesOn& goes_on_;
  std::array<HoleRay, 16> waiting_;
  std::size_t count_ = 0;
};

}  // namespace core
