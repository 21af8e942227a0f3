// Spatial and temporal reuse of reservoirs over a one-dimensional image with shadow edges.

#include <algorithm>
#include <array>
#include <vector>

#include "core/lab/experiment_list.h"
#include "core/lab/trial.h"
#include "core/sampling/reservoir.h"

namespace core::lab {
namespace {

enum { kRis, kSpatial, kTemporal, kBoth, kBiased };
enum { kCandidates, kChain, kHistory, kPixel };

constexpr int kPixels = 16;
constexpr int kReach = 2;  ///< neighbours on each side
constexpr std::array kEstimators = {
    EstimatorInfo{"ris", "none", "No reuse: pixels and frames are independent."},
    EstimatorInfo{"spatial", "none", "Reuses two neighbours on each side, with MIS weights."},
    EstimatorInfo{"temporal", "none", "Reuses earlier frames of the same pixel, with MIS weights."},
    EstimatorInfo{"spatiotemporal", "none", "Spatial and temporal reuse, with MIS weights."},
    EstimatorInfo{"biased", "biased",
                  "Spatial and temporal reuse with weights 1/M, which also count neighbours that "
                  "do not see the sample."},
};
constexpr std::array kParameters = {
    ParameterInfo{"candidates", 1, 64, 4, true, "New candidates per pixel and frame."},
    ParameterInfo{"chain", 1, 64, 16, true, "Frames after which the history is reset."},
    ParameterInfo{"history", 1, 100, 20, true,
                  "Maximum weight of the history, in frames of candidates."},
    ParameterInfo{"pixel", 0, kPixels - 1, 8, true, "Index of the pixel to estimate."},
};
constexpr std::array<std::int64_t, 4> kN = {64, 256, 1024, 4096};

/// Pixel j sees the points y < x_j of the light; its integrand there is 2 y, its value x_j^2.
double position(int pixel) { return (pixel + 0.5) / kPixels; }
double target(int pixel, double y) { return y < position(pixel) ? 2 * y : 0; }

double expected(const Setup& setup) {
  const double x = position(setup.whole(kPixel));
  return x * x;
}

double evaluations(const Setup& setup, std::int64_t n) {
  return static_cast<double>(n) * (2 * kReach + 1) * ((setup.whole(kCandidates) + 3) / 4 + 1);
}

std::int64_t rounded(const Setup& setup, std::int64_t n) {
  const std::int64_t chain = setup.whole(kChain);
  return (n + chain - 1) / chain * chain;
}

/// A light point that represents `count` candidates; weight: its unbiased contribution weight W.
struct Reservoir {
  double y = 0;
  double weight = 0;
  double count = 0;
};

Reservoir fresh(const Trial& trial, int pixel, int candidates) {
  WeightedReservoir<double> chosen(trial.extra_1d(0));
  for (int j = 0; j < candidates; ++j) {
    const Vec4 u = trial.get_4d(j / 4);
    const std::array<float, 4> all = {u.x, u.y, u.z, u.w};
    const double y = all[static_cast<std::size_t>(j % 4)];
    chosen.add(y, target(pixel, y));  // the source density is 1
  }
  const auto count = static_cast<double>(candidates);
  if (chosen.empty()) {
    return {0, 0, count};
  }
  return {chosen.item(), chosen.sum() / count / target(pixel, chosen.item()), count};
}

struct Stream {
  Reservoir reservoir;
  int pixel = 0;  ///< pixel of its target function
};

/// Combines reservoirs for `pixel`. Source: Bitterli et al. 2020, with the balance heuristic over
/// the reservoirs' targets and counts; if is_biased, with weights 1 / (sum of counts).
Reservoir combine(const Trial& trial, int pixel, const std::vector<Stream>& streams,
                  bool is_biased) {
  WeightedReservoir<double> chosen(trial.extra_1d(1));
  double count = 0;
  for (const Stream& s : streams) {
    count += s.reservoir.count;
    double share = s.reservoir.count;
    if (!is_biased) {
      double all = 0;
      for (const Stream& other : streams) {
        all += other.reservoir.count * target(other.pixel, s.reservoir.y);
      }
      share = all > 0 ? s.reservoir.count * target(s.pixel, s.reservoir.y) / all : 0;
    }
    chosen.add(s.reservoir.y, share * target(pixel, s.reservoir.y) * s.reservoir.weight);
  }
  if (chosen.empty()) {
    return {0, 0, count};
  }
  const double sum = is_biased ? chosen.sum() / count : chosen.sum();
  return {chosen.item(), sum / target(pixel, chosen.item()), count};
}

/// Renders one frame of the pixel. Returns false if cancelled.
bool render(Trial& trial, std::int64_t frame, Reservoir& reservoir, std::vector<Stream>& streams) {
  const int pixel = trial.whole(kPixel);
  const bool spatial = trial.estimator() == kSpatial || trial.estimator() >= kBoth;
  const bool temporal = frame % trial.whole(kChain) != 0 && trial.estimator() >= kTemporal;
  streams.clear();
  const int reach = spatial ? kReach : 0;
  for (int j = std::max(0, pixel - reach); j <= std::min(kPixels - 1, pixel + reach); ++j) {
    if (!trial.start_at(j, frame)) {
      return false;
    }
    streams.push_back({fresh(trial, j, trial.whole(kCandidates)), j});
  }
  if (temporal) {
    streams.push_back({reservoir, pixel});
  }
  if (!trial.start_at(pixel, frame)) {
    return false;
  }
  reservoir = combine(trial, pixel, streams, trial.estimator() == kBiased);
  reservoir.count =
      std::min(reservoir.count, trial.parameter(kHistory) * trial.parameter(kCandidates));
  return true;
}

/// Returns the visible result: the last frame of each chain.
double estimate(Trial& trial) {
  Reservoir reservoir;
  std::vector<Stream> streams;
  const int pixel = trial.whole(kPixel);
  const std::int64_t chain = trial.whole(kChain);
  double sum = 0;
  for (std::int64_t frame = 0; frame < trial.n(); ++frame) {
    if (!render(trial, frame, reservoir, streams)) {
      return 0;
    }
    if (frame % chain == chain - 1) {
      sum += target(pixel, reservoir.y) * reservoir.weight;
    }
  }
  return sum * static_cast<double>(chain) / static_cast<double>(trial.n());
}

}  // namespace

const Experiment kRestirExperiment = {
    .name = "restir-1d",
    .title = "Reuse across pixels and frames",
    .summary =
        "A reservoir from a neighbouring pixel or an earlier frame is a free sample, provided it "
        "is weighted correctly.",
    .estimates =
        "One pixel of a row of 16, in the last frame of each chain. The pixel at x sees the part y "
        "< x of a light of radiance 2y, so its value is x².",
    .formula =
        "W = 1/p̂(Y) Σ mᵢ p̂(Yᵢ) Wᵢ,  mᵢ = Mᵢ p̂ᵢ(Yᵢ) / Σ M_k p̂_k(Yᵢ);  biased: mᵢ = Mᵢ / Σ M_k",
    .look_for =
        "With MIS weights that consider which samples each neighbour could have drawn, the mean is "
        "right. With weights 1/M, neighbours in shadow are counted although they could not have "
        "drawn the sample: the image is too dark at every edge, and more frames do not help. Reuse "
        "lowers the error of a frame, as more candidates would; the slope stays −1/2 because "
        "chains are independent.",
    .estimators = kEstimators,
    .parameters = kParameters,
    .estimator = "spatiotemporal",
    .any_sampler = false,
    .n = kN,
    .unit = "frames",
    .expected = &expected,
    .evaluations = &evaluations,
    .rounded = &rounded,
    .estimate = &estimate,
};

}  // namespace core::lab
