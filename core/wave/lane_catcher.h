/// CatcherTracer in lanes: the sums of paths that start on a catcher.
#pragma once

#include <algorithm>
#include <bit>
#include <memory>

#include "core/settings/choices.h"
#include "core/wave/lane_camera.h"
#include "core/wave/scalar_paths.h"
#include "core/wave/wave_access.h"

namespace core {

template <std::size_t N, typename Options>
class LaneCatcher {
 public:
  explicit LaneCatcher(const IntegratorInput& input)
      : scene_(input.scene),
        scalar_(has_catcher(input.settings) ? std::make_unique<CatcherOf<Options>>(input)
                                            : nullptr),
        is_in_lanes_(scalar_ != nullptr && !scalar_->is_soft() &&
                     Options(input.settings).candidates == 1) {}

  /// Null if there is no catcher.
  const CatcherOf<Options>* scalar() const { return scalar_.get(); }
  /// Returns whether lanes continue paths on the catcher; else these leave them.
  bool is_in_lanes() const { return is_in_lanes_; }

  void begin(Wave& wave) const {
    if (scalar_ == nullptr) {
      return;
    }
    if (wave.caught == nullptr) {
      wave.caught = std::make_unique_for_overwrite<WaveCaught>();
    }
    std::fill_n(wave.caught->on.at, kWaveRoom, 0);
  }
  /// Keeps the camera rays of N samples.
  void keep_rays(Wave& wave, std::size_t slot, const CameraRayLanes<N>& rays) const {
    if (scalar_ != nullptr) {
      store(wave.caught->film_x_px.at + slot, rays.film_px.x);
      store(wave.caught->film_y_px.at + slot, rays.film_px.y);
      store(wave.caught->direction, slot, rays.direction);
    }
  }
  /// The hits of `on` that are on the catcher.
  [[gnu::noinline]] unsigned on_ground(const RawHit (&hits)[N], unsigned on) const {
    unsigned out = 0;
    for (; on != 0; on &= on - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(on));
      const bool is_ground =
          scene_.ground && &scene_.placed_mesh(hits[k]) == &scene_.placed[*scene_.ground];
      out |= (is_ground ? 1U : 0U) << k;
    }
    return out;
  }
  /// Puts a sample on the catcher.
  void put(Wave& wave, std::size_t slot, Vec3 point, Vec3 wo_world) const {
    const Rgb bare = scalar_->bare_ground().radiance(point, wo_world);
    WaveCaught& caught = *wave.caught;
    caught.on.at[slot] = 1;
    caught.is_mirrored.at[slot] = 0;
    caught.blocked.set(slot, {});
    caught.lit.set(slot, {});
    caught.kept_away.set(slot, {});
    caught.bare.set(slot, {bare.r, bare.g, bare.b});
  }
  /// Keeps which samples, of `on`, continue by the coat.
  void keep_mirrored(Wave& wave, const Ints<N>& slots, Mask<N> is_delta, unsigned on) const {
    for (; on != 0; on &= on - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(on));
      wave.caught->is_mirrored.at[sample_of(slots.v[k])] = (is_delta.bits() >> k & 1U) != 0 ? 1 : 0;
    }
  }
  /// The paths [first, first + 8) of `on` whose samples are on the catcher.
  [[gnu::noinline]] unsigned caught(const Wave& wave, std::size_t first, unsigned on) const {
    unsigned out = 0;
    for (; on != 0; on &= on - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(on));
      out |= static_cast<unsigned>(wave.caught->on.at[sample_of(wave.paths, first + k)]) << k;
    }
    return out;
  }
  /// Replaces the radiance of samples on the catcher by what the camera sees of it.
  void end(Wave& wave) const {
    const auto rgb = [](Vec3 v) { return Rgb{v.x, v.y, v.z}; };
    for (std::size_t i = 0; i < wave.samplers.size() && is_in_lanes_; ++i) {
      const WaveCaught& caught = *wave.caught;
      if (caught.on.at[i] == 0) {
        continue;
      }
      typename CatcherOf<Options>::Changes changes;
      changes.diffuse.blocked = rgb(caught.blocked.get(i));
      changes.diffuse.bounced = rgb(caught.lit.get(i));
      auto& change = caught.is_mirrored.at[i] != 0 ? changes.mirrored : changes.diffuse;
      change.blocked += rgb(caught.kept_away.get(i));
      change.bounced += rgb(wave.results.radiance.get(i));
      const auto out = scalar_->caught(changes, rgb(caught.bare.get(i)), caught.direction.get(i),
                                       {caught.film_x_px.at[i], caught.film_y_px.at[i]});
      wave.results.radiance.set(i, {out.color.r, out.color.g, out.color.b});
      wave.results.alpha.at[i] = out.alpha;
    }
  }

 private:
  const SceneData& scene_;
  std::unique_ptr<const CatcherOf<Options>> scalar_;
  bool is_in_lanes_;
};

}  // namespace core
