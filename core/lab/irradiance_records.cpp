// Irradiance from records nearby, with the renderer's cache, and their gradients.

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "core/integrators/maps/irradiance_cache.h"
#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum { kDirect, kPlain, kGradients, kShrinking };
enum { kPlace, kApart };

constexpr std::array kEstimators = {
    EstimatorInfo{"direct", "none", "No cache: all rays from the point itself."},
    EstimatorInfo{"records", "biased", "Weights two records on one side, without gradients."},
    EstimatorInfo{"gradients", "biased",
                  "Extrapolates each record by its gradient (Ward and Heckbert 1992); the bias of "
                  "second order remains."},
    EstimatorInfo{"closer", "consistent", "As `records`, with a distance that falls as n^(-1/2)."},
};
constexpr std::array kParameters = {
    ParameterInfo{"place", 0, 3, 0.25, false,
                  "Place of the point; the light is above [-1/2, 1/2]."},
    ParameterInfo{"apart", 0.01, 0.5, 0.1, false,
                  "Distance of the first record; the second is twice as far."},
};
constexpr std::array<std::int64_t, 4> kN = {64, 256, 1024, 4096};
constexpr float kTolerance = 1;

/// Irradiance from an infinitely long strip of radiance 1, 1 wide, at height 1: pi/2 times the
/// difference of the sines of its edges.
double strip(double x) {
  return std::numbers::pi / 2 *
         ((0.5 - x) / std::hypot(1, 0.5 - x) + (0.5 + x) / std::hypot(1, 0.5 + x));
}
double expected(const Setup& setup) { return strip(setup.parameter(kPlace)); }

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (setup.estimator == kDirect ? 1 : 2);
}
std::int64_t rounded(const Setup& /*setup*/, std::int64_t n) {
  return HemisphereGrid(static_cast<int>(n)).size();
}

/// Gathers the light at (x, 0, 0), below the plane at height 1. Returns false if cancelled.
bool gather(Trial& trial, std::int64_t stream, double x, HemisphereLight& light) {
  const HemisphereGrid grid(static_cast<int>(trial.n()));
  std::vector<HemisphereSample> samples;
  for (int i = 0; i < grid.size(); ++i) {
    if (!trial.start_at(stream, i)) {
      return false;
    }
    const Vec4 u = trial.get_4d(0);
    const Vec3 wi = grid.direction(i, {u.x, u.y});
    const double hit = x + double{wi.x} / double{wi.z};
    samples.push_back({Rgb(std::fabs(hit) <= 0.5 ? 1.0F : 0.0F), 1 / wi.z});
  }
  light = gathered(grid, samples);
  return true;
}

double estimate(Trial& trial) {
  const auto x = trial.parameter(kPlace);
  const std::size_t kind = trial.estimator();
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  HemisphereLight light;
  if (kind == kDirect) {
    return gather(trial, 0, x, light) ? double{light.irradiance.r} : 0;
  }
  const double apart = trial.parameter(kApart) *
                       (kind == kShrinking ? std::sqrt(64 / static_cast<double>(trial.n())) : 1);
  IrradianceCache cache(kTolerance);
  std::vector<IrradianceRecord> records;
  for (const double at : {x + apart, x + 2 * apart}) {
    if (!gather(trial, static_cast<std::int64_t>(records.size()), at, light)) {
      return 0;
    }
    records.push_back({.position = {static_cast<float>(at), 0, 0},
                       .normal = {0, 0, 1},
                       .irradiance = light.irradiance,
                       .gradients = kind == kGradients ? light.gradients : IrradianceGradients{},
                       .radius_m = 1});
  }
  cache.insert(records);
  const auto found = cache.find({static_cast<float>(x), 0, 0}, {0, 0, 1}, 0);
  return found ? double{found->r} : std::numeric_limits<double>::quiet_NaN();
}

std::optional<TheorySlope> slope(const Setup& /*setup*/) { return std::nullopt; }

}  // namespace

const Experiment kIrradianceCacheExperiment = {
    .name = "irradiance-cache",
    .title = "Irradiance records and their gradients",
    .summary = "Indirect light changes slowly: compute it at few points and interpolate.",
    .estimates = "Irradiance on a floor under a long strip of light, 1 wide at height 1.",
    .formula =
        "E(x) = Σ wᵢ (Eᵢ + ∇Eᵢ · (x − xᵢ)) / Σ wᵢ,  wᵢ = 1 − |x − xᵢ| / (a Rᵢ);  E = π/2 (sin θ₂ "
        "− sin θ₁)",
    .look_for =
        "Records off to one side give the light of their own places: the bias remains for any "
        "number of rays. Their gradients remove its part of first order, and with it most of the "
        "bias. Half the distance `apart` leaves a quarter of the bias with gradients, half of it "
        "without; `closer` records are consistent. At place = 0, the middle, the gradient is 0 and "
        "does not help.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "gradients",
    .any_sampler = false,
    .n = kN,
    .unit = "rays of a record",
    .n_least = 16,
    .expected = &expected,
    .slope = &slope,
    .evaluations = &evaluations,
    .rounded = &rounded,
    .estimate = &estimate,
};

}  // namespace core::lab
