// Irradiance caching. Before the first sample, rounds of camera paths on ever finer lattices of
// pixels find points where no record is accurate enough. Each such point gets a record: paths over
// its hemisphere sample the light that does not come directly from lights or the sky. The points of
// a round only query records of earlier rounds, and records are added in the order of their points,
// so threads do not matter. Each replicate has its own cache.
//
// Camera paths then sample direct light and the reflections of glossy and smooth lobes as `path`
// does; diffuse reflection of all other light comes from the records, with the albedo for uniform
// light. Where there are no records, paths continue as in `path`.
#include <algorithm>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <vector>

#include "core/integrators/maps/irradiance_cache.h"
#include "core/integrators/path/path_tracer.h"
#include "core/math/numbers.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/streams.h"
#include "core/transport/roulette.h"
#include "core/transport/scatter.h"

namespace core {
namespace {

/// Distance of points in the first round, in pixels.
constexpr int kFirstStep = 32;
/// Number of points per part.
constexpr int kPartPoints = 256;
/// Limits of a record's radius, in pixels as seen by the camera, at tolerance 1.
constexpr float kReachLeastPx = 2;
constexpr float kReachMostPx = 64;
/// Minimum fraction of the pixel's light that a surface behind a glossy one needs to get records;
/// for fainter ones each record would serve few paths.
constexpr float kShareLeast = 0.5F;

/// Every `step`-th pixel of every `step`-th row.
struct Lattice {
  int x = 0;
  int y = 0;
  int step = 1;
  int columns = 0;
  int rows = 0;

  Lattice(int x0, int y0, int apart, const FilmSettings& film)
      : x(x0),
        y(y0),
        step(apart),
        columns(std::max(0, (film.width - x0 + apart - 1) / apart)),
        rows(std::max(0, (film.height - y0 + apart - 1) / apart)) {}
  int size() const noexcept { return columns * rows; }
};

/// A point without a record: vertex `vertex` of the camera path through a pixel.
struct UncoveredPoint {
  std::uint16_t x = 0;
  std::uint16_t y = 0;
  std::uint16_t replicate = 0;
  std::uint16_t vertex = 0;
};
/// Maximum per camera path.
constexpr int kUncoveredMost = 4;
static_assert(2 * kUncoveredMost * sizeof(UncoveredPoint) <= kRoundPointBytes);

class Records final : public Prepass {
 public:
  explicit Records(const RenderSettings& settings);
  int sample() const noexcept override { return 0; }
  bool serves(int) const noexcept override { return true; }
  int part_count() const noexcept override {
    return is_searching_ ? static_cast<int>(found_.size()) : static_cast<int>(uncovered_.size());
  }
  bool build() override;

  /// A round has two steps: it finds points, then creates their records.
  bool is_searching() const noexcept { return is_searching_; }
  /// Calls visit(point) for the points of a part; point: the first vertex.
  template <typename Visit>
  void each_point(int part, Visit&& visit) const;
  std::vector<UncoveredPoint>& found(int part) { return found_[static_cast<std::size_t>(part)]; }
  const UncoveredPoint& uncovered(int part) const {
    return uncovered_[static_cast<std::size_t>(part)];
  }
  std::optional<IrradianceRecord>& made(int part) { return made_[static_cast<std::size_t>(part)]; }
  const IrradianceCache& cache(int replicate) const {
    return caches_[static_cast<std::size_t>(replicate)];
  }

 private:
  void begin_round();
  void choose();
  void keep();
  bool is_full() const;
  std::size_t room(std::size_t replicate) const {
    return static_cast<std::size_t>(settings_.cache.records) - caches_[replicate].records().size();
  }
  int points() const;

  const RenderSettings& settings_;
  int step_ = kFirstStep;  ///< distance of the points processed so far
  int last_step_ = 1;
  bool has_middles_ = true;  ///< of the squares between these points
  bool is_searching_ = true;
  std::vector<Lattice> lattices_;                   ///< of this round
  std::vector<std::vector<UncoveredPoint>> found_;  ///< by part
  std::vector<UncoveredPoint> uncovered_;
  std::vector<std::optional<IrradianceRecord>> made_;
  std::vector<IrradianceCache> caches_;  ///< by replicate
};

Records::Records(const RenderSettings& settings)
    : settings_(settings),
      caches_(static_cast<std::size_t>(settings.replicates),
              IrradianceCache(settings.cache.tolerance)) {
  const std::int64_t pixels = static_cast<std::int64_t>(settings.film.width) * settings.film.height;
  while (pixels / last_step_ / last_step_ > kRoundPointsMost) {
    last_step_ *= 2;
  }
  lattices_.emplace_back(0, 0, kFirstStep, settings.film);
  begin_round();
}

int Records::points() const {
  int sum = 0;
  for (const Lattice& lattice : lattices_) {
    sum += lattice.size();
  }
  return sum * static_cast<int>(caches_.size());
}

void Records::begin_round() {
  is_searching_ = true;
  found_.assign(static_cast<std::size_t>((points() + kPartPoints - 1) / kPartPoints), {});
}

template <typename Visit>
void Records::each_point(int part, Visit&& visit) const {
  const int end = std::min((part + 1) * kPartPoints, points());
  const auto replicates = static_cast<int>(caches_.size());
  for (int i = part * kPartPoints; i < end; ++i) {
    int point = i / replicates;
    auto lattice = lattices_.begin();
    while (point >= lattice->size()) {
      point -= lattice->size();
      ++lattice;
    }
    visit(UncoveredPoint{
        static_cast<std::uint16_t>(lattice->x + point % lattice->columns * lattice->step),
        static_cast<std::uint16_t>(lattice->y + point / lattice->columns * lattice->step),
        static_cast<std::uint16_t>(i % replicates), 0});
  }
}

/// Selects the points that get records: all of them or, if memory is short, a subset from the whole
/// film.
void Records::choose() {
  std::vector<std::vector<UncoveredPoint>> by_replicate(caches_.size());
  for (const std::vector<UncoveredPoint>& part : found_) {
    for (const UncoveredPoint& point : part) {
      by_replicate[point.replicate].push_back(point);
    }
  }
  uncovered_.clear();
  for (std::size_t r = 0; r < caches_.size(); ++r) {
    const std::vector<UncoveredPoint>& all = by_replicate[r];
    const std::size_t count = std::min(all.size(), room(r));
    for (std::size_t i = 0; i < count; ++i) {
      uncovered_.push_back(all[i * all.size() / count]);
    }
  }
  made_.assign(uncovered_.size(), std::nullopt);
}

void Records::keep() {
  std::vector<std::vector<IrradianceRecord>> by_replicate(caches_.size());
  for (std::size_t i = 0; i < uncovered_.size(); ++i) {
    if (made_[i]) {
      by_replicate[uncovered_[i].replicate].push_back(*made_[i]);
    }
  }
  for (std::size_t r = 0; r < caches_.size(); ++r) {
    caches_[r].insert(by_replicate[r]);
  }
}

bool Records::is_full() const {
  for (std::size_t r = 0; r < caches_.size(); ++r) {
    if (room(r) > 0) {
      return false;
    }
  }
  return true;
}

/// A halving of the step takes two rounds: first the centres of the squares of four earlier points,
/// then those of their sides.
bool Records::build() {
  if (is_searching_) {
    choose();
    is_searching_ = false;
    return false;
  }
  keep();
  if (is_full() || (has_middles_ && step_ <= last_step_)) {
    found_.clear();
    uncovered_.clear();
    made_.clear();
    return true;
  }
  const int half = step_ / 2;
  lattices_.clear();
  if (has_middles_) {
    lattices_.emplace_back(half, half, step_, settings_.film);
  } else {
    lattices_.emplace_back(half, 0, step_, settings_.film);
    lattices_.emplace_back(0, half, step_, settings_.film);
    step_ = half;
  }
  has_middles_ = !has_middles_;
  begin_round();
  return false;
}

class CacheTracer final : public Integrator {
 public:
  explicit CacheTracer(const IntegratorInput& input)
      : scene_(input.scene),
        settings_(input.settings),
        camera_(*input.camera),
        paths_(input),
        grid_(input.settings.cache.rays) {}

  PathSample trace(const Camera::CameraRay&, const PathSampler&,
                   std::uint64_t&) const noexcept override {
    return {};  // the prepass supplies records to samples
  }
  std::unique_ptr<Prepass> start_prepass(int) const override {
    return std::make_unique<Records>(settings_);
  }
  void run_prepass(Prepass& pass, int part, std::uint64_t& rays) const override;
  PathSample gather(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                    const Prepass& pass, std::uint64_t& rays) const noexcept override;

 private:
  bool takes_records(const PathState& path, const Bsdf& bsdf) const noexcept;
  template <typename Visit>
  void follow_to_records(const UncoveredPoint& from, std::uint64_t& rays, Visit&& visit) const;
  IrradianceRecord make_record(const TracedPath& path, const PathVertex& vertex,
                               const UncoveredPoint& point) const;
  HemisphereSample trace_ray(TracedPath& path, const PathVertex& vertex,
                             Vec3 wi_local) const noexcept;

  const SceneData& scene_;
  RenderSettings settings_;
  Camera camera_;
  PathTracer<DefaultOptions> paths_;
  HemisphereGrid grid_;
};

/// Returns whether the diffuse lobe reflects indirect light here.
bool CacheTracer::takes_records(const PathState& path, const Bsdf& bsdf) const noexcept {
  return path.scatterings() + 1 < settings_.max_depth && !is_black(bsdf.diffuse_albedo());
}

Vec3 facing(const PathVertex& vertex) noexcept { return vertex.shading.frame.n; }

/// Returns the fraction of the surface's reflection along the path's new direction that is not due
/// to the diffuse lobe.
Rgb share_of_rest(const PathState& path, const PathVertex& vertex, const Bsdf& bsdf) noexcept {
  if (!(path.last.pdf_bsdf > 0)) {
    return Rgb(1);  // for a smooth lobe
  }
  const Vec3 wi = vertex.shading.frame.to_local(path.ray.direction);
  const Rgb whole = bsdf.evaluate(wi).value_cos;
  const Rgb rest = bsdf.without_diffuse().evaluate(wi).value_cos;
  const auto share = [](float part, float all) { return all > 0 ? part / all : 0.0F; };
  return {share(rest.r, whole.r), share(rest.g, whole.g), share(rest.b, whole.b)};
}

/// Traces the camera path through a pixel and calls visit(path, vertex, number) where it uses
/// records, until that returns false.
template <typename Visit>
void CacheTracer::follow_to_records(const UncoveredPoint& from, std::uint64_t& rays,
                                    Visit&& visit) const {
  PathSampler sampler(SamplerType::kSobol, settings_.replicates, settings_.seed | kCacheStream,
                      settings_.first_replicate);
  sampler.start(from.x, from.y, from.replicate);
  const Vec4 u = sampler.get_4d(kCameraGroup);
  const Camera::CameraRay ray =
      camera_.ray({static_cast<float>(from.x) + u.x, static_cast<float>(from.y) + u.y}, {u.z, u.w});
  TracedPath path{start_path(scene_, ray, sampler, rays)};
  PathVertex vertex;
  int number = 0;
  while (number < kUncoveredMost && paths_.next_vertex(path, vertex)) {
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (!paths_.visit(path, vertex, bsdf)) {
      return;
    }
    const bool is_place = takes_records(path, bsdf);
    if (is_place && !visit(path, vertex, number++)) {
      return;
    }
    const int clear = path.null_scatterings;
    if (!paths_.extend(path, vertex, bsdf)) {
      return;
    }
    if (is_place && path.null_scatterings == clear) {
      path.beta *= share_of_rest(path, vertex, bsdf);
      if (throughput_size(path.beta) < kShareLeast) {
        return;
      }
    }
  }
}

void CacheTracer::run_prepass(Prepass& pass, int part, std::uint64_t& rays) const {
  auto& records = static_cast<Records&>(pass);
  if (records.is_searching()) {
    records.each_point(part, [&](const UncoveredPoint& from) {
      follow_to_records(from, rays, [&](const TracedPath& path, const PathVertex& at, int number) {
        const IrradianceCache& cache = records.cache(from.replicate);
        if (!cache.covers(at.point.position, facing(at), path.scatterings())) {
          UncoveredPoint point = from;
          point.vertex = static_cast<std::uint16_t>(number);
          records.found(part).push_back(point);
        }
        return true;
      });
    });
    return;
  }
  const UncoveredPoint& point = records.uncovered(part);
  follow_to_records(point, rays, [&](const TracedPath& path, const PathVertex& at, int number) {
    if (number == point.vertex) {
      records.made(part) = make_record(path, at, point);
    }
    return number < point.vertex;
  });
}

IrradianceRecord CacheTracer::make_record(const TracedPath& path, const PathVertex& vertex,
                                          const UncoveredPoint& point) const {
  const Frame& frame = vertex.shading.frame;
  const float pixel_m = std::max(path.cone_width_m, 1e-6F * scene_.radius_m);
  const float least_m = kReachLeastPx * pixel_m / settings_.cache.tolerance;
  // Separate random numbers: rows below the film.
  PathSampler sampler(SamplerType::kSobol, settings_.replicates, settings_.seed | kCacheStream,
                      settings_.first_replicate);
  std::vector<HemisphereSample> samples(static_cast<std::size_t>(grid_.size()));
  for (int i = 0; i < grid_.size(); ++i) {
    sampler.start(point.x, settings_.film.height + point.y,
                  i * settings_.replicates + point.replicate);
    TracedPath branch = path;
    branch.sampler = sampler;
    const Vec4 u = sampler.get_4d(dimension_group(path.depth, BounceGroup::kBsdf));
    HemisphereSample& sample = samples[static_cast<std::size_t>(i)];
    sample = trace_ray(branch, vertex, grid_.direction(i, {u.y, u.z}));
    // Detail finer than a record's minimum radius is not resolved.
    sample.distance_m = std::max(sample.distance_m, least_m);
  }
  const HemisphereLight light = gathered(grid_, samples);
  IrradianceRecord record = {vertex.point.position, facing(vertex),    light.irradiance, {},
                             light.mean_distance_m, path.scatterings()};
  for (std::size_t c = 0; c < 3; ++c) {
    record.gradients.by_turn[c] = frame.to_world(light.gradients.by_turn[c]);
    record.gradients.by_move[c] = frame.to_world(light.gradients.by_move[c]);
  }
  limit_radius(record, least_m, kReachMostPx * pixel_m / settings_.cache.tolerance);
  return record;
}

/// Returns the radiance along one direction, without emission of lights and sky seen directly.
HemisphereSample CacheTracer::trace_ray(TracedPath& path, const PathVertex& vertex,
                                        Vec3 wi_local) const noexcept {
  HemisphereSample out{{}, std::numeric_limits<float>::infinity()};
  BsdfSample sample;
  sample.wi_local = wi_local;
  // Mirrors directions below the horizon, as the BSDF does.
  const Vec3 horizon = vertex.shading.frame.to_local(vertex.shading.horizon);
  const float side = dot(wi_local, horizon);
  if (side < 0) {
    sample.wi_local = wi_local - horizon * (2 * side);
  }
  sample.weight = Rgb(1);
  sample.pdf_solid_angle = wi_local.z * kInvPi;
  path.beta = Rgb(1);
  path.eta_scale = 1;
  path.wavelength_nm = 0;
  path.out = {};
  path.out.hit = true;  // no first surface to record
  scatter(scene_, path, vertex, sample, 1);
  const int before = path.scatterings();
  PathVertex next;
  while (paths_.next_vertex(path, next)) {
    if (!(out.distance_m < std::numeric_limits<float>::infinity())) {
      out.distance_m = next.distance_m;
    }
    const Bsdf bsdf = make_bsdf(next.shading, next.wo_world);
    const bool goes_on = paths_.visit(path, next, bsdf);
    path.out.radiance = {};
    if (!goes_on) {
      return out;
    }
    if (!paths_.is_at_max_depth(path)) {
      paths_.add_direct_light(path, next, bsdf);
    }
    out.radiance += path.out.radiance;
    path.out.radiance = {};
    if (!paths_.extend(path, next, bsdf)) {
      return out;
    }
    if (path.scatterings() > before) {
      paths_.follow(path);
      out.radiance += path.out.radiance;
      return out;
    }
  }
  return out;
}

PathSample CacheTracer::gather(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                               const Prepass& pass, std::uint64_t& rays) const noexcept {
  const IrradianceCache& cache =
      static_cast<const Records&>(pass).cache(sampler.replicate() - settings_.first_replicate);
  TracedPath path{start_path(scene_, camera_ray, sampler, rays)};
  // Beyond surfaces passed without deflection, the path finds direct light of the previous vertex,
  // which counts fully, and other light, part of which is in the records.
  Rgb pending(1);
  PathVertex vertex;
  while (paths_.next_vertex(path, vertex)) {
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    if (!paths_.visit(path, vertex, bsdf)) {
      break;
    }
    const Rgb whole = path.beta;
    path.beta = whole * pending;
    if (is_black(path.beta) && is_black(bsdf.null_transmittance())) {
      break;
    }
    std::optional<Rgb> found;
    if (!paths_.is_at_max_depth(path)) {
      paths_.add_direct_light(path, vertex, bsdf);
      if (takes_records(path, bsdf)) {
        found = cache.find(vertex.point.position, facing(vertex), path.scatterings());
        path.out.radiance += path.beta * bsdf.diffuse_albedo() * found.value_or(Rgb{}) * kInvPi;
      }
    }
    path.beta = whole;
    const int clear = path.null_scatterings;
    const bool is_lost = takes_records(path, bsdf) && !found;
    if (!paths_.extend(path, vertex, bsdf)) {
      break;
    }
    if (path.null_scatterings > clear) {
      continue;
    }
    path.beta *= pending;
    if (is_lost) {
      paths_.follow(path);
      break;
    }
    pending = found ? share_of_rest(path, vertex, bsdf) : Rgb(1);
  }
  return path.out;
}

}  // namespace

std::unique_ptr<const Integrator> make_irradiance_cache(const IntegratorInput& input) {
  return std::make_unique<CacheTracer>(input);
}

}  // namespace core
