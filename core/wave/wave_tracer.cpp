#include "core/wave/wave_tracer.h"

#include <algorithm>
#include <bit>
#include <utility>

#include "core/integrators/path/path_tracer.h"
#include "core/math/frame.h"
#include "core/math/offset_ray.h"
#include "core/samplers/dimensions.h"
#include "core/sampling/mis.h"
#include "core/settings/registry.h"
#include "core/transport/roulette.h"
#include "core/transport/visibility.h"
#include "core/wave/lane_camera.h"
#include "core/wave/lane_environment.h"
#include "core/wave/lane_lights.h"
#include "core/wave/lane_sampler.h"
#include "core/wave/lane_surfaces.h"
#include "core/wave/lone_paths.h"
#include "core/wave/wave_access.h"

namespace core {
namespace {

// The rule that the lanes use.
static_assert(DefaultOptions::mis.type == MisType::kPower && DefaultOptions::mis.exponent == 2);

/// PathTracer<DefaultOptions>, step by step, for the paths of a wave.
template <std::size_t N>
class LaneTracer final : public WaveTracer {
 public:
  explicit LaneTracer(const IntegratorInput& input)
      : scene_(input.scene),
        environment_(input.environment),
        backdrop_(input.settings.background, input.environment),
        max_depth_(input.settings.max_depth),
        split_count_(DefaultOptions(input.settings).split_count),
        share_(1 / static_cast<float>(split_count_)),
        is_sobol_(input.settings.sampler == SamplerType::kSobol),
        scalar_(input),
        lone_(scalar_, split_count_),
        lights_(scene_, scalar_.lights()),
        sky_(input.environment),
        surfaces_(scene_) {}

  std::size_t samples_max() const noexcept override {
    return kWavePaths / static_cast<std::size_t>(split_count_) / 8 * 8;
  }
  void begin(Wave& wave, const WaveStart& start, std::span<const DueSample> due) const override;
  void trace(Wave& wave, std::uint64_t& rays, std::uint64_t& rejected) const noexcept override {
    for (int depth = 0; wave.paths.count > 0 || !wave.waiting.empty(); ++depth) {
      LonePaths::take_back(wave, depth);
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
    rejected += take_in_weights<N>(wave.results, wave.samplers.size());
  }

 private:
  /// The surface vertices of one chunk of lanes.
  struct Vertex {
    MetLanes<N> met;
    Vec3s<N> wo_world;
    Vec3s<N> beta;
    FrameOf<Floats<N>> frame;
    Mask<N> on;
    Floats<N> cone_spread_rad;
    Ints<N> is_sharp;
  };
  using Numbers = PathNumbers<N>;

  void find_hits(Wave& wave, int depth, std::uint64_t& rays) const;
  void find_lights(Wave& wave, int depth, std::uint64_t& rays) const;
  void add_environment(Wave& wave, std::size_t first, unsigned left, int depth) const;
  void add_emission(Wave& wave, std::size_t i, const MetLanes<N>& met, std::size_t lane,
                    int depth) const;
  void go_alone(Wave& wave, std::size_t i, const RawHit& met, int depth, std::uint64_t& rays) const;
  void advance(Wave& wave, std::size_t first, unsigned met, int depth, std::uint64_t& rays) const;
  void extend(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf, const Numbers& numbers,
              int depth) const;
  void add_light_samples(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                         const Numbers& numbers, const Vec4s<N>& u) const;
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
  PathTracer<DefaultOptions> scalar_;
  LonePaths lone_;
  LaneLights lights_;
  LaneEnvironment sky_;
  LaneSurfaces surfaces_;
};

/// Starts camera rays, in SIMD for pinhole cameras and the box filter.
template <std::size_t N>
void LaneTracer<N>::begin(Wave& wave, const WaveStart& start,
                          std::span<const DueSample> due) const {
  WavePaths& paths = wave.paths;
  WaveResults& results = wave.results;
  const LaneCamera camera(start.camera, start.filter);
  wave.samplers.assign(due.size(), start.sampler);
  wave.waiting.reserve(kWavePaths);
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
template <std::size_t N>
void LaneTracer<N>::find_hits(Wave& wave, int depth, std::uint64_t& rays) const {
  WavePaths& paths = wave.paths;
  rays += paths.count;
  const bool has_sky = environment_ != nullptr || (depth == 0 && !backdrop_.is_environment());
  RayPacket packet;
  std::fill_n(packet.t_max, 8, Ray{}.t_max);
  const std::size_t end = paths.first + paths.count;
  for (std::size_t first = paths.first; first < end; first += 8) {
    const unsigned active = lanes_below(end - first);
    fill(packet, paths.origin, paths.direction, first);
    if (depth == 0) {  // camera paths are in the order of their slots
      std::copy_n(wave.results.t_max.at + (first - paths.first), 8, packet.t_max);
    }
    HitPacket hits;
    const unsigned met = scene_.accel->intersect8(packet, active, hits);
    std::copy_n(hits.instance, 8, wave.hits.instance.at + first);
    std::copy_n(hits.geometry, 8, wave.hits.geometry.at + first);
    std::copy_n(hits.primitive, 8, wave.hits.primitive.at + first);
    wave.hits.is_hit.at[first / 8] = met;
    for (std::size_t k = 0; k < 8 && has_sky; k += N) {
      const unsigned left = (active & ~met) >> k & ((1U << N) - 1);
      if (left != 0) {
        add_environment(wave, first + k, left, depth);
      }
    }
  }
}

/// Ends paths [first, first + N) of `left`, which have left the scene.
template <std::size_t N>
void LaneTracer<N>::add_environment(Wave& wave, std::size_t first, unsigned left, int depth) const {
  const WavePaths& paths = wave.paths;
  if (depth == 0 && !backdrop_.is_environment()) {
    for (; left != 0; left &= left - 1) {
      const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(left));
      const std::optional<Rgb> seen = backdrop_.seen(paths.direction.get(i));
      const Rgb value = seen.value_or(Rgb{});
      const std::size_t slot = slot_of(paths, i);
      wave.results.alpha.at[slot] = seen ? 1.0F : 0.0F;
      add_radiance(wave.results, slot, {value.r, value.g, value.b});
    }
    return;
  }
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
    radiance =
        select(spread, (sky_.radiance(at) + sun) * power_heuristic(pdf_bsdf, pdf_light), radiance);
  }
  radiance = radiance * load<N>(paths.beta, first) * Floats<N>(share(depth));
  for (; left != 0; left &= left - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(left));
    add_radiance(wave.results, slot_of(paths, first + k), radiance.lane(k));
  }
}

template <std::size_t N>
void LaneTracer<N>::add_emission(Wave& wave, std::size_t i, const MetLanes<N>& met,
                                 std::size_t lane, int depth) const {
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
        pdf_bsdf,
        scalar_.lights().pdf_triangle(light, last, paths.last_normal.get(i), length(d), cos_light));
  }
  add_radiance(wave.results, slot_of(paths, i),
               paths.beta.get(i) * met.emitted.lane(lane) * (weight * share(depth)));
}

/// Hands a path to the scalar tracer, which continues it from its hit.
template <std::size_t N>
void LaneTracer<N>::go_alone(Wave& wave, std::size_t i, const RawHit& met, int depth,
                             std::uint64_t& rays) const {
  const WavePaths& paths = wave.paths;
  const std::size_t slot = slot_of(paths, i);
  TracedPath path = LonePaths::handed_over(paths.get(i), sampler_of(wave, paths.slot.at[i]), rays);
  if (depth == 0) {
    path.ray.t_max = wave.results.t_max.at[slot];
  }
  path.depth = depth;
  path.met = &met;
  path.is_clear = depth == 0;
  path.out.hit = depth > 0;
  lone_.follow(wave, path, paths.slot.at[i]);
  const Rgb found = path.out.radiance * share(depth);
  add_radiance(wave.results, slot, {found.r, found.g, found.b});
  if (depth == 0) {
    const Rgb albedo = path.out.albedo;
    wave.results.alpha.at[slot] = path.out.alpha;
    wave.results.hit.at[slot] = path.out.hit ? 1 : 0;
    wave.results.albedo.set(slot, {albedo.r, albedo.g, albedo.b});
    wave.results.normal.set(slot, path.out.normal_world);
    wave.results.depth_m.at[slot] = path.out.depth_m;
  }
}

template <std::size_t N>
Vec4s<N> LaneTracer<N>::draw(const Wave& wave, const Numbers& numbers, unsigned on, int group,
                             Drawn drawn) const {
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
template <std::size_t N>
void LaneTracer<N>::advance(Wave& wave, std::size_t first, unsigned met, int depth,
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
  surfaces_.meet(segments, hits, met, at.met);
  for (unsigned rest = at.met.foreign; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    go_alone(wave, first + k, hits[k], depth, rays);
  }
  const unsigned on = met & ~at.met.foreign;
  if (on == 0) {
    return;
  }
  at.on = Mask<N>::of(on);
  for (unsigned lit = (at.on & is_not_black(at.met.emitted)).bits(); lit != 0; lit &= lit - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(lit));
    add_emission(wave, first + k, at.met, k, depth);
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
  const BsdfLanes<N> bsdf(s, at.frame.to_local(at.wo_world), at.frame.to_local(s.horizon));
  if (depth == 0) {
    keep_first_surface<N>(wave.results, slot_of(paths, first), at.on,
                          {bsdf.albedo(), s.normal, at.met.distance_m});
    if (max_depth_ == 0) {
      return;
    }
  }
  const Numbers numbers = Numbers::load(paths, first);
  if (depth > 0 || split_count_ == 1) {
    extend(wave, at, bsdf, numbers, depth);
    return;
  }
  for (int k = 0; k < split_count_; ++k) {
    extend(wave, at, bsdf, numbers.branch(k, split_count_), depth);
  }
}

/// Samples a light and the next direction. Continuing paths are compacted to the front of the
/// arrays, at or before this chunk, whose entries have all been read.
template <std::size_t N>
void LaneTracer<N>::extend(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                           const Numbers& numbers, int depth) const {
  const SurfaceLanes<N>& s = at.met.surface;
  const unsigned on = at.on.bits();
  const Vec4s<N> u_light = draw(wave, numbers, on, dimension_group(depth, BounceGroup::kLight));
  add_light_samples(wave, at, bsdf, numbers, u_light);

  const Vec4s<N> u = draw(wave, numbers, on, dimension_group(depth, BounceGroup::kBsdf),
                          bsdf.has_one_lobe() ? Drawn::kPair : Drawn::kAll);
  const auto sample = bsdf.sample(u.x, {u.y, u.z});
  Mask<N> alive = at.on & is_not_black(sample.weight);
  const Vec3s<N> wi = at.frame.to_world(sample.wi);
  const Mask<N> through = dot(wi, s.horizon) < Floats<N>(0);
  Vec3s<N> beta = at.beta * sample.weight;
  const Floats<N> survive = continuation_probability(
      max_component(Vec3s<N>(abs(beta.x), abs(beta.y), abs(beta.z))), sample.pdf_solid_angle);
  const Mask<N> faint = survive < Floats<N>(1);
  alive = alive & ~(faint & (u_light.w >= survive));
  beta = select(faint, beta * (Floats<N>(1) / survive), beta);
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

/// Samples lights and computes their weights; the shadow rays are traced after all chunks are done.
template <std::size_t N>
void LaneTracer<N>::add_light_samples(Wave& wave, const Vertex& at, const BsdfLanes<N>& bsdf,
                                      const Numbers& numbers, const Vec4s<N>& u) const {
  const Mask<N> asked = at.on & bsdf.has_spread();
  if (scalar_.lights().empty() || !asked.any()) {
    return;
  }
  const Floats<N> zero(0);
  const SurfaceLanes<N>& s = at.met.surface;
  const LightLanes<N> light = lights_.sample(asked, s.origin, s.horizon, u.x, {u.y, u.z});
  const Mask<N> lit = asked & (light.pdf_solid_angle > zero) & is_not_black(light.radiance);
  if (!lit.any()) {
    return;
  }
  const auto f = bsdf.evaluate(at.frame.to_local(light.wi_world));
  const unsigned taken = (lit & is_not_black(f.value_cos)).bits();
  if (taken == 0) {
    return;
  }
  const Floats<N> weight = select(light.is_delta, Floats<N>(1),
                                  power_heuristic(light.pdf_solid_angle, f.pdf_solid_angle));
  const Vec3s<N> value =
      at.beta * f.value_cos * light.radiance * (weight / light.pdf_solid_angle * Floats<N>(share_));
  const Mask<N> above = dot(s.horizon, light.wi_world) >= zero;
  const Vec3s<N> origin =
      offset_ray(s.origin, select(above, s.normal_geometric, -s.normal_geometric), s.error_m);
  WaveShadows& to = wave.shadows;
  compress(to.origin, to.count, origin, taken);
  compress(to.direction, to.count, select(light.is_far, light.wi_world, light.target - origin),
           taken);
  compress(to.t_max.at + to.count, select(light.is_far, Floats<N>(kFar), Floats<N>(1)), taken);
  compress(to.value, to.count, value, taken);
  compress(to.cone_width_m.at + to.count, at.met.cone_width_m, taken);
  compress(to.is_sharp.at + to.count, at.is_sharp, taken);
  compress(to.slot.at + to.count, numbers.slot, taken);
  to.count += static_cast<std::size_t>(std::popcount(taken));
}

/// Traces the pending shadow rays; one by one where a surface may transmit light.
template <std::size_t N>
void LaneTracer<N>::find_lights(Wave& wave, int depth, std::uint64_t& rays) const {
  WaveShadows& shadows = wave.shadows;
  const bool all_block = !scene_.has_alpha && !scene_.has_clear && !scene_.has_shared_space;
  RayPacket packet;
  for (std::size_t first = 0; first < shadows.count && all_block; first += 8) {
    const unsigned active = lanes_below(shadows.count - first);
    fill(packet, shadows.origin, shadows.direction, first);
    std::copy_n(shadows.t_max.at + first, 8, packet.t_max);
    rays += static_cast<std::uint64_t>(std::popcount(active));
    unsigned open = active & ~scene_.accel->occluded8(packet, active);
    for (; open != 0; open &= open - 1) {
      const std::size_t i = first + static_cast<std::size_t>(std::countr_zero(open));
      add_radiance(wave.results, slot_of(shadows.slot.at[i]), shadows.value.get(i));
    }
  }
  for (std::size_t i = 0; i < shadows.count && !all_block; ++i) {
    PathState path{.sampler = sampler_of(wave, shadows.slot.at[i]), .rays = rays};
    path.depth = depth;
    path.cone_width_m = shadows.cone_width_m.at[i];
    path.is_sharp = shadows.is_sharp.at[i] != 0;
    const Ray ray = {shadows.origin.get(i), shadows.direction.get(i), 0, shadows.t_max.at[i]};
    const Rgb open = visibility(scene_, path, ray, path.media).transmittance;
    add_radiance(wave.results, slot_of(shadows.slot.at[i]),
                 shadows.value.get(i) * Vec3{open.r, open.g, open.b});
  }
  shadows.count = 0;
}

#ifdef __AVX2__
constexpr bool kHasLanes = true;
#else
constexpr bool kHasLanes = false;
#endif

template <bool kServes>
std::unique_ptr<const WaveTracer> make_tracer(const IntegratorInput& input, int width) {
  if constexpr (kServes) {
    if (width > 1) {
      return std::make_unique<LaneTracer<8>>(input);
    }
    return std::make_unique<LaneTracer<1>>(input);
  }
  return nullptr;
}

}  // namespace

bool waves_serve(std::string_view isa) noexcept { return kHasLanes && isa.starts_with("avx"); }

std::unique_ptr<const WaveTracer> make_wave_tracer(const IntegratorInput& input, int width) {
  if (input.settings.integrator != "path" || has_catcher(input.settings) ||
      !DefaultOptions::serves(input) || !input.scene.accel->has_packets() ||
      (input.camera != nullptr && input.camera->is_in_solids())) {
    return nullptr;
  }
  return make_tracer<kHasLanes>(input, width);
}

}  // namespace core
