/// Steps of LaneTracer: light samples and their shadow rays.
#pragma once

#include "core/wave/lane_tracer.h"

namespace core {
namespace {

/// As PathTracer::unoccluded().
template <std::size_t N, typename Options>
[[gnu::always_inline]] inline auto LaneTracer<N, Options>::unshadowed(
    const Vertex& at, const BsdfLanes<N>& bsdf, Mask<N> asked, Floats<N> u_pick, Vec2s<N> u) const
    -> Unshadowed {
  const SurfaceLanes<N>& s = at.met.surface;
  Unshadowed out = {lights_.sample(asked, s.origin, *at.light_normal, u_pick, u), {}, {}, {}};
  const LightLanes<N>& light = out.light;
  out.lit = asked & (light.pdf_solid_angle > Floats<N>(0)) & is_not_black(light.radiance);
  if (!out.lit.any()) {
    return out;
  }
  const auto f = bsdf.evaluate(at.frame.to_local(light.wi_world));
  out.lit = out.lit & is_not_black(f.value_cos);
  const Floats<N> weight =
      select(light.is_delta, Floats<N>(1),
             power_heuristic(of_all(light.pdf_solid_angle), f.pdf_solid_angle));
  out.value = at.beta * f.value_cos * at.colors.values(light.radiance);
  out.scale = weight / light.pdf_solid_angle;
  return out;
}

/// As PathTracer::sample_light() with several candidates.
template <std::size_t N, typename Options>
auto LaneTracer<N, Options>::resampled(const Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                       Mask<N> asked, const Numbers& numbers, int depth,
                                       const Vec4s<N>& u) const -> Unshadowed {
  const Vec4s<N> choice = draw(wave, numbers, asked.bits(), choice_group(depth), Drawn::kPair);
  std::array<WeightedReservoir<int>, N> reservoirs = [&]<std::size_t... k>(
      std::index_sequence<k...>) {
    return std::array{WeightedReservoir<int>(static_cast<double>(choice.x.v[k]))...};
  }
  (std::make_index_sequence<N>());
  const int count = candidates();
  Unshadowed taken{};
  taken.lit = Mask<N>::of(0);
  for (int i = 0; i < count; ++i) {
    const auto drawn = candidate(u, i, count);
    const Unshadowed one = unshadowed(at, bsdf, asked, drawn.pick, drawn.place);
    const Floats<N> size = size_of(one.value) * one.scale;
    unsigned replaced = 0;
    for (unsigned rest = one.lit.bits(); rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      reservoirs[k].add(i, static_cast<double>(size.v[k]));
      replaced |= (!reservoirs[k].empty() && reservoirs[k].item() == i ? 1U : 0U) << k;
    }
    const Mask<N> on = Mask<N>::of(replaced);
    taken.light.wi_world = select(on, one.light.wi_world, taken.light.wi_world);
    taken.light.target = select(on, one.light.target, taken.light.target);
    taken.light.is_far = (on & one.light.is_far) | (~on & taken.light.is_far);
    taken.light.light = select(on, one.light.light, taken.light.light);
    taken.value = select(on, one.value, taken.value);
    taken.scale = select(on, one.scale, taken.scale);
    taken.lit = taken.lit | on;
  }
  for (unsigned rest = taken.lit.bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    taken.scale.v[k] *= reservoirs[k].scale(count);
  }
  return taken;
}

/// Samples lights and computes their weights; the shadow rays are traced after all chunks are done.
template <std::size_t N, typename Options>
template <bool kCatches>
void LaneTracer<N, Options>::add_light_samples(Wave& wave, const Vertex& at,
                                               const BsdfLanes<N>& bsdf, const Numbers& numbers,
                                               int depth, const Vec4s<N>& u) const {
  Mask<N> asked = at.on & bsdf.has_spread();
  if (!kCatches && at.met.wall != 0) {
    asked = asked & at.may_scatter;
  }
  if (scalar_.lights().empty() || !asked.any()) {
    return;
  }
  const Unshadowed sampled = kIsDefault || candidates() == 1
                                 ? unshadowed(at, bsdf, asked, u.x, {u.y, u.z})
                                 : resampled(wave, at, bsdf, asked, numbers, depth, u);
  const unsigned taken = sampled.lit.bits();
  if (taken == 0) {
    return;
  }
  const SurfaceLanes<N>& s = at.met.surface;
  const LightLanes<N>& light = sampled.light;
  const Mask<N> above = dot(s.horizon, light.wi_world) >= Floats<N>(0);
  const Vec3s<N> origin =
      offset_ray(s.origin, select(above, s.normal_geometric, -s.normal_geometric), s.error_m);
  Ints<N> slot = numbers.slot;
  if constexpr (kCatches) {
    const Mask<N> is_of_model =
        light.light < Ints<N>(static_cast<std::int32_t>(scene_.triangle_lights.size()));
    slot = select(is_of_model, slot, slot | Ints<N>(kIsBlocked));
  }
  add_shadows(
      wave,
      {origin, light, sampled.value * (sampled.scale * shares(numbers.slot)), at.met.cone_width_m,
       at.is_sharp, slot, medium_beyond(at, ~above), at.null_scatterings},
      taken);
}

template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::add_shadows(Wave& wave,
                                                                       const Shadows& of,
                                                                       unsigned taken) const {
  WaveShadows& to = wave.shadows;
  const LightLanes<N>& light = of.light;
  compress(to.origin, to.count, of.origin, taken);
  compress(to.direction, to.count, select(light.is_far, light.wi_world, light.target - of.origin),
           taken);
  compress(to.t_max.at + to.count, select(light.is_far, Floats<N>(kFar), Floats<N>(1)), taken);
  compress(to.value, to.count, of.value, taken);
  compress(to.cone_width_m.at + to.count, of.cone_width_m, taken);
  compress(to.is_sharp.at + to.count, of.is_sharp, taken);
  if (scene_.has_volumes) {
    compress(to.medium.at + to.count, of.medium, taken);
  }
  compress(to.slot.at + to.count, of.slot, taken);
  if constexpr (kHasLedger) {
    compress(to.light.at + to.count, light.light, taken);
    compress(to.null_scatterings.at + to.count, of.null_scatterings, taken);
  }
  to.count += static_cast<std::size_t>(std::popcount(taken));
}

template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::fill_shadows(TracedPacket& packet,
                                                                        const Wave& wave,
                                                                        std::size_t first,
                                                                        unsigned active) const {
  const WaveShadows& shadows = wave.shadows;
  fill(packet.rays, shadows.origin, shadows.direction, first);
  std::copy_n(shadows.t_max.at + first, 8, packet.rays.t_max);
  if (moves_) {
    store(packet.rays.time, times_of<8>(wave, shadows.slot.at + first, active));
  }
}

/// Traces the pending shadow rays; one by one where a surface may transmit light.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::find_lights(Wave& wave, int depth, std::uint64_t& rays) const {
  WaveShadows& shadows = wave.shadows;
  const auto add = [&](std::size_t i, Vec3 value) {
    const int scatterings = bounces(shadows.null_scatterings, i, depth) + 1;
    credit(wave, shadows.slot.at[i], value, scatterings,
           [&] { return scene_.group_of_light(static_cast<std::uint32_t>(shadows.light.at[i])); });
  };
  const auto catch_light = [&](std::size_t i, Vec3 value, Vec3 open) {
    const bool is_blocked = (shadows.slot.at[i] & kIsBlocked) != 0;
    const std::size_t slot = sample_of(shadows.slot.at[i]);
    WaveVec3& sum = is_blocked ? wave.caught->blocked : wave.caught->lit;
    sum.set(slot, sum.get(slot) + (is_blocked ? value - open : open));
  };
  const bool has_blocked = catcher_.is_in_lanes() && depth == 0;
  const auto arrive = [&](std::size_t i, Vec3 value, Vec3 open) {
    if (has_blocked && wave.caught->on.at[sample_of(shadows.slot.at[i])] != 0) {
      catch_light(i, value, open);
    } else {
      add(i, open);
    }
  };
  const bool all_block = !scene_.has_alpha && !scene_.has_clear && !scene_.has_shared_space;
  if (!all_block && !scene_.has_clear && !scene_.has_volumes) {
    pass_light(wave, rays, arrive);
    shadows.count = 0;
    return;
  }
  TracedPacket packet;
  for (std::size_t first = 0; first < shadows.count; first += 8) {
    const unsigned active = lanes_below(shadows.count - first);
    fill_shadows(packet, wave, first, active);
    unsigned occluded = 0;
    unsigned alone = 0;  // may be transmitted in part
    const unsigned within = scene_.has_volumes ? in_media<8>(shadows.medium, first) : 0;
    if (all_block) {
      occluded = active & scene_.accel->occluded8(packet.rays, active);
    } else {
      packet.met = active & scene_.accel->intersect8(packet.rays, active, packet.hits);
      for (unsigned rest = packet.met; rest != 0; rest &= rest - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(rest));
        occluded |= (surfaces_.blocks(packet.hit(k), packet.ray(k)) ? 1U : 0U) << k;
      }
      alone = packet.met & ~occluded;
    }
    alone |= active & within & ~occluded;
    rays += static_cast<std::uint64_t>(std::popcount(active & ~alone));
    if (has_fog()) {
      thin_in_fog(shadows, first, active & ~occluded & ~alone);
    }
    if (alone == 0 && !has_blocked) {
      for (unsigned open = active & ~occluded; open != 0; open &= open - 1) {
        const std::size_t k = first + static_cast<std::size_t>(std::countr_zero(open));
        add(k, shadows.value.get(k));
      }
      continue;
    }
    for (unsigned rest = has_blocked ? active : active & ~occluded; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      const std::size_t i = first + k;
      const Vec3 value = shadows.value.get(i);
      Vec3 open = (occluded >> k & 1U) != 0 ? Vec3{} : value;
      if ((alone >> k & 1U) != 0) {
        open = value * transmittance(wave, i, depth, rays);
      }
      arrive(i, value, open);
    }
  }
  shadows.count = 0;
}

/// Traces the pending shadow rays where surfaces transmit by holes only.
template <std::size_t N, typename Options>
template <typename Arrive>
void LaneTracer<N, Options>::pass_light(Wave& wave, std::uint64_t& rays,
                                        const Arrive& arrive) const {
  WaveShadows& shadows = wave.shadows;
  struct Of {
    const LaneSurfaces& surfaces;
    TracedPacket packet;
  } of{surfaces_, {}};
  const auto coverage = [](const void* at, const RawHit& hit, unsigned lane) {
    const Of& to = *static_cast<const Of*>(at);
    return to.surfaces.coverage(hit, to.packet.ray(lane));
  };
  rays += shadows.count;
  for (std::size_t first = 0; first < shadows.count; first += 8) {
    const unsigned active = lanes_below(shadows.count - first);
    if (has_fog()) {
      thin_in_fog(shadows, first, active);
    }
    fill_shadows(of.packet, wave, first, active);
    Passage passages[8];
    scene_.accel->pass_holes8(of.packet.rays, active, coverage, &of, passages);
    for (std::size_t k = 0; k < std::min(std::size_t{8}, shadows.count - first); ++k) {
      const Vec3 value = shadows.value.get(first + k);
      arrive(first + k, value, value * passages[k].open);
      rays += passages[k].holes;
    }
  }
}

/// Follows a shadow ray through surfaces that may transmit light.
template <std::size_t N, typename Options>
Vec3 LaneTracer<N, Options>::transmittance(const Wave& wave, std::size_t i, int depth,
                                           std::uint64_t& rays) const {
  const WaveShadows& shadows = wave.shadows;
  PathState path{.sampler = sampler_of(wave, shadows.slot.at[i] & ~kIsBlocked), .rays = rays};
  path.depth = depth;
  path.cone_width_m = shadows.cone_width_m.at[i];
  path.is_sharp = shadows.is_sharp.at[i] != 0;
  if (const std::int32_t medium = scene_.has_volumes ? shadows.medium.at[i] : 0; medium > 0) {
    path.media.enter(solid_of(medium));
  }
  if (is_open_) {
    path.ray.time = wave.results.time.at[sample_of(shadows.slot.at[i])];
  }
  const Ray ray = {shadows.origin.get(i), shadows.direction.get(i), 0, shadows.t_max.at[i]};
  path.fog = fog_;
  Rgb open;
  if constexpr (Options::is_spectral) {
    const SpectralColors colors(wave.wavelengths[sample_of(shadows.slot.at[i])]);
    open = visibility(scene_, path, ray, path.media, ClearSurfaces::kPass, colors).transmittance;
  } else {
    open = visibility(scene_, path, ray, path.media).transmittance;
  }
  return {open.r, open.g, open.b};
}

}  // namespace
}  // namespace core
