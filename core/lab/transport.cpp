// The rendering equation at one point of a box, and the path integral between two plates.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "core/lab/experiment_list.h"
#include "core/lab/stage.h"
#include "core/lab/trial.h"
#include "core/sampling/warp.h"

namespace core::lab {
namespace {

namespace equation {

enum { kHemisphere, kArea, kNoEmission, kNoCosine, kNoWallCosine, kNoDistance, kNoVisibility };
enum { kPlate, kAlbedo, kEmission };

constexpr std::array kEstimators = {
    EstimatorInfo{"hemisphere", "none", "Directions uniform over the hemisphere."},
    EstimatorInfo{"area", "none", "Points uniform on the walls and the ceiling, with G and V."},
    EstimatorInfo{"no-emission", "biased", "Deliberately wrong: without the floor's own L_e."},
    EstimatorInfo{"no-cosine", "biased", "Deliberately wrong: without cos at the floor."},
    EstimatorInfo{"no-wall-cosine", "biased", "Deliberately wrong: without cos' at the wall."},
    EstimatorInfo{"no-distance", "biased", "Deliberately wrong: without 1/r^2."},
    EstimatorInfo{"no-visibility", "biased",
                  "Deliberately wrong: without V, so the plate casts no shadow."},
};
constexpr std::array kParameters = {
    ParameterInfo{"plate", 0, 1, 0.5, false, "Side of the black plate at half the height."},
    ParameterInfo{"albedo", 0, 1, 0.5, false, "Albedo of the floor."},
    ParameterInfo{"emission", 0, 10, 0.25, false, "Radiance that the floor emits."},
};

/// A closed room gives the irradiance pi; the plate, at distance 1/2, hides its own share.
double expected(const Setup& setup) {
  const double lit = std::numbers::pi - square_irradiance(2 * setup.parameter(kPlate));
  return setup.parameter(kEmission) + setup.parameter(kAlbedo) / std::numbers::pi * lit;
}

bool is_visible(Vec3 wi, double plate) {
  const double at_half = 0.5 / double{wi.z};
  return double{std::max(std::fabs(wi.x), std::fabs(wi.y))} * at_half > plate / 2;
}

/// A point on the four walls and the ceiling, whose area is 5.
struct Wall {
  Vec3 point;
  int axis = 2;  ///< of its normal
};
Wall sample_wall(Vec4 u) {
  const int face = std::min(static_cast<int>(u.x * 5), 4);
  const float side = face % 2 == 0 ? -0.5F : 0.5F;
  if (face == 4) {
    return {{u.y - 0.5F, u.z - 0.5F, 1}, 2};
  }
  return face < 2 ? Wall{{side, u.y - 0.5F, u.z}, 0} : Wall{{u.y - 0.5F, side, u.z}, 1};
}

double estimate(Trial& trial) {
  const double plate = trial.parameter(kPlate);
  const std::size_t kind = trial.estimator();
  const double emitted = kind == kNoEmission ? 0 : trial.parameter(kEmission);
  const double f = trial.parameter(kAlbedo) / std::numbers::pi;
  return mean_of(trial, [&]() -> double {
    const Vec4 u = trial.get_4d(0);
    if (kind == kHemisphere) {
      const Vec3 wi = uniform_hemisphere({u.x, u.y});
      return emitted + (is_visible(wi, plate) ? f * double{wi.z} * 2 * std::numbers::pi : 0);
    }
    const Wall wall = sample_wall(u);
    const double r2 = dot(wall.point, wall.point);
    const Vec3 wi = normalize(wall.point);
    const double cosine = kind == kNoCosine ? 1 : double{wi.z};
    const double at_wall = kind == kNoWallCosine ? 1 : double{std::fabs(wi[wall.axis])};
    const double g = cosine * at_wall / (kind == kNoDistance ? 1 : r2);
    return emitted + (kind == kNoVisibility || is_visible(wi, plate) ? 5 * f * g : 0);
  });
}

}  // namespace equation

namespace plates {

enum { kS0T3, kS1T2, kS2T1, kS3T0, kAll, kUnweighted };
enum { kAlbedo };

constexpr int kStrategies = 4;
constexpr std::array kEstimators = {
    EstimatorInfo{"s0-t3", "none", "All from the sensor; hits the light by chance."},
    EstimatorInfo{"s1-t2", "none",
                  "Two vertices from the sensor, connected to a point of the light."},
    EstimatorInfo{"s2-t1", "none",
                  "Two vertices from the light, connected to a point of the sensor."},
    EstimatorInfo{"s3-t0", "none", "All from the light; hits the sensor by chance."},
    EstimatorInfo{"all", "none", "One path of each strategy, weighted by the balance heuristic."},
    EstimatorInfo{"unweighted", "biased",
                  "Deliberately wrong: the sum of all strategies without weights counts every path "
                  "four times."},
};
constexpr std::array kParameters = {
    ParameterInfo{"albedo", 0.05, 1, 0.8, false, "Albedo of the upper plate."},
};

/// Two parallel plates [0,1] at distance 1 in a flat world: cos cos' / (2 r) = 1 / (2 r^3).
double kernel(double x, double y) {
  const double r2 = 1 + (x - y) * (x - y);
  return 1 / (2 * r2 * std::sqrt(r2));
}

/// Albedo times the integral over b of the squared form factor from b to the lower plate, by
/// Simpson's rule: 64 intervals are exact to 1e-9.
double expected(const Setup& setup) {
  constexpr int kIntervals = 64;
  double sum = 0;
  for (int i = 0; i <= kIntervals; ++i) {
    const double b = static_cast<double>(i) / kIntervals;
    const double factor = 0.5 * (b / std::hypot(1, b) + (1 - b) / std::hypot(1, 1 - b));
    sum += (i == 0 || i == kIntervals ? 1 : 2 + 2 * (i % 2)) * factor * factor;
  }
  return setup.parameter(kAlbedo) * sum / (3 * kIntervals);
}

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (setup.estimator >= kAll ? kStrategies : 1);
}

/// A path from the sensor at a to b on the upper plate to the light at c.
struct Path {
  double a = 0;
  double b = 0;
  double c = 0;
  bool is_path = false;  ///< no ray has missed its plate
};

/// Leaves x in proportion to the cosine; the density on the other plate is kernel().
double follow(double x, double u) {
  const double sine = 2 * u - 1;
  return x + sine / std::sqrt(std::max(1 - sine * sine, 1e-12));
}
bool is_on_plate(double x) { return x >= 0 && x <= 1; }

Path sample(const Trial& trial, int strategy) {
  const Vec4 u = trial.get_4d(strategy);
  Path p;
  // Strategies from the light are those from the sensor with both ends exchanged.
  p.a = u.x;
  p.b = follow(p.a, double{u.y});
  const bool connects = strategy == kS1T2 || strategy == kS2T1;
  p.c = connects ? double{u.z} : follow(p.b, double{u.z});
  p.is_path = is_on_plate(p.b) && is_on_plate(p.c);
  if (strategy == kS2T1 || strategy == kS3T0) {
    std::swap(p.a, p.c);
  }
  return p;
}

double density(const Path& p, int strategy) {
  switch (strategy) {
    case kS1T2:
      return kernel(p.a, p.b);
    case kS2T1:
      return kernel(p.c, p.b);
    default:
      return kernel(p.a, p.b) * kernel(p.b, p.c);
  }
}

double weight(const Path& p, int strategy) {
  double sum = 0;
  for (int other = 0; other < kStrategies; ++other) {
    sum += density(p, other);
  }
  return density(p, strategy) / sum;
}

double estimate(Trial& trial) {
  const double albedo = trial.parameter(kAlbedo);
  const auto chosen = static_cast<int>(trial.estimator());
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  return mean_of(trial, [&] {
    double sum = 0;
    for (int k = 0; k < kStrategies; ++k) {
      if (chosen < kAll && chosen != k) {
        continue;
      }
      const Path p = sample(trial, k);
      if (p.is_path) {
        const double f = albedo * kernel(p.a, p.b) * kernel(p.b, p.c);
        sum += (chosen == kAll ? weight(p, k) : 1) * f / density(p, k);
      }
    }
    return sum;
  });
}

/// The weight of a path over the place of its middle vertex; missed paths lie at 0.
Vec4 shown(const Trial& trial) {
  const auto chosen = static_cast<int>(trial.estimator());
  const int strategy =
      chosen < kAll ? chosen : std::min(static_cast<int>(4 * trial.extra_1d(0)), kStrategies - 1);
  const Path p = sample(trial, strategy);
  const double w = p.is_path ? weight(p, strategy) : 0;
  return {static_cast<float>(std::clamp(p.b, 0.0, 1.0)), static_cast<float>(w), 0, 0};
}

}  // namespace plates
}  // namespace

const Experiment kRenderingEquationExperiment = {
    .name = "rendering-equation",
    .title = "The rendering equation, over directions and over surfaces",
    .summary = "One integral in two forms; every factor matters, as the forms without it show.",
    .estimates =
        "Radiance that leaves the centre of the floor of a unit box whose walls and ceiling have "
        "radiance 1, with a black plate half-way up.",
    .formula =
        "L = L_e + ∫ f L cos θ dω = L_e + ∫ f L V G dA,  G = cos θ cos θ′ / r²,  dω = cos θ′ dA / "
        "r²;  without the plate L = L_e + ρ",
    .look_for =
        "Both forms have the same mean. Each of the others omits one factor of the area form, and "
        "its mean is off for every n: the cosine at the floor, the cosine at the wall and 1/r², "
        "which together are the Jacobian of the change from directions to points, and the "
        "visibility V. With plate = 0, V makes no difference.",
    .estimators = equation::kEstimators,
    .parameters = equation::kParameters,
    .estimator = "area",
    .unit = "samples",
    .expected = &equation::expected,
    .estimate = &equation::estimate,
};

const Experiment kPathIntegralExperiment = {
    .name = "path-integral",
    .title = "The path integral and its strategies (s, t)",
    .summary =
        "A path of three vertices can be made from the light, from the sensor, or from both.",
    .estimates =
        "Power from a light that is reflected once by a parallel plate and arrives at a sensor in "
        "the place of the light, in a flat world.",
    .formula =
        "I = ∫∫∫ L_e G(c, b) f G(b, a) W_e da db dc = ρ ∫ F(b)² db;  p_(s,t): s vertices from the "
        "light, t from the sensor;  w_(s,t) = p_(s,t) / Σ p_(s′,t′)",
    .look_for =
        "All four strategies have the same mean; those that connect (`s1-t2`, `s2-t1`) have the "
        "smaller error. `all` weights one path of each, and the weights of every path sum to 1. "
        "Without weights the sum is four times as large. The points next to the form show the "
        "weight of a path over the place of its middle vertex.",
    .estimators = plates::kEstimators,
    .parameters = plates::kParameters,
    .estimator = "all",
    .any_sampler = false,
    .unit = "paths",
    .pattern_dimensions = 2,
    .expected = &plates::expected,
    .evaluations = &plates::evaluations,
    .estimate = &plates::estimate,
    .shown = &plates::shown,
};

}  // namespace core::lab
