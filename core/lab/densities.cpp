// Numbers with a wanted density, made from uniform ones in five ways, and tested by chi-squared.

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/sampling/distribution.h"
#include "core/sampling/warp.h"

namespace core::lab {
namespace {

enum { kInversion, kRejection, kTable, kConditional, kDisk, kNoJacobian };

constexpr int kSide = 8;  ///< bins on each axis of the square, rings and sectors of the disk
constexpr int kBins = kSide * kSide;

constexpr std::array kEstimators = {
    EstimatorInfo{"inversion", "none", "x = -ln(1 - u (1 - 1/e)), the inverse of the cdf."},
    EstimatorInfo{"rejection", "none", "Uniform x, kept with probability e^-x, else drawn again."},
    EstimatorInfo{"table", "none", "The renderer's piecewise-constant density of 64 cells."},
    EstimatorInfo{"conditional", "none",
                  "p(x, y) = x + y: inverts the marginal cdf of x, then the conditional one of y."},
    EstimatorInfo{"disk", "none", "The renderer's map from the square to the uniform unit disk."},
    EstimatorInfo{"no-jacobian", "biased",
                  "Deliberately wrong: r = u in place of r = sqrt(u), so the disk is too dense at "
                  "its centre."},
};
constexpr std::array<std::int64_t, 4> kN = {1024, 4096, 16384, 65536};

const double kMass = 1 - std::exp(-1.0);  ///< of e^-x on [0,1]

bool is_on_disk(std::size_t estimator) { return estimator >= kDisk; }

double probability(std::size_t estimator, int bin) {
  if (is_on_disk(estimator)) {
    return 1.0 / kBins;
  }
  if (estimator == kConditional) {  // x + y is linear, so its mean over a bin is at the centre
    return (bin / kSide + bin % kSide + 1.0) / kSide / kBins;
  }
  const auto cdf = [](int edge) { return (1 - std::exp(-static_cast<double>(edge) / kBins)); };
  return (cdf(bin + 1) - cdf(bin)) / kMass;
}

Distribution1D table() {
  std::vector<float> weights;
  for (int bin = 0; bin < kBins; ++bin) {
    weights.push_back(static_cast<float>(probability(kTable, bin)));
  }
  return Distribution1D(weights);
}

struct Point2 {
  double x = 0;
  double y = 0;
};

Point2 drawn(const Trial& trial) {
  static const Distribution1D kTabulated = table();
  const Vec4 u = trial.get_4d(0);
  switch (trial.estimator()) {
    case kInversion:
      return {-std::log(1 - double{u.x} * kMass), u.y};
    case kRejection: {
      std::uint32_t number = 0;
      double x = trial.extra_1d(number++);
      while (!(double{trial.extra_1d(number++)} < std::exp(-x))) {
        x = trial.extra_1d(number++);
      }
      return {x, u.y};
    }
    case kTable:
      return {kTabulated.sample(u.x).x, u.y};
    case kConditional: {
      const double x = (std::sqrt(1 + 8 * double{u.x}) - 1) / 2;
      return {x, std::sqrt(x * x + double{u.y} * (2 * x + 1)) - x};
    }
    case kDisk: {
      const Vec2 p = concentric_disk({u.x, u.y});
      return {p.x, p.y};
    }
    default:
      return {u.x * std::cos(kTwoPi * u.y), u.x * std::sin(kTwoPi * u.y)};
  }
}

int bin_of(std::size_t estimator, Point2 p) {
  const auto cell = [](double v, int cells) {
    return std::clamp(static_cast<int>(v * cells), 0, cells - 1);
  };
  if (is_on_disk(estimator)) {  // rings of equal area
    const double turn = std::atan2(p.y, p.x) / (2 * std::numbers::pi);
    return cell(p.x * p.x + p.y * p.y, kSide) * kSide + cell(turn < 0 ? turn + 1 : turn, kSide);
  }
  return estimator == kConditional ? cell(p.x, kSide) * kSide + cell(p.y, kSide) : cell(p.x, kBins);
}

double expected(const Setup& /*setup*/) { return 1; }

/// Chi-squared over its degrees of freedom is as noisy for any n.
std::optional<TheorySlope> slope(const Setup& setup) {
  return setup.estimator == kNoJacobian ? std::nullopt : std::optional(TheorySlope{0, 0.1});
}

double estimate(Trial& trial) {
  std::array<double, kBins> counts{};
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    counts[static_cast<std::size_t>(bin_of(trial.estimator(), drawn(trial)))] += 1;
  }
  double chi2 = 0;
  for (int bin = 0; bin < kBins; ++bin) {
    const double wanted = static_cast<double>(trial.n()) * probability(trial.estimator(), bin);
    const double off = counts[static_cast<std::size_t>(bin)] - wanted;
    chi2 += off * off / wanted;
  }
  return chi2 / (kBins - 1);
}

Vec4 shown(const Trial& trial) {
  const Point2 p = drawn(trial);
  const double scale = is_on_disk(trial.estimator()) ? 0.5 : 1;
  const double shift = is_on_disk(trial.estimator()) ? 0.5 : 0;
  return {static_cast<float>(p.x * scale + shift), static_cast<float>(p.y * scale + shift), 0, 0};
}

}  // namespace

const Experiment kInversionExperiment = {
    .name = "inversion",
    .title = "Densities from uniform numbers",
    .summary =
        "Inversion, rejection, tables and changes of variables turn uniform numbers into any "
        "density.",
    .estimates =
        "χ² of 64 bins over its 63 degrees of freedom: 1 if the density is right. The density is "
        "proportional to e^(−x), to x + y on the square, or uniform on the disk.",
    .formula =
        "x = P⁻¹(u);  p(y) = p(x) / |dy/dx|;  p(x, y) = p(x) p(y|x);  χ² = Σ (countₖ − n pₖ)² / "
        "(n pₖ)",
    .look_for =
        "All but the last stay at 1 for every n. `no-jacobian` draws r uniformly: the ring at r "
        "has the area 2π r dr, so points crowd at the centre, and χ² grows in proportion to n. The "
        "points next to the form show it too.",
    .estimators = kEstimators,
    .estimator = "inversion",
    .any_sampler = false,
    .n = kN,
    .unit = "points",
    .pattern_dimensions = 2,
    .expected = &expected,
    .slope = &slope,
    .estimate = &estimate,
    .shown = &shown,
};

}  // namespace core::lab
