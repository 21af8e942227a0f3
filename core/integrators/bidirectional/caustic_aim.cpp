#include "core/integrators/bidirectional/caustic_aim.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <span>

#include "core/integrators/bidirectional/bdpt_vertex.h"
#include "core/integrators/maps/photon_map.h"
#include "core/math/bounds.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/streams.h"
#include "core/transport/intersect.h"
#include "core/transport/light_path.h"
#include "core/transport/scatter.h"
#include "core/transport/surface_event.h"

namespace core {
namespace {

// None of these values is critical. With a share of 3/4 or 7/8, 32 or 128 balls, three rounds, or a
// quarter of the particles, the squared errors without the worst 1% of pixels change by at most a
// third (4 CPU seconds, 128x96; the scenes of tests/bench/caustic_views.h, two on a table of 20 m).

/// Of the light paths, and of the choice of lights; the rest keeps their distribution, so no weight
/// is more than 4 times that of an unaimed path.
constexpr float kAimedShare = 0.5F;
/// A power of two. Each density is a sum over the balls.
constexpr std::size_t kBallsMost = 8;
/// The range of n uniform points is (n - 1) / (n + 1) of theirs: of 8 points 78%.
constexpr std::size_t kPointsLeast = 8;
constexpr int kRounds = 2;
constexpr int kParticles = 1 << 12;  ///< of a round
/// Camera rays are a square of these: as many as a round has particles.
constexpr int kRaySide = 64;

/// A rough surface that the camera sees, directly or by smooth ones.
struct VisiblePoint {
  Vec3 position;
  PackedDirection normal;
};

struct VisiblePoints {
  std::vector<AimPoint> all;  ///< also those of smooth surfaces on the way
  std::vector<VisiblePoint> rough;
  float spacing_m = 0;  ///< mean distance of camera rays there
};

PathSampler pilot_sampler() { return {SamplerType::kSobol, 1, kAimStream}; }

VisiblePoints visible_points(const IntegratorInput& input) {
  VisiblePoints out;
  const FilmSettings& film = input.settings.film;
  PathSampler sampler = pilot_sampler();
  std::uint64_t rays = 0;
  double widths_m = 0;
  const float step_px = std::max(static_cast<float>(film.width), static_cast<float>(film.height)) /
                        static_cast<float>(kRaySide);
  for (int i = 0; i < kRaySide * kRaySide; ++i) {
    const auto at = [](int k, int size) {
      return (static_cast<float>(k) + 0.5F) / kRaySide * static_cast<float>(size);
    };
    const Vec2 film_px = {at(i % kRaySide, film.width), at(i / kRaySide, film.height)};
    sampler.start(i, 0, 0);
    PathState path =
        start_path(input.scene, input.camera->ray(film_px, {0.5F, 0.5F}), sampler, rays);
    PathVertex vertex;
    while (path.scatterings() < input.settings.max_depth &&
           path.null_scatterings <= kNullScatteringMax && reach(input.scene, path, vertex) &&
           !input.scene.materials[vertex.point.material].factors.unlit) {
      surface_event(input.scene, path, vertex);
      const Bsdf bsdf = make_bsdf(vertex.shading, vertex.wo_world);
      out.all.push_back({vertex.point.position, 1});
      if (bsdf.has_spread()) {
        out.rough.push_back(
            {vertex.point.position, PackedDirection(vertex.point.normal_geometric)});
        widths_m += static_cast<double>(path.cone_width_m * step_px);
      }
      if (!scatter_delta(input.scene, path, vertex, bsdf)) {
        break;
      }
    }
  }
  if (!out.rough.empty()) {
    out.spacing_m = static_cast<float>(widths_m / static_cast<double>(out.rough.size()));
  }
  return out;
}

/// Splits at the median of the longest axis.
void add_balls(std::span<AimPoint> points, std::size_t balls, double total, float share,
               std::vector<EmissionTarget>& out) {
  Bounds box;
  for (const AimPoint& point : points) {
    box.add(point.position);
  }
  const Vec3 size = box.diagonal();
  if (balls > 1 && points.size() >= 2 * kPointsLeast) {
    const auto along = [&](const AimPoint& point) {
      return size.x >= std::max(size.y, size.z) ? point.position.x
             : size.y >= size.z                 ? point.position.y
                                                : point.position.z;
    };
    // Stable: the same in every standard library.
    std::stable_sort(points.begin(), points.end(),
                     [&](const AimPoint& a, const AimPoint& b) { return along(a) < along(b); });
    const std::size_t half = points.size() / 2;
    add_balls(points.first(half), balls / 2, total, share, out);
    add_balls(points.subspan(half), balls / 2, total, share, out);
    return;
  }
  double weight = 0;
  float radius_m = 0;
  const Vec3 center = box.center();
  for (const AimPoint& point : points) {
    weight += static_cast<double>(point.weight);
    radius_m = std::max(radius_m, length(point.position - center));
  }
  if (radius_m > 0 && weight > 0) {
    out.push_back({center, radius_m, share * static_cast<float>(weight / total)});
  }
}

}  // namespace

std::vector<EmissionTarget> balls_around(std::vector<AimPoint> points, float share) {
  std::vector<EmissionTarget> out;
  const double total = std::accumulate(
      points.begin(), points.end(), 0.0,
      [](double sum, const AimPoint& point) { return sum + static_cast<double>(point.weight); });
  if (total > 0) {
    add_balls(points, kBallsMost, total, share, out);
  }
  return out;
}

double aim_at_caustics(const IntegratorInput& input, EmissionSampler& emission) {
  VisiblePoints visible = visible_points(input);
  if (visible.rough.empty() || !(visible.spacing_m > 0) || emission.empty()) {
    return 0;
  }
  std::vector<std::vector<VisiblePoint>> parts = {std::move(visible.rough)};
  const PhotonGrid<VisiblePoint> grid(parts, visible.spacing_m);
  const auto is_visible = [&](const PathVertex& vertex) {
    bool found = false;
    grid.each(vertex.point.position, [&](const VisiblePoint& point) {
      found = found || faces_alike(point.normal.unpacked(), vertex.point.normal_geometric);
    });
    return found;
  };
  emission.aim(balls_around(std::move(visible.all), kAimedShare), {});
  std::vector<AimPoint> first;
  std::vector<float> lights(emission.size());
  double caustics = 0;
  double all = 0;  // in the first round
  PathSampler sampler = pilot_sampler();
  std::uint64_t rays = 0;
  for (int i = 0; i < kRounds * kParticles; ++i) {
    sampler.start(0, 1, i);
    PathState path = start_path(sampler, rays);
    AimPoint start;
    const bool is_first_round = i < kParticles;
    const auto visit = [&](const LightVertex& vertex) {
      if (path.bounces() == 0) {
        start.position = vertex.surface.point.position;
      }
      const float light = luminance(vertex.power);
      if (vertex.from_light.bsdf().has_spread() && std::isfinite(light) &&
          is_visible(vertex.surface)) {
        all += is_first_round ? static_cast<double>(light) : 0;
        if (vertex.is_sharp && path.bounces() > 0) {
          start.weight += light;
          lights[vertex.light.light] += light;
        }
      }
      return vertex.is_sharp || is_first_round;
    };
    follow_light_path(input.scene, emission, input.settings.max_depth, path, visit);
    if (start.weight > 0) {
      first.push_back(start);
      caustics += static_cast<double>(start.weight);
    }
    if ((i + 1) % kParticles == 0 && first.size() >= kPointsLeast) {
      emission.aim(balls_around(first, kAimedShare), lights);
    }
  }
  return all > 0 ? caustics / (kRounds * all) : 0;
}

}  // namespace core
