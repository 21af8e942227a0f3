// Optimal MIS weights, fitted to the samples themselves or to the other half.

#include "core/sampling/optimal_mis.h"

#include <array>

#include "core/lab/experiment_list.h"
#include "core/lab/stage.h"
#include "core/lab/trial.h"
#include "core/samplers/dimensions.h"

namespace core::lab {
namespace {

enum { kBalance, kSame, kCross };
enum { kSide, kHidden };

constexpr std::array kEstimators = {
    EstimatorInfo{"balance", "none", "The balance heuristic, for comparison."},
    EstimatorInfo{"same-samples", "consistent",
                  "Coefficients solved from the same samples they are applied to."},
    EstimatorInfo{"cross-fitted", "none",
                  "Coefficients solved from one half of the samples and applied to the other."},
};
constexpr std::array kParameters = {
    side_parameter(4),
    ParameterInfo{"hidden", 0, 0.9, 0.3, false, "Fraction of the light occluded by an edge."},
};

double expected(const Setup& setup) {
  return square_irradiance(setup.parameter(kSide), setup.parameter(kHidden));
}

double evaluations(const Setup& /*setup*/, std::int64_t n) { return 2 * static_cast<double>(n); }
std::int64_t rounded(const Setup& /*setup*/, std::int64_t n) { return n + n % 2; }

/// Sums over samples of both techniques; p and q are the densities of light and BSDF sampling, m
/// their sum. Sufficient for fitting and evaluation, so memory does not grow with n.
struct Sums {
  double count = 0;
  double pp = 0;  ///< p p / m^2, and so on
  double pq = 0;
  double qq = 0;
  double fp = 0;
  double fq = 0;
  double f = 0;  ///< f / m, and so on
  double p = 0;
  double q = 0;

  void add(double value, double pdf_light_sr, double pdf_bsdf_sr) {
    count += 1;
    const double m = pdf_light_sr + pdf_bsdf_sr;
    if (!(m > 0)) {
      return;
    }
    const double a = pdf_light_sr / m;
    const double b = pdf_bsdf_sr / m;
    pp += a * a;
    pq += a * b;
    qq += b * b;
    fp += value / m * a;
    fq += value / m * b;
    f += value / m;
    p += a;
    q += b;
  }
};

Sums operator+(const Sums& x, const Sums& y) {
  return {x.count + y.count, x.pp + y.pp, x.pq + y.pq, x.qq + y.qq, x.fp + y.fp,
          x.fq + y.fq,       x.f + y.f,   x.p + y.p,   x.q + y.q};
}

OptimalMisCoefficients solve(const Sums& s) {
  return solve_optimal_mis({s.pp, s.pq, s.qq}, s.fp, s.fq);
}

/// Returns sum a + the mean residual over the mixture, with one sample of each technique per pair.
double apply(const Sums& s, OptimalMisCoefficients a) {
  return a.p + a.q + 2 * (s.f - a.p * s.p - a.q * s.q) / s.count;
}

double estimate(Trial& trial) {
  const Stage stage(trial.parameter(kSide), trial.parameter(kHidden));
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  std::array<Sums, 2> halves;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    Sums& half = halves[2 * i < trial.n() ? 0 : 1];
    const Stage::Sample l =
        stage.sample_light(trial.get_4d(dimension_group(0, BounceGroup::kLight)));
    half.add(l.value, l.pdf_solid_angle, l.other_pdf_solid_angle);
    const Stage::Sample b = stage.sample_bsdf(trial.get_4d(dimension_group(0, BounceGroup::kBsdf)));
    half.add(b.value, b.other_pdf_solid_angle, b.pdf_solid_angle);
  }
  const Sums all = halves[0] + halves[1];
  switch (trial.estimator()) {
    case kBalance:
      return apply(all, {});
    case kSame:
      return apply(all, solve(all));
    default:
      return 0.5 * (apply(halves[0], solve(halves[1])) + apply(halves[1], solve(halves[0])));
  }
}

std::optional<TheorySlope> slope(const Setup& setup) {
  // With few samples the coefficients are poor, so cross-fitting is worse than its slope at the
  // first points.
  return setup.estimator == kBalance ? monte_carlo_slope(setup) : std::nullopt;
}

constexpr std::array<std::int64_t, 7> kN = {4, 16, 64, 256, 1024, 4096, 16384};

}  // namespace

const Experiment kOptimalMisExperiment = {
    .name = "optimal-mis",
    .title = "Optimal weights",
    .summary =
        "Weights that may be negative, found by solving a 2×2 system, beat every heuristic; it "
        "matters which samples they are computed from.",
    .estimates =
        "Irradiance from a partly occluded square light, with one light sample and one BSDF sample "
        "per pair.",
    .formula =
        "A a = b,  A_kl = ∫ p_k p_l / Σp,  b_k = ∫ f p_k / Σp;  E ≈ Σ a_k + 1/n Σ (f − Σ a_k p_k) "
        "/ Σp",
    .look_for =
        "If the coefficients are solved from the samples they are applied to, they follow the "
        "noise, and the mean is wrong at n = 4. If they are solved from one half and applied to "
        "the other, every mean is right, at the cost of more noise when a half has few samples. "
        "For large n both have a smaller error than the balance heuristic.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "cross-fitted",
    .n = kN,
    .unit = "pairs",
    .n_least = 2,
    .expected = &expected,
    .slope = &slope,
    .evaluations = &evaluations,
    .rounded = &rounded,
    .estimate = &estimate,
};

}  // namespace core::lab
