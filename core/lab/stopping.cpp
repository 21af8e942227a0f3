// Bias of the mean if the samples themselves determine their number.

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"

namespace core::lab {
namespace {

enum {
  kFixed,
  kHalfMetric,
  kStandardError,
  kPilotReused,
  kPilotDiscarded,
  kCrossHalf,
  kCrossCounts
};
enum { kDistribution, kTarget, kCap };
enum { kRareEvents, kLognormal, kCoin, kExponential };

constexpr std::int64_t kPilot = 32;
constexpr std::int64_t kCheckSamples =
    16;  ///< samples between two error checks of a sequential rule

constexpr std::array kEstimators = {
    EstimatorInfo{"fixed", "none", "256 samples, whatever their values."},
    EstimatorInfo{"half-metric", "biased",
                  "Stops when the mean and the mean of half the samples differ by less than half "
                  "the target."},
    EstimatorInfo{"standard-error", "biased",
                  "Stops when the estimated relative standard error is below the target."},
    EstimatorInfo{"pilot-reused", "biased",
                  "32 pilot samples determine how many follow, and are included in the mean."},
    EstimatorInfo{"pilot-discarded", "none",
                  "32 pilot samples determine how many follow, and are discarded."},
    EstimatorInfo{"cross-half", "none",
                  "The pilot of each half determines the sample count of the other; both halves "
                  "have equal weight."},
    EstimatorInfo{"cross-counts", "biased",
                  "As `cross-half`, but halves are weighted by their sample counts."},
};
constexpr std::array kParameters = {
    ParameterInfo{"distribution", 0, 3, 0, true,
                  "0: 50 with probability 2%, else 0; 1: lognormal, sigma 1.5; 2: coin, 0 or 2; 3: "
                  "exponential. All have mean 1."},
    ParameterInfo{"target", 0.01, 1, 0.1, false, "Relative standard error to reach."},
    ParameterInfo{"cap", 64, 4096, 1024, true,
                  "Maximum number of samples of a pixel, or of a half."},
};
constexpr std::array<std::int64_t, 4> kN = {16, 64, 256, 1024};

double expected(const Setup& /*setup*/) { return 1; }

double evaluations(const Setup& setup, std::int64_t n) {
  const double most = setup.estimator == kFixed
                          ? 256
                          : setup.parameter(kCap) * (setup.estimator >= kCrossHalf ? 2 : 1);
  return static_cast<double>(n) * (most + kPilot);
}

double draw(int distribution, Vec4 u) {
  switch (distribution) {
    case kRareEvents:
      return u.x < 0.02F ? 50 : 0;
    case kLognormal: {
      const double z =
          std::sqrt(-2 * std::log1p(-double{u.x})) * std::cos(2 * std::numbers::pi * double{u.y});
      return std::exp(1.5 * z - 1.125);
    }
    case kCoin:
      return u.x < 0.5F ? 2 : 0;
    default:
      return -std::log1p(-double{u.x});
  }
}

/// Streaming mean and variance.
struct Moments {
  double n = 0;
  double mean = 0;
  double m2 = 0;
  void add(double x) {
    n += 1;
    const double d = x - mean;
    mean += d / n;
    m2 += d * (x - mean);
  }
  double variance() const { return n > 1 ? m2 / (n - 1) : 0; }
};

/// One pixel with its samples in order, from its own stream.
class Pixel {
 public:
  Pixel(Trial& trial, std::int64_t index) : trial_(trial), index_(index) {}

  /// Adds `count` samples. Returns false if cancelled.
  bool add(std::int64_t count, Moments& into) {
    for (std::int64_t k = 0; k < count; ++k) {
      if (!trial_.start_at(index_, next_++)) {
        return false;
      }
      into.add(draw(trial_.whole(kDistribution), trial_.get_4d(0)));
    }
    trial_.add_cost(static_cast<double>(count));
    return true;
  }

  /// Returns the samples that the target needs, as estimated by the pilot.
  std::int64_t wanted(const Moments& pilot) const {
    const double target = trial_.parameter(kTarget);
    const double ratio =
        pilot.mean > 0 ? pilot.variance() / (target * target * pilot.mean * pilot.mean) : 0;
    return std::clamp(static_cast<std::int64_t>(std::ceil(ratio)), kPilot,
                      static_cast<std::int64_t>(trial_.whole(kCap)));
  }

  double half_metric() {
    Moments all;
    Moments half;
    const auto cap = static_cast<std::int64_t>(trial_.whole(kCap));
    while (all.n < static_cast<double>(cap)) {
      for (std::int64_t k = 0; k < kCheckSamples; ++k) {
        if (!trial_.start_at(index_, next_++)) {
          return 0;
        }
        const double x = draw(trial_.whole(kDistribution), trial_.get_4d(0));
        all.add(x);
        if (k % 2 == 0) {
          half.add(x);
        }
      }
      trial_.add_cost(kCheckSamples);
      const double scale = all.mean < 1 ? std::sqrt(all.mean) : all.mean;
      if (std::fabs(all.mean - half.mean) <= 0.5 * trial_.parameter(kTarget) * scale) {
        break;
      }
    }
    return all.mean;
  }

  double standard_error() {
    Moments all;
    const auto cap = static_cast<double>(trial_.whole(kCap));
    while (all.n < cap && add(kCheckSamples, all)) {
      if (std::sqrt(all.variance() / all.n) <= trial_.parameter(kTarget) * all.mean) {
        break;
      }
    }
    return all.mean;
  }

  double pilot(bool reused) {
    Moments first;
    if (!add(kPilot, first)) {
      return 0;
    }
    const std::int64_t count = wanted(first);
    Moments rest = reused ? first : Moments{};
    add(reused ? count - kPilot : count, rest);
    return rest.mean;
  }

  double cross(bool by_counts) {
    Moments a;
    Moments b;
    if (!add(kPilot, a) || !add(kPilot, b)) {
      return 0;
    }
    const std::int64_t count_a = wanted(b);
    const std::int64_t count_b = wanted(a);
    if (!add(count_a - kPilot, a) || !add(count_b - kPilot, b)) {
      return 0;
    }
    return by_counts ? (a.n * a.mean + b.n * b.mean) / (a.n + b.n) : 0.5 * (a.mean + b.mean);
  }

 private:
  Trial& trial_;
  std::int64_t index_;
  std::int64_t next_ = 0;
};

double pixel_value(Trial& trial, std::int64_t index) {
  Pixel pixel(trial, index);
  switch (trial.estimator()) {
    case kFixed: {
      Moments all;
      pixel.add(256, all);
      return all.mean;
    }
    case kHalfMetric:
      return pixel.half_metric();
    case kStandardError:
      return pixel.standard_error();
    case kPilotReused:
    case kPilotDiscarded:
      return pixel.pilot(trial.estimator() == kPilotReused);
    default:
      return pixel.cross(trial.estimator() == kCrossCounts);
  }
}

double estimate(Trial& trial) {
  double sum = 0;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start_at(i, 0)) {
      return 0;
    }
    sum += pixel_value(trial, i);
  }
  return sum / static_cast<double>(trial.n());
}

}  // namespace

const Experiment kStoppingExperiment = {
    .name = "stopping-bias",
    .title = "The bias of stopping",
    .summary = "If each pixel stops once it looks converged, dark pixels stop too early.",
    .estimates =
        "The mean of n pixels, each of which is the mean of as many samples as its stop rule "
        "takes. The exact value is 1.",
    .formula =
        "half metric |I − A| / I, standard error s/(√n I), pilot n = (s/(ε I))²;  E[mean at a "
        "random n] ≠ μ",
    .look_for =
        "Rare events (distribution 0): the sequential rules lose half of the light or more, "
        "because a pixel without an event so far looks converged. Neither more pixels nor a lower "
        "target corrects this. Discarding a pilot costs 32 samples and keeps the mean exact; so do "
        "two halves that determine each other's sample count, as long as they have equal weight.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "standard-error",
    .any_sampler = false,
    .n = kN,
    .unit = "pixels",
    .expected = &expected,
    .evaluations = &evaluations,
    .estimate = &estimate,
};

}  // namespace core::lab
