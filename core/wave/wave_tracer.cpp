#include "core/wave/wave_tracer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>
#include <utility>

#include "core/integrators/path/light_candidates.h"
#include "core/integrators/path/path_tracer.h"
#include "core/math/frame.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/mis.h"
#include "core/sampling/reservoir.h"
#include "core/transport/roulette.h"
#include "core/transport/visibility.h"
#include "core/wave/lane_camera.h"
#include "core/wave/lane_catcher.h"
#include "core/wave/lane_environment.h"
#include "core/wave/lane_holes.h"
#include "core/wave/lane_lights.h"
#include "core/wave/lane_sampler.h"
#include "core/wave/lane_surfaces.h"
#include "core/wave/scalar_paths.h"
#include "core/wave/wave_access.h"

namespace core {
namespace {

// The rule that the lanes use.
static_assert(DefaultOptions::mis.type == MisType::kPower && DefaultOptions::mis.exponent == 2);

/// Of WaveShadows' slots: the sample counts where the model blocks it.
constexpr std::int32_t kIsBlocked = 1 << 30;

/// PathTracer<Options>, step by step, for the paths of a wave. Options: DefaultOptions, or
/// WholeOptions with the same estimators but for the number of light candidates.
template <std::size_t N, typename Options>
class LaneTracer final : public WaveTracer {
 public:
  explicit LaneTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        max_depth_(input.settings.max_depth),
        split_count_(Options(input.settings).split_count),
        share_(1 / static_cast<float>(split_count_)),
        is_sobol_(input.settings.sampler == SamplerType::kSobol),
        share_count_(kHasLedger ? input.settings.film.shares.size() : 0),
        has_alpha_weights_(input.settings.film.errors_over_white),
        scalar_(input),
        ledger_(input),
        catcher_(input),
        scalar_paths_(scalar_, catcher_.scalar()),
        lights_(scene_, scalar_.lights()),
        sky_(input.environment, scalar_.lights().sky_density()),
        surfaces_(scene_),
        has_exceptions_(scene_.has_alpha || catcher_.scalar() != nullptr) {}

  std::size_t samples_max() const noexcept override {
    const std::size_t most = kWavePaths / static_cast<std::size_t>(split_count_) / 8 * 8;
    // A chunk on the catcher is compacted in two parts. Of n paths that split, the first
    // continuations take the places of the n themselves, so that there is room.
    return catcher_.is_in_lanes() && split_count_ == 1 ? most - 8 : most;
  }
  void begin(Wave& wave, const WaveStart& start, std::span<const DueSample> due) const override;
  void trace(Wave& wave, std::uint64_t& rays, std::uint64_t& rejected) const noexcept override {
    for (int depth = 0; wave.paths.count > 0 || !wave.waiting.empty(); ++depth) {
      ScalarPaths<Options>::take_back(wave, depth);
      find_hits(wave, depth, rays);
      const std::size_t end = wave.paths.first + wave.paths.count;
      wave.paths.count = 0;
      for (std::size_t first = std::exchange(wave.paths.first, 0); first < end; first += N) {
        const unsigned met = wave.hits.is_hit.at[first / 8] >> (first % 8) & ((1U << N) - 1);
        if (met != 0) {
          advance(wave, first, met, depth, rays);
        }
      }
      find_lights(wave, depth, rays);
    }
    catcher_.end(wave);
    rejected += apply_filter_weights<N>(wave.results, wave.samplers.size(), has_alpha_weights_);
  }

 private:
  /// The surface vertices of one chunk of lanes.
  struct Vertex {
    LaneHits<N> met;
    Vec3s<N> wo_world;
    Vec3s<N> beta;
    FrameOf<Floats<N>> frame;
    Mask<N> on;
    Floats<N> cone_spread_rad;
    Ints<N> is_sharp;
  };
  using Numbers = PathNumbers<N>;
  /// Light samples without shadow, which add value * scale.
  struct Unshadowed {
    LightLanes<N> light;
    Vec3s<N> value;
    Floats<N> scale;
    Mask<N> lit;
  };
  static constexpr bool kHasLedger = !std::is_same_v<typename Options::Ledger, NoLedger>;
  static constexpr bool kIsDefault = std::is_same_v<Options, DefaultOptions>;

  int candidates() const { return scalar_.options().candidates; }
  /// Density of all light samples of a surface, for MIS.
  template <typename F>
  F of_all(F pdf) const {
    if constexpr (kIsDefault) {
      return pdf;
    } else {
      return pdf * F(static_cast<float>(candidates()));
    }
  }
  Rgb* shares_of(Wave& wave, std::size_t slot) const {
    return share_count_ > 0 ? &wave.shares[slot * share_count_] : nullptr;
  }
  /// As PathTracer::credit().
  template <typename Group>
  void credit(Wave& wave, std::size_t slot, Vec3 value, int scatterings, Group&& group) const {
    add_radiance(wave.results, slot, value);
    if constexpr (kHasLedger) {
      ledger_.add(shares_of(wave, slot), {value.x, value.y, value.z}, scatterings, group);
    }
  }

  void find_hits(Wave& wave, int depth, std::uint64_t& rays) const;
  void find_lights(Wave& wave, int depth, std::uint64_t& rays) const;
  Vec3s<N> found_environment(const WavePaths& paths, std::size_t first, unsigned left) const;
  void add_environment(Wave& wave, std::size_t first, unsigned left, int depth) const;
  template <typename Group>
  void add_emission(Wave& wave, std::size_t i, const LaneHits<N>& met, std::size_t lane,
                    Group&& group, int depth) const;
  [[gnu::noinline]] void keep_away(Wave& wave, std::size_t first, unsigned met) const;
  [[gnu::noinline]] void catch_light(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                     const Numbers& numbers) const;
  void leave_lanes(Wave& wave, std::size_t i, const RawHit* met, int depth,
                   std::uint64_t& rays) const;
  void advance(Wave& wave, std::size_t first, unsigned met, int depth, std::uint64_t& rays) const;
  template <bool kCatches = false>
  [[gnu::flatten]] void extend(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                               const Numbers& numbers, int depth) const;
  Unshadowed unshadowed(const Vertex& at, const BsdfLanes<N>& bsdf, Mask<N> asked, Floats<N> u_pick,
                        Vec2s<N> u) const;
  [[gnu::noinline]] Unshadowed resampled(const Wave& wave, const Vertex& at,
                                         const BsdfLanes<N>& bsdf, Mask<N> asked,
                                         const Numbers& numbers, int depth,
                                         const Vec4s<N>& u) const;
  template <bool kCatches>
  void add_light_samples(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                         const Numbers& numbers, int depth, const Vec4s<N>& u) const;
  [[gnu::noinline]] Vec3 transmittance(const Wave& wave, std::size_t i, int depth,
                                       std::uint64_t& rays) const;
  Vec4s<N> draw(const Wave& wave, const Numbers& numbers, unsigned on, int group,
                Drawn drawn = Drawn::kAll) const;
  PathSampler sampler_of(const Wave& wave, std::int32_t slot) const {
    const PathSampler& whole = wave.samplers[slot_of(slot)];
    const int continuation = slot >> kContinuationShift;
    return continuation == 0 ? whole : whole.branch(continuation - 1, split_count_);
  }
  /// Weight of contributions of a path at this depth.
  float share(int depth) const { return depth == 0 ? 1.0F : share_; }

  const SceneData& scene_;
  const Environment* environment_;
  Backdrop backdrop_;
  int max_depth_;
  int split_count_;  ///< continuations at the first surface
  float share_;      ///< weight of each continuation
  bool is_sobol_;
  std::size_t share_count_;
  bool has_alpha_weights_;
  PathTracer<Options> scalar_;
  [[no_unique_address]] typename Options::Ledger ledger_;
  LaneCatcher<N, Options> catcher_;
  ScalarPaths<Options> scalar_paths_;
  LaneLights lights_;
  LaneEnvironment sky_;
  LaneSurfaces surfaces_;
  bool has_exceptions_;  ///< hits may be holes, or on a catcher
};

/// Starts camera rays, in SIMD for pinhole cameras and the box filter.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::begin(Wave& wave, const WaveStart& start,
                                   std::span<const DueSample> due) const {
  WavePaths& paths = wave.paths;
  WaveResults& results = wave.results;
  const LaneCamera camera(start.camera, start.filter);
  wave.samplers.assign(due.size(), start.sampler);
  wave.waiting.reserve(kWavePaths);
  if constexpr (kHasLedger) {
    wave.shares.assign(due.size() * share_count_, {});
  }
  catcher_.begin(wave);
  paths.count = due.size();
  paths.first = (kWavePaths - due.size()) / 8 * 8;
  for (std::size_t i = 0; i < due.size(); ++i) {
    PathSampler& sampler = wave.samplers[i];
    sampler.start(due[i].x, due[i].y, due[i].sample);
    paths.base.at[paths.first + i] = sampler.base();
    paths.index_reversed.at[paths.first + i] = reverse_bits(sampler.index());
    paths.slot.at[paths.first + i] = static_cast<std::int32_t>(i);
  }
  const Vec3s<N> nothing(Vec3{});
  for (std::size_t first = 0; first < due.size(); first += N) {
    const std::size_t to = paths.first + first;
    const auto some = due.subspan(first, std::min(N, due.size() - first));
    const Vec4s<N> u =
        draw(wave, Numbers::load(paths, to), (1U << some.size()) - 1, kCameraGroup, camera.drawn());
    const CameraRayLanes<N> rays = camera.rays(some, u);
    store_rays(wave, to, first, rays);
    catcher_.keep_rays(wave, first, rays);
    store(paths.beta, to, Vec3s<N>(Vec3{1, 1, 1}));
    store(paths.pdf_bsdf.at + to, Floats<N>(0));
    store(paths.last_origin, to, nothing);
    store(paths.last_normal, to, nothing);
    store(paths.is_sharp.at + to, Ints<N>(1));
    store(results.radiance, first, nothing);
    store(results.alpha.at + first, Floats<N>(1));
    store(results.hit.at + first, Ints<N>(0));
  }
}

/// Finds the nearest surfaces of all paths; paths that leave the scene end in the environment.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::find_hits(Wave& wave, int depth, std::uint64_t& rays) const {
  WavePaths& paths = wave.paths;
  rays += paths.count;
  const bool has_sky = environment_ != nullptr || (depth == 0 && !backdrop_.is_environment());
  TracedPacket packet;
  std::fill_n(packet.rays.t_max, 8, Ray{}.t_max);
  const std::size_t end = paths.first + paths.count;
  for (std::size_t first = paths.first; first < end; first += 8) {
    const unsigned active = lanes_below(end - first);
    fill(packet.rays, paths.origin, paths.direction, first);
    if (depth == 0) {  // camera paths are in the order of their slots
      std::copy_n(wave.results.t_max.at + (first - paths.first), 8, packet.rays.t_max);
    }
    unsigned met = scene_.accel->intersect8(packet.rays, active, packet.hits);
    if (scene_.has_alpha) {
      packet.met = met;
      // By value, so that the variables of the loop stay in registers.
      const auto draw = [this, &wave, first, depth](std::size_t k, std::uint32_t i) {
        return sampler_of(wave, wave.paths.slot.at[first + k]).extra_1d(depth, i);
      };
      wave.hits.holes.at[first / 8] = pass_holes(scene_, surfaces_, packet, draw, rays);
      met = packet.met;
      std::fill_n(packet.rays.t_max, 8, Ray{}.t_max);
    }
    std::copy_n(packet.hits.instance, 8, wave.hits.instance.at + first);
    std::copy_n(packet.hits.geometry, 8, wave.hits.geometry.at + first);
    std::copy_n(packet.hits.primitive, 8, wave.hits.primitive.at + first);
    wave.hits.is_hit.at[first / 8] = met;
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
}

/// Environment that paths [first, first + N) of `left` have found, times their throughput.
template <std::size_t N, typename Options>
Vec3s<N> LaneTracer<N, Options>::found_environment(const WavePaths& paths, std::size_t first,
                                                   unsigned left) const {
  const MapPoints<N> at = sky_.points(load<N>(paths.direction, first));
  const Floats<N> pdf_bsdf = load<N>(paths.pdf_bsdf.at + first);
  const Mask<N> spread = Mask<N>::of(left) & (pdf_bsdf > Floats<N>(0));
  Vec3s<N> sun(Vec3{});
  for (std::size_t k = 0; k < N && environment_->has_sun(); ++k) {
    const Rgb disc = environment_->sun_radiance(paths.direction.get(first + k));
    sun.x.v[k] = disc.r;
    sun.y.v[k] = disc.g;
    sun.z.v[k] = disc.b;
  }
  Vec3s<N> radiance = (Mask<N>::of(left) & ~spread).any() ? sky_.background(at) + sun : Vec3s<N>{};
  if (spread.any()) {
    const Floats<N> pdf_light = lights_.pdf_environment(spread, load<N>(paths.direction, first), at,
                                                        load<N>(paths.last_origin, first),
                                                        load<N>(paths.last_normal, first));
    radiance = select(
        spread, (sky_.radiance(at) + sun) * power_heuristic(pdf_bsdf, of_all(pdf_light)), radiance);
  }
  return radiance * load<N>(paths.beta, first);
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
      const Rgb value = seen.value_or(Rgb{});
      const std::size_t slot = slot_of(paths, i);
      wave.results.alpha.at[slot] = seen ? 1.0F : 0.0F;
      credit(wave, slot, {value.r, value.g, value.b}, depth, [] { return kEnvironmentGroup; });
    }
    return;
  }
  const Vec3s<N> radiance = found_environment(paths, first, left) * Floats<N>(share(depth));
  for (; left != 0; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    credit(wave, slot_of(paths, first + k), radiance.lane(k), depth,
           [] { return kEnvironmentGroup; });
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
    const Vec3s<N> radiance = found_environment(wave.paths, first + k, some);
    for (; some != 0; some &= some - 1) {
      const auto lane = static_cast<std::size_t>(std::countr_zero(some));
      wave.caught->kept_away.set(slot_of(wave.paths, first + k + lane), radiance.lane(lane));
    }
  }
}

/// Continues camera paths on the catcher, as CatcherTracer::catch_light().
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::catch_light(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                         const Numbers& numbers) const {
  for (unsigned rest = at.on.bits(); rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    catcher_.put(wave, slot_of(numbers.slot.v[k]), at.met.position.lane(k), at.wo_world.lane(k));
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
  credit(wave, slot_of(paths, i),
         paths.beta.get(i) * met.emitted.lane(lane) * (weight * share(depth)), depth, group);
}

/// Hands a path to the scalar tracer, which continues it from its hit, or finds it anew if null.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::leave_lanes(Wave& wave, std::size_t i, const RawHit* met, int depth,
                                         std::uint64_t& rays) const {
  const WavePaths& paths = wave.paths;
  const std::size_t slot = slot_of(paths, i);
  TracedPath path =
      scalar_paths_.handed_over(paths.get(i), sampler_of(wave, paths.slot.at[i]), rays);
  if (depth == 0) {
    path.ray.t_max = wave.results.t_max.at[slot];
  }
  path.depth = depth;
  path.met = met;
  path.is_clear = depth == 0;
  const bool is_from_catcher =
      catcher_.is_in_lanes() && depth == 1 && wave.caught->on.at[slot] != 0;
  path.out.hit = depth > 0 && !is_from_catcher;
  path.branch_weight = share(depth);
  path.shares = shares_of(wave, slot);
  scalar_paths_.follow(wave, path, paths.slot.at[i]);
  const Rgb found = path.out.radiance * share(depth);
  add_radiance(wave.results, slot, {found.r, found.g, found.b});
  if (is_from_catcher && !path.out.hit) {  // left the scene through holes
    add_radiance(wave.results, slot, -wave.caught->kept_away.get(slot) * share(depth));
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
void LaneTracer<N, Options>::advance(Wave& wave, std::size_t first, unsigned met, int depth,
                                     std::uint64_t& rays) const {
  WavePaths& paths = wave.paths;
  SegmentLanes<N> segments;
  segments.origin = load<N>(paths.origin, first);
  segments.direction = load<N>(paths.direction, first);
  segments.cone_width_m = load<N>(paths.cone_width_m.at + first);
  segments.cone_spread_rad = load<N>(paths.cone_spread_rad.at + first);
  segments.is_sharp = load<N>(paths.is_sharp.at + first);
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
  const unsigned on = met & ~at.met.unsupported;
  at.on = Mask<N>::of(on);
  const unsigned lit = (at.on & is_not_black(at.met.emitted)).bits();
  // In the order of the paths: continuations of one sample add up alike in any chunks.
  for (unsigned rest = at.met.unsupported | lit; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    if ((at.met.unsupported >> k & 1U) != 0) {
      leave_lanes(wave, first + k, (behind >> k & 1U) != 0 ? nullptr : &hits[k], depth, rays);
    } else {
      add_emission(
          wave, first + k, at.met, k, [&] { return scene_.placed_mesh(hits[k]).group; }, depth);
    }
  }
  if (on == 0) {
    return;
  }
  if (depth >= max_depth_ && depth > 0) {
    return;
  }
  const SurfaceLanes<N>& s = at.met.surface;
  at.wo_world = -segments.direction;
  at.beta = load<N>(paths.beta, first);
  at.cone_spread_rad = segments.cone_spread_rad;
  at.is_sharp = segments.is_sharp;
  at.frame = frame_from_normal(s.normal);
  const BsdfLanes<N> bsdf(s, at.frame.to_local(at.wo_world), at.frame.to_local(s.horizon),
                          at.met.layered == 0 ? nullptr : &at.met.layers);
  const Numbers numbers = Numbers::load(paths, first);
  if (depth == 0) {
    keep_first_surface<N>(wave.results, slot_of(paths, first), at.on,
                          {bsdf.albedo(), s.normal, at.met.distance_m});
    if (const unsigned caught = ground & on; caught != 0) {
      at.on = Mask<N>::of(caught);
      catch_light(wave, at, bsdf, numbers);
      at.on = Mask<N>::of(on & ~caught);
    }
    if (max_depth_ == 0 || !at.on.any()) {
      return;
    }
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
  const Vec3s<N> wi = at.frame.to_world(sample.wi);
  const Mask<N> through = dot(wi, s.horizon) < Floats<N>(0);
  Vec3s<N> beta = at.beta * sample.weight;
  if constexpr (!kCatches) {
    const Floats<N> survive = continuation_probability(
        max_component(Vec3s<N>(abs(beta.x), abs(beta.y), abs(beta.z))), sample.pdf_solid_angle);
    const Mask<N> faint = survive < Floats<N>(1);
    alive = alive & ~(faint & (u_light.w >= survive));
    beta = select(faint, beta * (Floats<N>(1) / survive), beta);
  }
  const unsigned taken = depth + 1 <= max_depth_ ? alive.bits() : 0;
  if (taken == 0) {
    return;
  }
  const Mask<N> spreads = ~sample.is_delta;
  WavePaths& paths = wave.paths;
  const std::size_t to = paths.count;
  const PathLanes<N> next = {
      .origin =
          offset_ray(s.origin, select(through, -s.normal_geometric, s.normal_geometric), s.error_m),
      .direction = wi,
      .beta = beta,
      .pdf_bsdf = sample.pdf_solid_angle,
      .last_origin = s.origin,
      .last_normal = s.horizon,
      .cone_width_m = at.met.cone_width_m,
      .cone_spread_rad =
          at.cone_spread_rad + select(spreads, kConeSpreadOfWidth * s.alpha, Floats<N>(0)),
      .is_sharp = select(spreads, Ints<N>(0), at.is_sharp),
      .base = numbers.base,
      .index_reversed = numbers.index_reversed,
      .slot = numbers.slot};
  for_each_member([&](auto member) __attribute__((always_inline)) {
    compress(member(paths), to, member(next), taken);
  });
  paths.count += static_cast<std::size_t>(std::popcount(taken));
}

/// As PathTracer::unoccluded().
template <std::size_t N, typename Options>
[[gnu::always_inline]] inline auto LaneTracer<N, Options>::unshadowed(
    const Vertex& at, const BsdfLanes<N>& bsdf, Mask<N> asked, Floats<N> u_pick, Vec2s<N> u) const
    -> Unshadowed {
  const SurfaceLanes<N>& s = at.met.surface;
  Unshadowed out = {lights_.sample(asked, s.origin, s.horizon, u_pick, u), {}, {}, {}};
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
  out.value = at.beta * f.value_cos * light.radiance;
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
    const Floats<N> size =
        luminance(Vec3s<N>(abs(one.value.x), abs(one.value.y), abs(one.value.z))) * one.scale;
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
    const WeightedReservoir<int>& from = reservoirs[k];
    taken.scale.v[k] *=
        static_cast<float>(from.sum() / (static_cast<double>(count) * from.weight()));
  }
  return taken;
}

/// Samples lights and computes their weights; the shadow rays are traced after all chunks are done.
template <std::size_t N, typename Options>
template <bool kCatches>
void LaneTracer<N, Options>::add_light_samples(Wave& wave, const Vertex& at,
                                               const BsdfLanes<N>& bsdf, const Numbers& numbers,
                                               int depth, const Vec4s<N>& u) const {
  const Mask<N> asked = at.on & bsdf.has_spread();
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
  Floats<N> share(share_);
  if constexpr (kCatches) {
    const Mask<N> is_of_model =
        light.light < Ints<N>(static_cast<std::int32_t>(scene_.triangle_lights.size()));
    slot = select(is_of_model, slot, slot | Ints<N>(kIsBlocked));
    share = select(is_of_model, share, Floats<N>(1));
  }
  WaveShadows& to = wave.shadows;
  compress(to.origin, to.count, origin, taken);
  compress(to.direction, to.count, select(light.is_far, light.wi_world, light.target - origin),
           taken);
  compress(to.t_max.at + to.count, select(light.is_far, Floats<N>(kFar), Floats<N>(1)), taken);
  compress(to.value, to.count, sampled.value * (sampled.scale * share), taken);
  compress(to.cone_width_m.at + to.count, at.met.cone_width_m, taken);
  compress(to.is_sharp.at + to.count, at.is_sharp, taken);
  compress(to.slot.at + to.count, slot, taken);
  if constexpr (kHasLedger) {
    compress(to.light.at + to.count, light.light, taken);
  }
  to.count += static_cast<std::size_t>(std::popcount(taken));
}

/// Traces the pending shadow rays; one by one where a surface may transmit light.
template <std::size_t N, typename Options>
void LaneTracer<N, Options>::find_lights(Wave& wave, int depth, std::uint64_t& rays) const {
  WaveShadows& shadows = wave.shadows;
  const auto add = [&](std::size_t i, Vec3 value) {
    credit(wave, slot_of(shadows.slot.at[i]), value, depth + 1,
           [&] { return scene_.group_of_light(static_cast<std::uint32_t>(shadows.light.at[i])); });
  };
  const auto is_blocked = [&](std::size_t i) { return (shadows.slot.at[i] & kIsBlocked) != 0; };
  const auto block = [&](std::size_t i, Vec3 value) {
    const std::size_t slot = slot_of(shadows.slot.at[i]);
    wave.caught->blocked.set(slot, wave.caught->blocked.get(slot) + value);
  };
  const bool has_blocked = catcher_.is_in_lanes() && depth == 0;
  const bool all_block = !scene_.has_alpha && !scene_.has_clear && !scene_.has_shared_space;
  const bool has_holes_only = !all_block && !scene_.has_clear && !scene_.has_volumes;
  TracedPacket packet;
  std::array<float, 8> passed{};
  for (std::size_t first = 0; first < shadows.count; first += 8) {
    const unsigned active = lanes_below(shadows.count - first);
    fill(packet.rays, shadows.origin, shadows.direction, first);
    std::copy_n(shadows.t_max.at + first, 8, packet.rays.t_max);
    unsigned occluded = 0;
    unsigned alone = 0;  // may be transmitted in part
    if (all_block) {
      occluded = active & scene_.accel->occluded8(packet.rays, active);
    } else if (has_holes_only) {
      passed = pass_light(scene_, surfaces_, packet, active, rays);
      for (std::size_t k = 0; k < 8; ++k) {
        occluded |= (passed[k] > 0 ? 0U : 1U) << k;
      }
    } else if (scene_.has_shared_space) {
      alone = active;
    } else {
      packet.met = active & scene_.accel->intersect8(packet.rays, active, packet.hits);
      for (unsigned rest = packet.met; rest != 0; rest &= rest - 1) {
        const auto k = static_cast<std::size_t>(std::countr_zero(rest));
        occluded |= (surfaces_.blocks(packet.hit(k), packet.ray(k)) ? 1U : 0U) << k;
      }
      alone = packet.met & ~occluded;
    }
    rays += static_cast<std::uint64_t>(std::popcount(active & ~alone));
    if (alone == 0 && !has_blocked && !has_holes_only) {
      for (unsigned open = active & ~occluded; open != 0; open &= open - 1) {
        const std::size_t k = first + static_cast<std::size_t>(std::countr_zero(open));
        add(k, shadows.value.get(k));
      }
      continue;
    }
    // In the order of the paths: several may add to one sample.
    for (unsigned rest = has_blocked ? active : active & ~occluded; rest != 0; rest &= rest - 1) {
      const auto k = static_cast<std::size_t>(std::countr_zero(rest));
      const std::size_t i = first + k;
      const Vec3 value = shadows.value.get(i);
      Vec3 open = (occluded >> k & 1U) != 0 ? Vec3{} : value;
      if ((alone >> k & 1U) != 0) {
        open = value * transmittance(wave, i, depth, rays);
      } else if (has_holes_only) {
        open = value * passed[k];
      }
      if (has_blocked && is_blocked(i)) {
        block(i, value - open);
      } else {
        add(i, open);
      }
    }
  }
  shadows.count = 0;
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
  const Ray ray = {shadows.origin.get(i), shadows.direction.get(i), 0, shadows.t_max.at[i]};
  const Rgb open = visibility(scene_, path, ray, path.media).transmittance;
  return {open.r, open.g, open.b};
}

#ifdef __AVX2__
constexpr bool kHasLanes = true;
#else
constexpr bool kHasLanes = false;
#endif

template <typename Options>
std::unique_ptr<const WaveTracer> make_tracer(const IntegratorInput& input, int width) {
  if constexpr (kHasLanes) {
    if (width > 1) {
      return std::make_unique<LaneTracer<8, Options>>(input);
    }
    return std::make_unique<LaneTracer<1, Options>>(input);
  }
  return nullptr;
}

}  // namespace

bool waves_serve(std::string_view isa) noexcept { return kHasLanes && isa.starts_with("avx"); }

std::unique_ptr<const WaveTracer> make_wave_tracer(const IntegratorInput& input, int width) {
  if (input.settings.integrator != "path" || !has_default_estimators(input.settings) ||
      input.settings.fog || !input.scene.accel->has_packets() ||
      (input.camera != nullptr && input.camera->is_in_solids())) {
    return nullptr;
  }
  return DefaultOptions::serves(input) ? make_tracer<DefaultOptions>(input, width)
                                       : make_tracer<WholeOptions>(input, width);
}

}  // namespace core
