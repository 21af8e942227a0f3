// Reservoirs of one pixel, of its neighbours and of earlier frames, merged.

#include <algorithm>
#include <vector>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/sampling/reservoir.h"
#include "core/sampling/shared_samples.h"

namespace core::lab {
namespace {

enum { kOwn, kTwo, kNeighbours, kChain, kByCount, kNoWeight };
enum { kCandidates, kFrames, kCap };

constexpr std::array kEstimators = {
    EstimatorInfo{"own", "none", "One reservoir, no merging."},
    EstimatorInfo{"two", "none",
                  "Two reservoirs of the same pixel merged: as one of twice the candidates."},
    EstimatorInfo{"neighbours", "none",
                  "Three pixels that see different parts, with the renderer's MIS weights."},
    EstimatorInfo{"chain", "none", "A reservoir handed from frame to frame, its count capped."},
    EstimatorInfo{"by-count", "biased",
                  "Deliberately wrong: the three pixels weighted by their counts alone."},
    EstimatorInfo{"no-weight", "biased",
                  "Deliberately wrong: merged samples count as fresh ones, without their W."},
};
constexpr std::array kParameters = {
    ParameterInfo{"candidates", 1, 64, 4, true, "M, the candidates of a reservoir."},
    ParameterInfo{"frames", 1, 64, 8, true, "Frames of a chain."},
    ParameterInfo{"cap", 1, 100, 4, true, "Greatest count of the history, in frames."},
};

/// Pixel k sees the points y < kSeen[k] of the light. Candidates are uniform on [0,1); the target
/// 1/2 + y stands in for the integrand 3 y^2.
constexpr std::array kSeen = {0.5, 0.25, 0.75};
double target(std::size_t pixel, double y) { return y < kSeen[pixel] ? 0.5 + y : 0; }
double expected(const Setup& /*setup*/) { return 0.125; }

std::int64_t reservoirs(const Setup& setup) {
  switch (setup.estimator) {
    case kOwn:
      return 1;
    case kTwo:
      return 2;
    case kChain:
      return setup.whole(kFrames);
    default:
      return static_cast<std::int64_t>(kSeen.size());
  }
}
double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * static_cast<double>(reservoirs(setup)) * setup.whole(kCandidates);
}

/// A sample of `count` candidates; weight: W = sum w / (M target).
struct Reservoir {
  double y = 0;
  double weight = 0;
  double count = 0;
  std::size_t pixel = 0;
};

Reservoir fresh(Trial& trial, std::size_t pixel, std::uint32_t& number) {
  const int m = trial.whole(kCandidates);
  WeightedReservoir<double> chosen(trial.extra_1d(number++));
  for (int j = 0; j < m; ++j) {
    const double y = trial.extra_1d(number++);
    chosen.add(y, target(pixel, y));
  }
  const auto count = static_cast<double>(m);
  return chosen.empty()
             ? Reservoir{0, 0, count, pixel}
             : Reservoir{chosen.item(), chosen.sum() / count / target(pixel, chosen.item()), count,
                         pixel};
}

/// Merges for pixel 0.
Reservoir merge(const Trial& trial, const std::vector<Reservoir>& all, SharedSamples& shares,
                std::uint32_t& number) {
  shares.start(all.size());
  double count = 0;
  for (std::size_t i = 0; i < all.size(); ++i) {
    count += all[i].count;
    for (std::size_t j = 0; j < all.size(); ++j) {
      shares.set(i, j, static_cast<float>(all[i].count * target(all[i].pixel, all[j].y)));
    }
  }
  shares.choose((std::uint64_t{1} << all.size()) - 1);
  WeightedReservoir<double> chosen(trial.extra_1d(number++));
  for (std::size_t j = 0; j < all.size(); ++j) {
    const Reservoir& k = all[j];
    const double share = trial.estimator() == kByCount ? k.count / count : double{shares.weight(j)};
    const double w = trial.estimator() == kNoWeight ? (k.weight > 0 ? 1 : 0) : k.weight;
    chosen.add(k.y, share * target(0, k.y) * w);
  }
  return chosen.empty()
             ? Reservoir{0, 0, count, 0}
             : Reservoir{chosen.item(), chosen.sum() / target(0, chosen.item()), count, 0};
}

double estimate(Trial& trial) {
  const Setup& setup = trial.setup();
  const auto parts = static_cast<std::size_t>(reservoirs(setup));
  const double cap = trial.parameter(kCap) * trial.parameter(kCandidates);
  const bool is_spatial = setup.estimator != kTwo && setup.estimator != kChain;
  SharedSamples shares;
  std::vector<Reservoir> all;
  trial.add_cost(evaluations(setup, trial.n()));
  return mean_of(trial, [&] {
    std::uint32_t number = 0;
    all.clear();
    Reservoir out;
    for (std::size_t k = 0; k < parts; ++k) {
      all.push_back(fresh(trial, is_spatial ? k : 0, number));
      if (setup.estimator == kChain && k > 0) {
        out.count = std::min(out.count, cap);
        out = merge(trial, {out, all.back()}, shares, number);
      } else {
        out = all.back();
      }
    }
    if (setup.estimator != kChain && parts > 1) {
      out = merge(trial, all, shares, number);
    }
    return 3 * out.y * out.y * out.weight;
  });
}

}  // namespace

const Experiment kReservoirMergeExperiment = {
    .name = "reservoir-merge",
    .title = "Merging reservoirs",
    .summary =
        "A reservoir is a sample that stands for many: merge it with its W, its count and the "
        "right MIS weight.",
    .estimates = "Light of a pixel that sees half of a light of radiance 3y²: ⅛.",
    .formula =
        "keep y with probability w/Σw: P(i) = wᵢ/Wᵢ · Wᵢ/Wᵢ₊₁ · … = wᵢ/Wₙ, Wₖ = w₁ + … + wₖ;  W_Y "
        "= 1/p̂(Y) Σ mᵢ p̂(Yᵢ) W_Yᵢ,  mᵢ = Mᵢ p̂ᵢ(Yᵢ) / Σ Mⱼ p̂ⱼ(Yᵢ)",
    .look_for =
        "`two` has the error of one reservoir with twice the candidates: merging loses nothing. "
        "`neighbours` see other parts of the light and still leave the mean right, because mᵢ asks "
        "which of them could have drawn the sample. `by-count` does not ask, and is too dark or "
        "too bright for every n. In a `chain` the error falls with the frames, until the cap "
        "forgets the oldest.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "neighbours",
    .any_sampler = false,
    .unit = "merges",
    .expected = &expected,
    .evaluations = &evaluations,
    .estimate = &estimate,
};

}  // namespace core::lab
