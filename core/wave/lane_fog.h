/// Steps of LaneTracer in fog of even density.
#pragma once

#include "core/wave/lane_tracer.h"

namespace core {
namespace {

/// Where paths scatter in the fog.
template <std::size_t N, typename Options>
struct LaneTracer<N, Options>::FogVertex {
  Mask<N> on;
  Vec3s<N> point;
  Vec3s<N> before;  ///< direction of the segment
  Vec3s<N> beta;
  Floats<N> cone_width_m;
  Floats<N> cone_spread_rad;
  Ints<N> is_sharp;
  Ints<N> medium_scatterings;
  Ints<N> null_scatterings;
  Numbers numbers;
};

/// As PathTracer::reach_through_media() in fog, for paths [first, first + N) of `met`, which have
/// met surfaces, and of `left`, which have left the scene. Removes those from `met` that do not
/// reach them.
template <std::size_t N, typename Options>
auto LaneTracer<N, Options>::pass_fog(Wave& wave, std::size_t first, unsigned& met, unsigned left,
                                      const SegmentLanes<N>& segments, const LaneHits<N>& hits,
                                      int depth) const -> FogVertex {
  WavePaths& paths = wave.paths;
  const Mask<N> is_met = Mask<N>::of(met);
  const Mask<N> on = Mask<N>::of(met | left);
  const Medium& medium = fog_->medium();
  const auto range = fog_->range(segments.origin, segments.direction,
                                 select(is_met, hits.distance_m, Floats<N>(kFar)));
  const Floats<N> depth_m = range.end_m - range.begin_m;
  const Mask<N> within = on & (depth_m > Floats<N>(0));
  const Vec3s<N> before = load<N>(paths.beta, first);
  const Numbers numbers = Numbers::load(paths, first);
  MediumDepth<Floats<N>> passed{Mask<N>::of(0), depth_m,
                                core::transmittance(medium.sigma_t, depth_m)};
  if (medium.scatters() && within.any()) {
    const Vec4s<N> u = draw(wave, numbers, within.bits(),
                            dimension_group(depth, BounceGroup::kVolume), Drawn::kPair);
    passed = sample_medium_depth(medium, channel_probs(before), depth_m, Vec2s<N>{u.x, u.y});
  }
  const Vec3s<N> beta = select(within, before * passed.weight, before);
  store(paths.beta, first, select(on, beta, before));
  const Mask<N> scattered = within & passed.scatters & is_not_black(beta);
  const unsigned alive = (on & is_not_black(beta) & ~scattered).bits();
  if ((left & alive) != 0 &&
      (environment_ != nullptr || (depth == 0 && !backdrop_.is_environment()))) {
    add_environment(wave, first, left & alive, depth);
  }
  const Floats<N> distance_m = min(range.begin_m + passed.depth_m, range.end_m);
  if (scattered.any() && depth == 0) {
    keep_first_surface<N>(wave.results, sample_of(paths, first), scattered,
                          {color_of<Floats<N>>(medium.albedo()), -segments.direction, distance_m});
  }
  met &= alive;
  return {scattered,
          segments.origin + segments.direction * distance_m,
          segments.direction,
          beta,
          select(is_met, hits.cone_width_m, segments.cone_width_m),
          segments.cone_spread_rad,
          segments.is_sharp,
          load<N>(paths.medium_scatterings.at + first),
          null_scatterings(paths.null_scatterings, first),
          numbers};
}

/// Multiplies the light of shadow rays [first, first + 8) of `on` by what the fog lets through.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::thin_in_fog(WaveShadows& shadows, std::size_t first,
                                         unsigned on) const {
  for (std::size_t k = first; k < first + 8; k += N) {
    const Mask<N> some = Mask<N>::of(on >> (k - first) & ((1U << N) - 1));
    if (!some.any()) {
      continue;
    }
    const Vec3s<N> direction = load<N>(shadows.direction, k);
    const Floats<N> t_max = load<N>(shadows.t_max.at + k);
    const Mask<N> is_far = t_max > Floats<N>(1);
    const Floats<N> distance_m = length(direction);
    const auto range =
        fog_->range(load<N>(shadows.origin, k), direction * (Floats<N>(1) / distance_m),
                    select(is_far, Floats<N>(kFar), distance_m));
    const Vec3s<N> value = load<N>(shadows.value, k);
    store(shadows.value, k,
          select(some,
                 value * core::transmittance(fog_->medium().sigma_t, range.end_m - range.begin_m),
                 value));
  }
}

/// As PathTracer::scatter_within().
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::scatter_in_fog(Wave& wave, const FogVertex& at, int depth) const {
  const Mask<N> on = at.on & (at.medium_scatterings < Ints<N>(kMediumScatterings * max_depth_));
  const float g = fog_->medium().g;
  const Vec3s<N> nothing(Vec3{});
  const Vec4s<N> u_light =
      draw(wave, at.numbers, on.bits(), dimension_group(depth, BounceGroup::kLight));
  if (!scalar_.lights().empty() && on.any()) {
    const LightLanes<N> light =
        lights_.sample(on, at.point, nothing, u_light.x, {u_light.y, u_light.z});
    const Floats<N> phase = henyey_greenstein(dot(at.before, light.wi_world), g);
    const Mask<N> lit = on & (light.pdf_solid_angle > Floats<N>(0)) & is_not_black(light.radiance) &
                        (phase > Floats<N>(0));
    const Floats<N> weight =
        select(light.is_delta, Floats<N>(1), power_heuristic(light.pdf_solid_angle, phase));
    add_shadows(wave,
                {at.point, light,
                 at.beta * light.radiance *
                     (phase * weight * shares(at.numbers.slot) / light.pdf_solid_angle),
                 at.cone_width_m, at.is_sharp, at.numbers.slot, Ints<N>(0), at.null_scatterings},
                lit.bits());
  }
  const Vec4s<N> u = draw(wave, at.numbers, on.bits(), dimension_group(depth, BounceGroup::kBsdf));
  const Vec3s<N> wi = sample_henyey_greenstein(at.before, g, Vec2s<N>{u.y, u.z});
  const Floats<N> pdf = henyey_greenstein(dot(at.before, wi), g);
  const auto [beta, survives] = after_roulette(at.beta, pdf, u_light.w);
  const unsigned taken = (on & survives).bits();
  std::uint64_t base[N];
  std::memcpy(base, &at.numbers.base, sizeof base);
  // One by one: the lanes of a second part of the chunk would overwrite the next chunk.
  for (unsigned rest = taken; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    wave.paths.template add<Options::has_media>(
        {.origin = at.point.lane(k),
         .direction = wi.lane(k),
         .beta = beta.lane(k),
         .pdf_bsdf = pdf.v[k],
         .last_origin = at.point.lane(k),
         .last_normal = {},
         .cone_width_m = at.cone_width_m.v[k],
         .cone_spread_rad = at.cone_spread_rad.v[k] + kMediumConeSpread,
         .is_sharp = 0,
         .medium = 0,
         .base = base[k],
         .index_reversed = at.numbers.index_reversed.v[k],
         .slot = at.numbers.slot.v[k],
         .medium_scatterings = at.medium_scatterings.v[k] + 1,
         .null_scatterings = at.null_scatterings.v[k]},
        scene_.has_clear);
  }
}

}  // namespace
}  // namespace core
