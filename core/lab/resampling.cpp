// Resampled importance sampling over M candidates, and its streaming form with a reservoir.

#include "core/lab/experiment_list.h"
#include "core/lab/stage.h"
#include "core/lab/trial.h"
#include "core/sampling/reservoir.h"

namespace core::lab {
namespace {

namespace ris {

enum { kRis, kBlind };
enum { kCandidates, kHidden, kSide };

constexpr std::array kEstimators = {
    EstimatorInfo{"ris", "none",
                  "Candidates resampled in proportion to the unshadowed contribution."},
    EstimatorInfo{"blind", "biased",
                  "Deliberately wrong: the target is 0 in the left half of the hemisphere, where "
                  "there is light."},
};
constexpr std::array kParameters = {
    ParameterInfo{"candidates", 1, 256, 8, true, "M, the number of candidates per sample."},
    ParameterInfo{"hidden", 0, 0.9, 0.2, false, "Fraction of the light occluded by an edge."},
    side_parameter(1),
};

double expected(const Setup& setup) {
  return square_irradiance(setup.parameter(kSide), setup.parameter(kHidden));
}
double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * setup.whole(kCandidates);
}

struct Candidate {
  double value = 0;
  double target = 0;
};

double estimate(Trial& trial) {
  const Stage stage(trial.parameter(kSide), trial.parameter(kHidden));
  const int m = trial.whole(kCandidates);
  const bool blind = trial.estimator() == kBlind;
  trial.add_cost(evaluations(trial.setup(), trial.n()));
  return mean_of(trial, [&]() -> double {
    WeightedReservoir<Candidate> chosen(trial.extra_1d(0));
    for (int j = 0; j < m; ++j) {
      const Vec4 u = trial.get_4d(j);
      const Stage::Sample s = stage.sample_bsdf(u);
      // The first number of the direction is its angle: u.y below one half is the left half of the
      // disk.
      const double target = blind && u.y < 0.5F ? 0 : s.unhidden;
      if (s.pdf_solid_angle > 0) {
        chosen.add({s.value, target}, target / s.pdf_solid_angle);
      }
    }
    return chosen.empty() ? 0 : chosen.item().value / chosen.item().target * chosen.sum() / m;
  });
}

}  // namespace ris

namespace reservoir {

enum { kStream, kMerged, kUnweighted };
enum { kItems };

constexpr int kItemsMax = 200;
constexpr std::array kEstimators = {
    EstimatorInfo{"stream", "none", "One reservoir for all items."},
    EstimatorInfo{"merged", "none",
                  "One reservoir per group of up to seven items, merged in random order."},
    EstimatorInfo{"unweighted", "biased",
                  "Deliberately wrong: replaces with probability 1/i, ignoring the weights."},
};
constexpr std::array kParameters = {
    ParameterInfo{"items", 2, kItemsMax, 50, true, "Items per stream; item i has weight i."},
};
constexpr std::array<std::int64_t, 3> kN = {8192, 16384, 32768};

double expected(const Setup& /*setup*/) { return 1; }
double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * setup.whole(kItems);
}

/// Expected counts are at least five.
std::int64_t rounded(const Setup& setup, std::int64_t n) {
  const std::int64_t k = setup.whole(kItems);
  return std::max(n, 5 * k * (k + 1) / 2);
}

int stream(const Trial& trial, int items) {
  WeightedReservoir<int> chosen(trial.extra_1d(0));
  for (int i = 1; i <= items; ++i) {
    chosen.add(i, trial.estimator() == kUnweighted ? 1 : i);
  }
  return chosen.item();
}

/// Parts of up to seven items, each a reservoir, merged two at a time.
int merged(const Trial& trial, int items) {
  std::array<WeightedReservoir<int>, kItemsMax / 7 + 1> parts = [&]<std::size_t... I>(
      std::index_sequence<I...>) {
    return std::array<WeightedReservoir<int>, sizeof...(I)>{
        WeightedReservoir<int>(trial.extra_1d(static_cast<std::uint32_t>(I)))...};
  }
  (std::make_index_sequence<kItemsMax / 7 + 1>{});
  std::size_t count = static_cast<std::size_t>(items - 1) / 7 + 1;
  for (int i = 1; i <= items; ++i) {
    parts[static_cast<std::size_t>(i - 1) / 7].add(i, i);
  }
  std::uint32_t number = 1000;
  while (count > 1) {
    const auto pick = [&](std::size_t of) {
      return std::min(static_cast<std::size_t>(trial.extra_1d(number++) * static_cast<float>(of)),
                      of - 1);
    };
    std::swap(parts[pick(count)], parts[count - 1]);
    std::swap(parts[pick(count - 1)], parts[count - 2]);
    WeightedReservoir<int> both(trial.extra_1d(number++));
    both.add(parts[count - 1].item(), parts[count - 1].sum());
    both.add(parts[count - 2].item(), parts[count - 2].sum());
    parts[count - 2] = both;
    --count;
  }
  return parts[0].item();
}

double estimate(Trial& trial) {
  const int items = trial.whole(kItems);
  std::array<double, kItemsMax + 1> counts{};
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    const int chosen = trial.estimator() == kMerged ? merged(trial, items) : stream(trial, items);
    counts[static_cast<std::size_t>(chosen)] += 1;
  }
  double chi2 = 0;
  for (int i = 1; i <= items; ++i) {
    const double wanted =
        static_cast<double>(trial.n()) * 2 * i / (static_cast<double>(items) * (items + 1));
    const double off = counts[static_cast<std::size_t>(i)] - wanted;
    chi2 += off * off / wanted;
  }
  return chi2 / (items - 1);
}

std::optional<TheorySlope> slope(const Setup& setup) {
  return setup.estimator == kUnweighted ? std::nullopt : std::optional(TheorySlope{0});
}

}  // namespace reservoir
}  // namespace

const Experiment kRisExperiment = {
    .name = "ris-m",
    .title = "Resampled importance sampling over M",
    .summary =
        "Draw M cheap candidates and keep one in proportion to a target that cannot be sampled "
        "directly.",
    .estimates =
        "Irradiance from a partly occluded square light; candidates are cosine-weighted "
        "directions.",
    .formula = "y from x₁…x_M with weights wⱼ = p̂(xⱼ)/p(xⱼ);  E ≈ f(y)/p̂(y) · 1/M Σ wⱼ",
    .look_for =
        "M = 1 is plain importance sampling. As M grows the error falls, fast at first, then "
        "towards that of sampling the target exactly; the remaining error comes from the shadow, "
        "which the target does not include. `blind` shows that a target must not be 0 where there "
        "is light.",
    .estimators = ris::kEstimators,
    .parameters = ris::kParameters,
    .estimator = "ris",
    .unit = "samples",
    .expected = &ris::expected,
    .evaluations = &ris::evaluations,
    .estimate = &ris::estimate,
};

const Experiment kReservoirExperiment = {
    .name = "reservoir-chi2",
    .title = "Is the reservoir fair?",
    .summary =
        "Feed n streams to the renderer's reservoir, count how often each item is kept, and "
        "compare with the weights.",
    .estimates =
        "χ² divided by its degrees of freedom, for the counts of kept items; its mean is 1 if the "
        "reservoir is fair.",
    .formula =
        "replace with probability wᵢ / (w₁ + … + wᵢ);  χ² = Σ (Oᵢ − n wᵢ/W)² / (n wᵢ/W),  E[χ²/(k "
        "− 1)] = 1",
    .look_for =
        "For a fair reservoir χ²/(k − 1) has mean 1 and standard deviation √(2/(k − 1)) for every "
        "n, so the line is flat. For an unfair one (`unweighted`) it rises in proportion to n.",
    .estimators = reservoir::kEstimators,
    .parameters = reservoir::kParameters,
    .estimator = "stream",
    .any_sampler = false,
    .n = reservoir::kN,
    .unit = "streams",
    .expected = &reservoir::expected,
    .slope = &reservoir::slope,
    .evaluations = &reservoir::evaluations,
    .rounded = &reservoir::rounded,
    .estimate = &reservoir::estimate,
};

}  // namespace core::lab
