#include "core/integrators/census.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <optional>

#include "core/integrators/maps/photon_map.h"
#include "core/math/numbers.h"
#include "core/samplers/dimensions.h"
#include "core/settings/choices.h"
#include "core/transport/intersect.h"
#include "core/transport/roulette.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

/// Independent parts of the stream.
enum Part { kParticles, kPoints, kStarts };

PathSampler sampler_of(const RenderSettings& settings, std::uint64_t stream, Part part) {
  return {SamplerType::kIndependent, 1, settings.seed | stream, part};
}

/// Paths from the lights that are sampled for the largest weight: with 95% confidence at most
/// -log(0.05) / 4096 of the particles, 0.07%, are heavier. These count more than once.
constexpr int kStartCount = 4096;
/// The width of the cone in which one of 4096 particles leaves a point light, 4 / sqrt(4096): so
/// few tell nothing of finer texels, and large textures need not be in memory for them.
constexpr float kConeSpread = 0.0625F;

/// Camera rays. Each takes as much as 1.5 samples (callgrind on cornell-box): together 5% of one
/// sample of each of two million pixels.
constexpr double kRaysMost = 1 << 16;
/// Disks no smaller than the reach of the film's filter, 1.5 pixels.
constexpr int kSpacingLeast = 2;

/// Cells of a level are at least as wide as its disks: these overlap at most two on each axis.
double cell_width(int level) { return std::ldexp(4.0, level); }

std::int64_t cell_of(double at, int level) {
  return static_cast<std::int64_t>(std::floor(at / cell_width(level)));
}

/// Hits of a running sum of light in units: u in [0,1) turns fractions into probabilities.
std::uint32_t hits_between(double before, double after, float u) {
  return static_cast<std::uint32_t>(std::floor(after + static_cast<double>(u)) -
                                    std::floor(before + static_cast<double>(u)));
}

}  // namespace

/// A particle under way.
struct LightCensus::Particle {
  bool is_held = false;
  float u_tile = 0;
  float u_picture = 0;
  bool is_caustic = false;  ///< it left the light through or off sharp surfaces
  bool is_rough = false;    ///< one of them was not smooth
  std::uint32_t first_material = 0;
  double in_picture = 0;                      ///< light so far, in units
  std::vector<std::pair<int, double>> tiles;  ///< tile and light so far, in units
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint64_t> sources;
};

LightCensus::LightCensus(const IntegratorInput& input, std::span<const PixelRect> tiles,
                         std::uint64_t stream)
    : scene_(input.scene),
      settings_(input.settings),
      stream_(stream),
      emission_(input.scene, input.environment),
      units_(tiles.size()),
      counts_(tiles.size() * LightRoute::kCount * 3) {
  find_points(input, tiles);
  build_grid();
  set_units();
}

void LightCensus::find_points(const IntegratorInput& input, std::span<const PixelRect> tiles) {
  double area = 0;
  for (const PixelRect& tile : tiles) {
    area += static_cast<double>(tile.width) * tile.height;
  }
  spacing_px_ = std::max(kSpacingLeast, static_cast<int>(std::ceil(std::sqrt(area / kRaysMost))));
  PathSampler sampler = sampler_of(settings_, stream_, kPoints);
  std::uint64_t rays = 0;
  for (std::size_t t = 0; t < tiles.size(); ++t) {
    const PixelRect& tile = tiles[t];
    const double pixels = static_cast<double>(tile.width) * tile.height;
    for (int y = tile.y; y < tile.y + tile.height; y += spacing_px_) {
      for (int x = tile.x; x < tile.x + tile.width; x += spacing_px_) {
        const int width = std::min(spacing_px_, tile.x + tile.width - x);
        const int height = std::min(spacing_px_, tile.y + tile.height - y);
        sampler.start(x, y, 0);
        const Vec4 u = sampler.get_4d(kCameraGroup);
        const Vec2 film_px = {static_cast<float>(x) + u.x * static_cast<float>(width),
                              static_cast<float>(y) + u.y * static_cast<float>(height)};
        PathState path = start_path(scene_, input.camera->ray(film_px, {u.z, u.w}), sampler, rays);
        Point blank;
        blank.tile = static_cast<int>(t);
        blank.share = static_cast<float>(pixels / area);
        blank.factor = Rgb(static_cast<float>(width * height / pixels));
        follow_camera_path(path, blank);
      }
    }
  }
}

/// Adds a point at each surface on the way that is diffuse, or rough enough to look so.
void LightCensus::follow_camera_path(PathState& path, const Point& blank) {
  PathVertex vertex;
  while (path.scatterings() < settings_.max_depth && path.null_scatterings <= kNullScatteringMax &&
         reach(scene_, path, vertex)) {
    if (scene_.materials[vertex.point.material].factors.unlit) {
      return;
    }
    surface_event(scene_, path, vertex);
    const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
    const Rgb albedo = bsdf.is_diffuse_like() ? bsdf.albedo() : bsdf.diffuse_albedo();
    const float radius_m = static_cast<float>(spacing_px_) * path.cone_width_m;
    const bool is_catcher = has_catcher(settings_) && vertex.point.placed == scene_.ground;
    if (bsdf.has_spread() && !is_black(albedo) && radius_m > 0 && !is_catcher) {
      Point point = blank;
      point.position = vertex.point.position;
      point.normal = vertex.shading.normal_geometric;
      point.factor *= path.beta * albedo * (kInvPi * kInvPi / square(radius_m));
      point.radius_m = radius_m;
      point.level = std::ilogb(radius_m);
      point.scatterings = path.scatterings();
      if (is_finite(point.factor)) {
        points_.push_back(point);
      }
    }
    if (!scatter_delta(scene_, path, vertex, bsdf)) {
      return;
    }
  }
}

std::uint32_t LightCensus::bucket(const Point& at,
                                  std::array<std::int64_t, 3> cell) const noexcept {
  // As in PhotonMap.
  std::uint64_t h = static_cast<std::uint64_t>(cell[0]) * 0x9e3779b97f4a7c15ULL;
  h ^= static_cast<std::uint64_t>(cell[1]) * 0xc2b2ae3d27d4eb4fULL;
  h ^= static_cast<std::uint64_t>(cell[2]) * 0x165667b19e3779f9ULL;
  h ^= static_cast<std::uint64_t>(static_cast<std::uint32_t>(at.level)) * 0xd6e8feb86659fd93ULL;
  h ^= h >> 32U;
  return static_cast<std::uint32_t>(h) & static_cast<std::uint32_t>(first_.size() - 2);
}

void LightCensus::build_grid() {
  first_.assign(std::bit_ceil(std::max<std::size_t>(8 * points_.size(), 16)) + 1, 0);
  const auto each_bucket = [this](const Point& p, auto&& visit) {
    std::array<std::uint32_t, 8> seen{};
    std::size_t count = 0;
    for (unsigned corner = 0; corner < 8; ++corner) {
      const auto along = [&](float at, unsigned bit) {
        const double side = (corner & bit) != 0 ? 1 : -1;
        return cell_of(static_cast<double>(at) + side * static_cast<double>(p.radius_m), p.level);
      };
      const std::uint32_t b =
          bucket(p, {along(p.position.x, 1), along(p.position.y, 2), along(p.position.z, 4)});
      if (std::find(seen.begin(), seen.begin() + count, b) == seen.begin() + count) {
        seen[count++] = b;
        visit(b);
      }
    }
  };
  for (const Point& point : points_) {
    each_bucket(point, [this](std::uint32_t b) { ++first_[b]; });
    if (std::find(levels_.begin(), levels_.end(), point.level) == levels_.end()) {
      levels_.push_back(point.level);
    }
  }
  std::uint32_t sum = 0;
  for (std::uint32_t& first : first_) {
    sum += first;
    first = sum;
  }
  entries_.resize(sum);
  for (std::size_t i = points_.size(); i-- > 0;) {
    each_bucket(points_[i],
                [&](std::uint32_t b) { entries_[--first_[b]] = static_cast<std::uint32_t>(i); });
  }
}

/// Visits the points within whose disks the position lies, on surfaces that face alike.
template <typename Visit>
void LightCensus::each_near(Vec3 position, Vec3 normal, Visit&& visit) const {
  for (const int level : levels_) {
    Point at;
    at.level = level;
    const auto along = [level](float v) { return cell_of(static_cast<double>(v), level); };
    const std::uint32_t b = bucket(at, {along(position.x), along(position.y), along(position.z)});
    for (std::uint32_t i = first_[b]; i < first_[b + 1]; ++i) {
      const Point& point = points_[entries_[i]];
      const Vec3 d = point.position - position;
      // Buckets may hold other levels, and the same point once for each.
      if (point.level == level && dot(d, d) <= square(point.radius_m) &&
          faces_alike(point.normal, normal)) {
        visit(point);
      }
    }
  }
}

void LightCensus::set_units() {
  std::uint64_t rays = 0;
  PathSampler sampler = sampler_of(settings_, stream_, kStarts);
  float heaviest = 0;
  for (int i = 0; i < kStartCount && !emission_.empty(); ++i) {
    sampler.start(0, 0, i);
    PathState path = start_path(sampler, rays);
    start_light_path(scene_, path, emission_);
    heaviest = std::max(heaviest, throughput_size(path.beta));
  }
  for (const Point& at : points_) {
    double in_tile = 0;
    double in_picture = 0;
    each_near(at.position, at.normal, [&](const Point& point) {
      const double light = static_cast<double>(luminance(point.factor) * heaviest);
      in_tile += point.tile == at.tile ? light : 0;
      in_picture += light * static_cast<double>(point.share);
    });
    double& unit = units_[static_cast<std::size_t>(at.tile)];
    unit = std::max(unit, in_tile);
    picture_unit_ = std::max(picture_unit_, in_picture);
  }
}

std::uint64_t LightCensus::trace(int first, int last) {
  std::uint64_t rays = 0;
  if (!(picture_unit_ > 0)) {
    return rays;
  }
  PathSampler sampler = sampler_of(settings_, stream_, kParticles);
  Particle particle;
  for (int i = first; i < last; ++i) {
    sampler.start(0, 0, i);
    PathState path = start_path(sampler, rays);
    path.cone_spread_rad = kConeSpread;
    particle.is_held = i % 2 != 0;
    particle.u_tile = path.sampler.get_4d(kStartGroup).w;
    particle.u_picture = path.sampler.get_4d(kAimGroup).z;
    particle.is_caustic = false;
    particle.in_picture = 0;
    particle.tiles.clear();
    follow_light_path(scene_, emission_, settings_.max_depth, path,
                      [&](const LightVertex& vertex) { arrive(path, vertex, particle); });
  }
  MutexLock lock(mutex_);
  for (const auto& [source, hits] : particle.sources) {
    sources_[source] += hits;
  }
  return rays;
}

void LightCensus::arrive(const PathState& path, const LightVertex& vertex, Particle& particle) {
  const PathVertex& surface = vertex.surface;
  if (path.scatterings() == 0) {
    particle.first_material = surface.point.material;
  }
  if (vertex.is_sharp) {
    particle.is_caustic = path.scatterings() > 0;
    particle.is_rough = !vertex.is_smooth;
  }
  if (!vertex.from_light.bsdf().has_spread() || !is_finite(vertex.power)) {
    return;
  }
  LightRoute route;
  route.kind = vertex.is_sharp ? (particle.is_caustic ? LightRoute::kCaustic : LightRoute::kDirect)
               : particle.is_caustic ? LightRoute::kAfterCaustic
                                     : LightRoute::kIndirect;
  route.is_rough = particle.is_rough;
  route.is_punctual = vertex.light.is_delta_position || vertex.light.is_delta_direction;
  each_near(surface.point.position, surface.shading.normal_geometric, [&](const Point& point) {
    if (point.scatterings + path.scatterings() >= settings_.max_depth ||
        !(dot(point.normal, surface.wo_world) > 0)) {
      return;
    }
    route.is_mirrored = point.scatterings > 0;
    const auto light = static_cast<double>(luminance(point.factor * vertex.power));
    auto tile = std::find_if(particle.tiles.begin(), particle.tiles.end(),
                             [&](const auto& seen) { return seen.first == point.tile; });
    if (tile == particle.tiles.end()) {
      tile = particle.tiles.insert(tile, {point.tile, 0.0});
    }
    const std::size_t at = (static_cast<std::size_t>(point.tile) * LightRoute::kCount +
                            static_cast<std::size_t>(route.index())) *
                           3;
    const double before = tile->second;
    tile->second += light / units_[static_cast<std::size_t>(point.tile)];
    const std::uint32_t hits = hits_between(before, tile->second, particle.u_tile);
    if (hits > 0) {
      counts_[at + (particle.is_held ? 1 : 0)].fetch_add(hits, std::memory_order_relaxed);
      if (route.is_caustic()) {
        particle.sources[{scene_.group_of_light(vertex.light.light), particle.first_material}] +=
            hits;
      }
    }
    if (particle.is_held) {
      const double from = particle.in_picture;
      particle.in_picture += light * static_cast<double>(point.share) / picture_unit_;
      counts_[at + 2].fetch_add(hits_between(from, particle.in_picture, particle.u_picture),
                                std::memory_order_relaxed);
    }
  });
}

CensusHits LightCensus::hits(int tile, LightRoute route) const noexcept {
  const std::size_t at = (static_cast<std::size_t>(tile) * LightRoute::kCount +
                          static_cast<std::size_t>(route.index())) *
                         3;
  return {counts_[at].load(std::memory_order_relaxed),
          counts_[at + 1].load(std::memory_order_relaxed),
          counts_[at + 2].load(std::memory_order_relaxed)};
}

std::optional<LightCensus::Source> LightCensus::caustic_source() const {
  MutexLock lock(mutex_);
  const auto most =
      std::max_element(sources_.begin(), sources_.end(),
                       [](const auto& a, const auto& b) { return a.second < b.second; });
  return most == sources_.end() ? std::nullopt
                                : std::optional(Source{most->first.first, most->first.second});
}

}  // namespace core
