#include "core/wave/wave_tracer.h"

#include "core/integrators/registry.h"
#include "core/settings/choices.h"
#include "core/wave/lane_fog.h"
#include "core/wave/lane_shadows.h"
#include "core/wave/lane_tracer.h"

namespace core {
namespace {

/// Starts camera rays, in SIMD for pinhole cameras and the box filter.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::begin(Wave& wave, const WaveStart& start,
                                   std::span<const DueSample> due) const {
  WavePaths& paths = wave.paths;
  WaveResults& results = wave.results;
  const LaneCamera camera(start.camera, start.filter, start.moving);
  wave.samplers.assign(due.size(), start.sampler);
  wave.waiting.reserve(kWavePaths);
  wave.wavelengths.clear();
  if constexpr (kHasLedger) {
    wave.shares.assign((split_count_ == 1 ? due.size() : kWavePaths) * share_count_, {});
  }
  catcher_.begin(wave);
  if (surfaces_.has_kinds() && wave.aside == nullptr) {
    wave.aside = std::make_unique_for_overwrite<WaveFront>();
  }
  if (split_count_ > 1) {
    wave.results.radiance = {};
  }
  paths.count = due.size();
  paths.first = (kWavePaths - due.size()) / 8 * 8;
  for (std::size_t i = 0; i < due.size(); ++i) {
    PathSampler& sampler = wave.samplers[i];
    sampler.start(due[i].x, due[i].y, due[i].sample);
    paths.base.at[paths.first + i] = sampler.base();
    paths.index_reversed.at[paths.first + i] = reverse_bits(sampler.index());
    paths.slot.at[paths.first + i] = slot_of_sample(i);
  }
  const Vec3s<N> nothing(Vec3{});
  for (std::size_t first = 0; first < due.size(); first += N) {
    const std::size_t to = paths.first + first;
    const auto some = due.subspan(first, std::min(N, due.size() - first));
    const Vec4s<N> u =
        draw(wave, Numbers::load(paths, to), (1U << some.size()) - 1, kCameraGroup, camera.drawn());
    const auto on = (1U << some.size()) - 1;
    Floats<N> time(0);
    if (is_open_) {
      time = draw(wave, Numbers::load(paths, to), on, kTimeGroup, Drawn::kPair).x;
      store(results.time.at + first, time);
    }
    const CameraRayLanes<N> rays = camera.rays(some, u, time);
    store_rays(wave, to, first, rays);
    catcher_.keep_rays(wave, first, rays);
    store(paths.beta, to, Vec3s<N>(Vec3{1, 1, 1}));
    store(paths.pdf_bsdf.at + to, Floats<N>(0));
    store(paths.last_origin, to, nothing);
    store(paths.last_normal, to, nothing);
    store(paths.is_sharp.at + to, Ints<N>(1));
    store(paths.medium.at + to, Ints<N>(0));
    if constexpr (Options::has_media) {
      store(paths.medium_scatterings.at + to, Ints<N>(0));
    }
    if (scene_.has_clear) {
      store(paths.null_scatterings.at + to, Ints<N>(0));
    }
    store(results.radiance, first, nothing);
    store(results.alpha.at + first, Floats<N>(1));
    store(results.hit.at + first, Ints<N>(0));
    if constexpr (Options::is_spectral) {
      const Floats<N> u_wavelength =
          draw(wave, Numbers::load(paths, to), on, dimension_group(0, BounceGroup::kVolume)).z;
      for (std::size_t k = 0; k < some.size(); ++k) {
        wave.wavelengths.emplace_back(u_wavelength.v[k]);
      }
    }
  }
}

/// Adds the sums of continuations to those of their samples.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::add_continuations(Wave& wave) const {
  const std::size_t count = wave.samplers.size();
  for (int k = 1; k < split_count_; ++k) {
    const std::size_t from = sum_of(slot_of_branch(k, split_count_));
    for (std::size_t i = 0; i < count; ++i) {
      add_radiance(wave.results, slot_of_sample(i), wave.results.radiance.get(from + i));
    }
    for (std::size_t i = 0; i < count * share_count_; ++i) {
      wave.shares[i] += wave.shares[from * share_count_ + i];
    }
  }
}

/// Fills a packet with paths [first, first + 8). Pre: t_max is that of a Ray.
template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::fill_rays(
    TracedPacket& packet, const Wave& wave, std::size_t first, unsigned active, int depth) const {
  const WavePaths& paths = wave.paths;
  fill(packet.rays, paths.origin, paths.direction, first);
  if (depth == 0) {  // camera paths are in the order of their slots
    std::copy_n(wave.results.t_max.at + (first - paths.first), 8, packet.rays.t_max);
  }
  if (moves_) {
    store(packet.rays.time, times_of<8>(wave, paths.slot.at + first, active));
  }
}

/// Finds the nearest surfaces of all paths; paths that leave the scene end in the environment.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::find_hits(Wave& wave, int depth, std::uint64_t& rays) const {
  WavePaths& paths = wave.paths;
  rays += paths.count;
  const bool has_sky =
      !has_fog() && (environment_ != nullptr || (depth == 0 && !backdrop_.is_environment()));
  TracedPacket packet;
  std::fill_n(packet.rays.t_max, 8, Ray{}.t_max);
  const std::size_t end = paths.first + paths.count;
  for (std::size_t first = paths.first; first < end; first += 8) {
    const unsigned active = lanes_below(end - first);
    fill_rays(packet, wave, first, active, depth);
    const unsigned met = scene_.accel->intersect8(packet.rays, active, packet.hits);
    std::copy_n(packet.hits.instance, 8, wave.hits.instance.at + first);
    std::copy_n(packet.hits.geometry, 8, wave.hits.geometry.at + first);
    std::copy_n(packet.hits.primitive, 8, wave.hits.primitive.at + first);
    wave.hits.is_hit.at[first / 8] = met;
    if (!scene_.has_alpha) {
      end_paths(wave, first, active, met, has_sky, depth);
    }
  }
  if (scene_.has_alpha) {
    pass_holes(wave, depth, rays);
    for (std::size_t first = paths.first; first < end; first += 8) {
      const unsigned met = wave.hits.is_hit.at[first / 8];
      end_paths(wave, first, lanes_below(end - first), met, has_sky, depth);
    }
  }
}

/// Appends the paths of `taken` from `first` on, and their hits. Within one front, to a place at or
/// before `first`.
template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::move(const WaveFront& from,
                                                                std::size_t first, unsigned taken,
                                                                WaveFront& to) const {
  const std::size_t at = to.paths.count;
  for_each_member<Options::has_media>(
      scene_.has_clear, [&](auto member) __attribute__((always_inline)) {
        compress(member(to.paths), at, load<N>(member(from.paths), first), taken);
      });
  for (const auto member : {&WaveHits::instance, &WaveHits::geometry, &WaveHits::primitive}) {
    compress(to.hits.*member, at, load<N>(from.hits.*member, first), taken);
  }
  if (scene_.has_alpha) {
    const unsigned holes = from.hits.holes.at[first / 8] >> (first % 8);
    for (unsigned rest = taken, i = 0; rest != 0; rest &= rest - 1, ++i) {
      std::uint32_t& bits = to.hits.holes.at[(at + i) / 8];
      const std::size_t bit = (at + i) % 8;
      bits = (bits & ~(1U << bit)) | (holes >> std::countr_zero(rest) & 1U) << bit;
    }
  }
  to.paths.count += static_cast<std::size_t>(std::popcount(taken));
}

/// Removes the paths that have left the scene, and moves those on surfaces with layers that lanes
/// compute apart behind the others: chunks of lanes are full, and do alike work.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::close_gaps(Wave& wave) const {
  WaveHits& hits = wave.hits;
  const std::size_t end = std::exchange(wave.paths.count, 0);
  for (std::size_t first = 0; first < end; first += N) {
    const unsigned there = lanes_below(end - first) & ((1U << N) - 1);
    const unsigned met = hits.is_hit.at[first / 8] >> (first % 8) & there;
    const unsigned apart = wave.aside == nullptr ? 0 : surfaces_.with_extras<N>(hits, first, met);
    if (apart != 0) {
      move(wave, first, apart, *wave.aside);
    }
    if (met == there && apart == 0 && wave.paths.count == first) {
      wave.paths.count += static_cast<std::size_t>(std::popcount(met));
    } else if (met != apart) {
      move(wave, first, met & ~apart, wave);
    }
  }
  if (wave.aside != nullptr) {
    const std::size_t count = std::exchange(wave.aside->paths.count, 0);
    for (std::size_t first = 0; first < count; first += N) {
      move(*wave.aside, first, lanes_below(count - first) & ((1U << N) - 1), wave);
    }
  }
  for (std::size_t first = 0; first < wave.paths.count; first += 8) {
    hits.is_hit.at[first / 8] = lanes_below(wave.paths.count - first);
  }
}

/// Traces the paths that have met holes on behind them; in scenes with solids, finds the holes
/// only.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::pass_holes(Wave& wave, int depth, std::uint64_t& rays) const {
  const WavePaths& paths = wave.paths;
  WaveHits& hits = wave.hits;
  const auto goes_on = [&](HoleRay& r, const RawHit* hit) {
    const std::size_t group = r.index / 8;
    const unsigned bit = 1U << (r.index % 8);
    if (hit == nullptr) {
      hits.is_hit.at[group] &= ~bit;
      return false;
    }
    const auto draw = [&] {
      return hole_number(sampler_of(wave, paths.slot.at[r.index]), depth, r.draws++);
    };
    // Where solids have holes, the number depends on whether the hit is of a solid.
    const float coverage = surfaces_.coverage(*hit, r.ray);
    if (scene_.has_solid_holes ? !(coverage < 1) : !passes_hole(coverage, draw)) {
      hits.instance.at[r.index] = hit->instance;
      hits.geometry.at[r.index] = hit->geometry;
      hits.primitive.at[r.index] = hit->primitive;
      return false;
    }
    hits.holes.at[group] |= bit;
    if (scene_.has_volumes) {
      return false;
    }
    const bool is_traced = ++r.passes < kNullScatteringMax;
    hits.is_hit.at[group] &= is_traced ? ~0U : ~bit;
    return is_traced;
  };
  HoleQueue queue(scene_, surfaces_, rays, goes_on);
  TracedPacket packet;
  std::fill_n(packet.rays.t_max, 8, Ray{}.t_max);
  const std::size_t end = paths.first + paths.count;
  for (std::size_t first = paths.first; first < end; first += 8) {
    hits.holes.at[first / 8] = 0;
    fill_rays(packet, wave, first, lanes_below(end - first), depth);
    packet.met = hits.is_hit.at[first / 8];
    std::copy_n(hits.instance.at + first, 8, packet.hits.instance);
    std::copy_n(hits.geometry.at + first, 8, packet.hits.geometry);
    std::copy_n(hits.primitive.at + first, 8, packet.hits.primitive);
    queue.add(packet, packet.met, first);
  }
  queue.finish();
}

/// Ends paths [first, first + 8) of `active`, but those of `met`, in the environment.
template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::end_paths(Wave& wave, std::size_t first,
                                                                     unsigned active, unsigned met,
                                                                     bool has_sky,
                                                                     int depth) const {
  unsigned ended = active & ~met;
  if (catcher_.is_in_lanes() && depth == 1) {
    const unsigned caught = catcher_.caught(wave, first, active);
    keep_away(wave, first, caught & met);
    ended &= ~caught;
  }
  for (std::size_t k = 0; k < 8 && has_sky; k += N) {
    const unsigned left = ended >> k & ((1U << N) - 1);
    if (left != 0) {
      add_environment(wave, first + k, left, depth);
    }
  }
}

/// Environment that paths [first, first + N) of `left` have found, times their throughput.
template <std::size_t N, typename Options>
Vec3s<N> LaneTracer<N, Options>::found_environment(const Wave& wave, std::size_t first,
                                                   unsigned left) const {
  const WavePaths& paths = wave.paths;
  const EnvironmentMap sky = environment_->map();
  const MapPoint<Floats<N>> at = sky.point(load<N>(paths.direction, first));
  const Floats<N> pdf_bsdf = load<N>(paths.pdf_bsdf.at + first);
  const Mask<N> spread = Mask<N>::of(left) & (pdf_bsdf > Floats<N>(0));
  Vec3s<N> sun(Vec3{});
  for (std::size_t k = 0; k < N && environment_->has_sun(); ++k) {
    const Rgb disc = environment_->sun_radiance(paths.direction.get(first + k));
    sun.x.v[k] = disc.r;
    sun.y.v[k] = disc.g;
    sun.z.v[k] = disc.b;
  }
  Vec3s<N> radiance = (Mask<N>::of(left) & ~spread).any() ? sky.background(at) + sun : Vec3s<N>{};
  if (spread.any()) {
    const Floats<N> pdf_light = scalar_.lights().pdf_environment(
        load<N>(paths.direction, first), at, load<N>(paths.last_origin, first),
        load<N>(paths.last_normal, first));
    radiance = select(
        spread, (sky.radiance(at) + sun) * power_heuristic(pdf_bsdf, of_all(pdf_light)), radiance);
  }
  return Colors::of(wave, paths.slot.at + first, left).values(radiance) *
         load<N>(paths.beta, first);
}

/// Ends paths [first, first + N) of `left`, which have left the scene.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::add_environment(Wave& wave, std::size_t first, unsigned left,
                                             int depth) const {
  const WavePaths& paths = wave.paths;
  if (depth == 0 && !backdrop_.is_environment()) {
    for (; left != 0; left &= left - 1) {
      const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(left));
      const std::optional<Rgb> seen = backdrop_.seen(paths.direction.get(i));
      Rgb value = seen.value_or(Rgb{});
      const std::size_t slot = sample_of(paths, i);
      wave.results.alpha.at[slot] = seen ? 1.0F : 0.0F;
      if (has_fog() || Options::is_spectral) {
        const Vec3 b = paths.beta.get(i);
        Rgb passed = {b.x, b.y, b.z};
        if constexpr (Options::is_spectral) {
          value = wave.wavelengths[slot].values(value);
          passed = wave.wavelengths[slot].color(passed);
        }
        value = value * Rgb{b.x, b.y, b.z};
        wave.results.alpha.at[slot] = seen ? 1.0F : 1 - luminance(passed);
      }
      credit(wave, paths.slot.at[i], {value.r, value.g, value.b}, depth,
             [] { return kEnvironmentGroup; });
    }
    return;
  }
  const Vec3s<N> radiance =
      found_environment(wave, first, left) * shares(load<N>(paths.slot.at + first));
  for (; left != 0; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    credit(wave, paths.slot.at[first + k], radiance.lane(k),
           bounces(paths.null_scatterings, first + k, depth), [] { return kEnvironmentGroup; });
  }
}

/// Keeps the environment behind the model, which paths [first, first + 8) of `met` have hit from
/// the catcher.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::keep_away(Wave& wave, std::size_t first, unsigned met) const {
  for (std::size_t k = 0; k < 8 && environment_ != nullptr; k += N) {
    unsigned some = met >> k & ((1U << N) - 1);
    if (some == 0) {
      continue;
    }
    const Vec3s<N> radiance = found_environment(wave, first + k, some);
    for (; some != 0; some &= some - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(some));
      wave.caught->kept_away.set(sample_of(wave.paths, first + k + lane), radiance.lane(lane));
    }
  }
}

/// Continues camera paths on the catcher, as CatcherTracer::catch_light().
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::catch_light(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                         const Numbers& numbers) const {
  for (unsigned rest = at.on.bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    catcher_.put(wave, sample_of(numbers.slot.v[k]), at.met.position.lane(k), at.wo_world.lane(k));
  }
  if (max_depth_ > 0) {
    extend<true>(wave, at, bsdf, numbers, 0);
  }
}

template <std::size_t N, typename Options>
template <typename Group>
void LaneTracer<N, Options>::add_emission(Wave& wave, std::size_t i, const LaneHits<N>& met,
                                          std::size_t lane, Group&& group, int depth) const {
  const WavePaths& paths = wave.paths;
  const float pdf_bsdf = paths.pdf_bsdf.at[i];
  const auto light = static_cast<std::uint32_t>(met.light.v[lane]);
  float weight = 1;
  if (pdf_bsdf > 0 && light != kNoLight) {
    const Vec3 last = paths.last_origin.get(i);
    const Vec3 d = met.position.lane(lane) - last;
    const float cos_light =
        std::fabs(dot(met.surface.normal_geometric.lane(lane), paths.direction.get(i)));
    weight = DefaultOptions::mis.weight(
        pdf_bsdf, of_all(scalar_.lights().pdf_triangle(light, last, paths.last_normal.get(i),
                                                       length(d), cos_light)));
  }
  Vec3 emitted = met.emitted.lane(lane);
  if constexpr (Options::is_spectral) {
    const Rgb e = wave.wavelengths[sample_of(paths, i)].values({emitted.x, emitted.y, emitted.z});
    emitted = {e.r, e.g, e.b};
  }
  credit(wave, paths.slot.at[i], paths.beta.get(i) * emitted * (weight * share(paths.slot.at[i])),
         bounces(paths.null_scatterings, i, depth), group);
}

/// Hands a path to the scalar tracer, which continues it from its hit, or finds it anew if null.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::leave_lanes(Wave& wave, std::size_t i, const RawHit* met, int depth,
                                         std::uint64_t& rays) const {
  const WavePaths& paths = wave.paths;
  const std::size_t slot = sample_of(paths, i);
  const float weight = share(paths.slot.at[i]);
  TracedPath path = scalar_paths_.handed_over(paths.get<Options::has_media>(i, scene_.has_clear),
                                              sampler_of(wave, paths.slot.at[i]), rays);
  if (depth == 0) {
    path.ray.t_max = wave.results.t_max.at[slot];
  }
  if (is_open_) {
    path.ray.time = wave.results.time.at[slot];
  }
  if constexpr (Options::is_spectral) {
    path.wavelengths = &wave.wavelengths[slot];
  }
  path.depth = depth;
  path.met = met;
  path.is_clear = depth == 0;
  const bool is_from_catcher =
      catcher_.is_in_lanes() && depth == 1 && wave.caught->on.at[slot] != 0;
  path.out.hit = depth > 0 && !is_from_catcher;
  path.branch_weight = weight;
  path.shares = shares_of(wave, paths.slot.at[i]);
  scalar_paths_.follow(wave, path, paths.slot.at[i]);
  const Rgb found = path.out.radiance * weight;
  add_radiance(wave.results, paths.slot.at[i], {found.r, found.g, found.b});
  if (is_from_catcher && !path.out.hit) {  // left the scene through holes
    add_radiance(wave.results, paths.slot.at[i], -wave.caught->kept_away.get(slot) * weight);
    wave.caught->kept_away.set(slot, {});
  }
  if (depth == 0) {
    const Rgb albedo = path.out.albedo;
    wave.results.alpha.at[slot] = path.out.alpha;
    wave.results.hit.at[slot] = path.out.hit ? 1 : 0;
    wave.results.albedo.set(slot, {albedo.r, albedo.g, albedo.b});
    wave.results.normal.set(slot, path.out.normal_world);
    wave.results.depth_m.at[slot] = path.out.depth_m;
  }
}

/// Multiplies the throughput of paths [first, first + N) of `on` by the transmittance of the solids
/// around them.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::absorb(Wave& wave, std::size_t first, unsigned on,
                                    Floats<N> distance_m) const {
  WavePaths& paths = wave.paths;
  for (on &= in_media<N>(paths.medium, first); on != 0; on &= on - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(on));
    const Rgb sigma_t = solid_of(paths.medium.at[first + k]).material->medium.sigma_t;
    if (!is_black(sigma_t)) {
      const Rgb passed = core::transmittance(sigma_t, distance_m.v[k]);
      paths.beta.set(first + k, paths.beta.get(first + k) * Vec3{passed.r, passed.g, passed.b});
    }
  }
}

template <std::size_t N, typename Options>
Floats<N> LaneTracer<N, Options>::eta_scale(Mask<N> on, Ints<N> medium) const {
  Floats<N> out(1);
  for (unsigned rest = (on & (Ints<N>(0) < medium)).bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    out.v[k] = eta_scale_within(solid_of(medium.v[k]));
  }
  return out;
}

template <std::size_t N, typename Options>
Vec4s<N> LaneTracer<N, Options>::draw(const Wave& wave, const Numbers& numbers, unsigned on,
                                      int group, Drawn drawn) const {
  if (is_sobol_) {
    return sobol_numbers<N>(numbers.base, numbers.index_reversed, group, drawn);
  }
  Vec4s<N> out = {0, 0, 0, 0};
  for (; on != 0; on &= on - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(on));
    const Vec4 u = sampler_of(wave, numbers.slot.v[k]).get_4d(group);
    out.x.v[k] = u.x;
    out.y.v[k] = u.y;
    out.z.v[k] = u.z;
    out.w.v[k] = u.w;
  }
  return out;
}

/// Processes paths [first, first + N): their surfaces, emission, and continuation.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::advance(Wave& wave, std::size_t first, unsigned met, unsigned active,
                                     int depth, std::uint64_t& rays) const {
  WavePaths& paths = wave.paths;
  SegmentLanes<N> segments;
  segments.origin = load<N>(paths.origin, first);
  segments.direction = load<N>(paths.direction, first);
  segments.cone_width_m = load<N>(paths.cone_width_m.at + first);
  segments.cone_spread_rad = load<N>(paths.cone_spread_rad.at + first);
  segments.is_sharp = load<N>(paths.is_sharp.at + first);
  segments.medium = load<N>(paths.medium.at + first);
  if (moves_) {
    segments.time = times_of<N>(wave, paths.slot.at + first, met);
  }
  RawHit hits[N];
  for (std::size_t k = 0; k < N; ++k) {
    hits[k] = {0, wave.hits.instance.at[first + k], wave.hits.geometry.at[first + k],
               wave.hits.primitive.at[first + k]};
  }
  Vertex at;
  unsigned ground = 0;
  unsigned alone = 0;
  unsigned behind = 0;  // holes: the hit is not that of the path's ray
  if (has_exceptions_) {
    ground = catcher_.scalar() != nullptr && depth == 0 ? catcher_.on_ground(hits, met) : 0;
    const unsigned holes = scene_.has_alpha ? wave.hits.holes.at[first / 8] >> (first % 8) : 0;
    alone = met & ((catcher_.is_in_lanes() ? 0 : ground) | (scene_.has_volumes ? holes : 0));
    behind = scene_.has_volumes ? 0 : holes;
  }
  surfaces_.meet(segments, hits, met & ~alone, at.met);
  at.met.unsupported |= alone;
  // Lanes neither remember what has only passed clear surfaces nor pass them unsplit.
  if (depth == 0 && (backdrop_.is_through_glass() || max_depth_ == 0)) {
    at.met.unsupported |= at.met.solid | at.met.wall;
  }
  if (scene_.has_volumes) {
    absorb(wave, first, met & ~at.met.unsupported, at.met.distance_m);
  }
  unsigned on = met & ~at.met.unsupported;
  if constexpr (Options::has_media) {
    if (has_fog()) {
      // Scattered paths take the places of those of the chunk, once these have been read.
      const FogVertex scattered = pass_fog(wave, first, on, active & ~met, segments, at.met, depth);
      reach_surfaces(wave, first, at, on, segments, hits, ground, behind, depth, rays);
      if (scattered.on.any()) {
        scatter_in_fog(wave, scattered, depth);
      }
      return;
    }
  }
  reach_surfaces(wave, first, at, on, segments, hits, ground, behind, depth, rays);
}

template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::load_vertex(
    const WavePaths& paths, std::size_t first, const SegmentLanes<N>& segments, Vertex& at) const {
  at.wo_world = -segments.direction;
  at.beta = load<N>(paths.beta, first);
  at.cone_spread_rad = segments.cone_spread_rad;
  at.is_sharp = segments.is_sharp;
  at.medium = segments.medium;
  if constexpr (Options::has_media) {
    at.medium_scatterings = load<N>(paths.medium_scatterings.at + first);
  }
  at.null_scatterings = null_scatterings(paths.null_scatterings, first);
  at.frame = frame_from_normal(at.met.surface.normal);
  if (at.met.brushed != 0) {
    const Mask<N> is_brushed = Mask<N>::of(at.met.brushed);
    at.frame.s = select(is_brushed, at.met.brush.along, at.frame.s);
    at.frame.t = select(is_brushed, cross(at.met.surface.normal, at.frame.s), at.frame.t);
  }
}

template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::color_surfaces(const Wave& wave,
                                                                          std::size_t first,
                                                                          unsigned on, Vertex& at) {
  const WavePaths& paths = wave.paths;
  at.colors = Colors::of(wave, paths.slot.at + first, on);
  SurfaceLanes<N>& colored = at.met.surface;
  colored.base_color = at.colors.values(colored.base_color);
  colored.f0 = at.colors.values(colored.f0);
  at.met.layers.sheen_color = at.colors.values(at.met.layers.sheen_color);
  at.met.walls.diffuse_color = at.colors.values(at.met.walls.diffuse_color);
  for (unsigned rest = at.met.films.on & on; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    const Rgb nm = wave.wavelengths[sample_of(paths, first + k)].nm();
    at.met.films.wavelengths_nm.set(k, {nm.r, nm.g, nm.b});
  }
}

template <std::size_t N, typename Options>
[[gnu::always_inline]] inline void LaneTracer<N, Options>::reach_surfaces(
    Wave& wave, std::size_t first, Vertex& at, unsigned on, const SegmentLanes<N>& segments,
    const RawHit (&hits)[N], unsigned ground, unsigned behind, int depth,
    std::uint64_t& rays) const {
  WavePaths& paths = wave.paths;
  at.on = Mask<N>::of(on);
  const unsigned lit = (at.on & is_not_black(at.met.emitted)).bits();
  for (unsigned rest = at.met.unsupported | lit; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    if ((at.met.unsupported >> k & 1U) != 0) {
      leave_lanes(wave, first + k, (behind >> k & 1U) != 0 ? nullptr : &hits[k], depth, rays);
    } else {
      add_emission(
          wave, first + k, at.met, k, [&] { return scene_.placed_mesh(hits[k]).group; }, depth);
    }
  }
  if (scene_.has_clear) {
    on &=
        (null_scatterings(paths.null_scatterings, first) < Ints<N>(kNullScatteringMax + 1)).bits();
  }
  if (on == 0) {
    return;
  }
  const unsigned goes_on = below_max_depth(paths, first, on, depth);
  at.met.wall &= on;
  const bool may_pass = scene_.has_clear && at.met.wall != 0;
  if (goes_on == 0 && !may_pass && depth > 0) {
    return;
  }
  const SurfaceLanes<N>& s = at.met.surface;
  load_vertex(paths, first, segments, at);
  [[maybe_unused]] Vec3s<N> albedo;
  if constexpr (Options::is_spectral) {
    if (depth == 0) {
      albedo = at.bsdf().albedo();
    }
    color_surfaces(wave, first, on, at);
  }
  const BsdfLanes<N> bsdf = at.bsdf();
  at.light_normal = &s.horizon;
  if ((at.met.solid | at.met.wall) != 0) {
    at.normal_or_none = select(bsdf.transmits(), Vec3s<N>(Vec3{}), s.horizon);
    at.light_normal = &at.normal_or_none;
  }
  const Numbers numbers = Numbers::load(paths, first);
  if (depth == 0) {
    keep_first_surface<N>(
        wave.results, sample_of(paths, first), at.on,
        {Options::is_spectral ? albedo : bsdf.albedo(), s.normal, at.met.distance_m});
    if (const unsigned caught = ground & on; caught != 0) {
      at.on = Mask<N>::of(caught);
      catch_light(wave, at, bsdf, numbers);
      at.on = Mask<N>::of(on & ~caught);
    }
    if (max_depth_ == 0 || !at.on.any()) {
      return;
    }
  } else if (Options::has_media || scene_.has_clear) {
    at.on = Mask<N>::of(goes_on);
  }
  if (at.met.wall != 0) {
    at.last = {load<N>(paths.pdf_bsdf.at + first), load<N>(paths.last_origin, first),
               load<N>(paths.last_normal, first)};
    at.may_scatter = at.on;
    at.on = at.on | (Mask<N>::of(at.met.wall) & bsdf.is_clear());
  }
  if (depth > 0 || split_count_ == 1) {
    extend(wave, at, bsdf, numbers, depth);
    return;
  }
  for (int k = 0; k < split_count_; ++k) {
    extend(wave, at, bsdf, numbers.branch(k, split_count_), depth);
  }
}

/// Samples a light and the next direction. Continuing paths are compacted to the front of the
/// arrays, at or before this chunk, whose entries have all been read. kCatches: of the catcher.
template <std::size_t N, typename Options>
template <bool kCatches>
void LaneTracer<N, Options>::extend(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                    const Numbers& numbers, int depth) const {
  const SurfaceLanes<N>& s = at.met.surface;
  const unsigned on = at.on.bits();
  const Vec4s<N> u_light = draw(wave, numbers, on, dimension_group(depth, BounceGroup::kLight));
  add_light_samples<kCatches>(wave, at, bsdf, numbers, depth, u_light);

  const Vec4s<N> u = draw(wave, numbers, on, dimension_group(depth, BounceGroup::kBsdf),
                          bsdf.has_one_lobe() ? Drawn::kPair : Drawn::kAll);
  const auto sample = bsdf.sample(u.x, {u.y, u.z});
  Mask<N> alive = at.on & is_not_black(sample.weight);
  const Vec3s<N> wi = at.frame.to_world(sample.wi_local);
  const Mask<N> through = dot(wi, s.horizon) < Floats<N>(0);
  Vec3s<N> beta = at.beta * sample.weight;
  const Ints<N> medium = medium_beyond(at, through);
  Floats<N> pdf_bsdf = sample.pdf_solid_angle;
  Ints<N> null_scatterings = at.null_scatterings;
  Vec3s<N> kept_origin;
  Vec3s<N> kept_normal;
  const Vec3s<N>* last_origin = &s.origin;
  const Vec3s<N>* last_normal = at.light_normal;
  if (!kCatches && at.met.wall != 0) {
    // Emitters behind clear surfaces are weighted as seen from before them.
    alive = alive & (sample.is_null | at.may_scatter);
    pdf_bsdf = select(sample.is_null, at.last.pdf_bsdf, pdf_bsdf);
    kept_origin = select(sample.is_null, at.last.origin, s.origin);
    kept_normal = select(sample.is_null, at.last.normal, *at.light_normal);
    last_origin = &kept_origin;
    last_normal = &kept_normal;
    null_scatterings = null_scatterings + select(sample.is_null, Ints<N>(1), Ints<N>(0));
  }
  if constexpr (!kCatches) {
    Floats<N> size = throughput_size(beta);
    if (scene_.has_volumes) {
      size = size * eta_scale(alive, medium);
    }
    alive = alive & survives_roulette(beta, u_light.w, continuation_probability(size, pdf_bsdf));
  }
  const unsigned taken = alive.bits();
  if (taken == 0) {
    return;
  }
  if constexpr (kCatches) {
    catcher_.keep_mirrored(wave, numbers.slot, sample.is_delta, taken);
  }
  const Mask<N> spreads = ~sample.is_delta;
  const Floats<N>& width = at.met.brushed == 0 ? s.alpha : at.met.brush.alpha_x;
  WavePaths& paths = wave.paths;
  const PathLanes<N> next = {
      .origin =
          offset_ray(s.origin, select(through, -s.normal_geometric, s.normal_geometric), s.error_m),
      .direction = wi,
      .beta = beta,
      .pdf_bsdf = pdf_bsdf,
      .last_origin = *last_origin,
      .last_normal = *last_normal,
      .cone_width_m = at.met.cone_width_m,
      .cone_spread_rad =
          at.cone_spread_rad + select(spreads, kConeSpreadOfWidth * width, Floats<N>(0)),
      .is_sharp = select(spreads, Ints<N>(0), at.is_sharp),
      .medium = medium,
      .base = numbers.base,
      .index_reversed = numbers.index_reversed,
      .slot = numbers.slot,
      .medium_scatterings = at.medium_scatterings,
      .null_scatterings = null_scatterings};
  add_paths(paths, next, taken);
}

/// Of even density, without light samples along segments.
bool is_fog_for_lanes(const IntegratorInput& input) {
  const StudyOptions options(input.settings);
  return input.settings.fog->height_falloff == 0 && !input.aims_in_media && options.candidates == 1;
}

template <typename Options>
std::unique_ptr<const WaveTracer> make_tracer(const IntegratorInput& input, int width) {
  if (width > 1) {
    return std::make_unique<LaneTracer<8, Options>>(input);
  }
  return std::make_unique<LaneTracer<1, Options>>(input);
}

}  // namespace

bool waves_serve(std::string_view isa) noexcept { return isa.starts_with("avx") || isa == "neon"; }

std::unique_ptr<const WaveTracer> make_wave_tracer(const IntegratorInput& input, int width) {
  const IntegratorEntry* row = find_integrator(input.settings.integrator);
  if (row == nullptr || !row->in_lanes || !has_default_estimators(input.settings) ||
      (input.settings.fog && !is_fog_for_lanes(input)) || !input.scene.accel->has_packets() ||
      (input.camera != nullptr && input.camera->is_in_solids())) {
    return nullptr;
  }
  if (input.settings.spectral) {
    const bool is_for_lanes = !input.settings.fog && !has_catcher(input.settings);
    return is_for_lanes ? make_tracer<SpectralOptions>(input, width) : nullptr;
  }
  return DefaultOptions::serves(input) ? make_tracer<DefaultOptions>(input, width)
                                       : make_tracer<WholeOptions>(input, width);
}

}  // namespace core
