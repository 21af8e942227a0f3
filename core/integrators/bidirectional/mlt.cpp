// Multiplexed Metropolis light transport in primary sample space: Markov chains of paths with small
// and large mutations, which spend their time where light is. A state is the contribution of a
// single strategy (s, t) of bdpt, with its weight, anywhere on the film.
//
// Chains are short, many and independent of those of other units. A unit first traces samples with
// all strategies; the mean of their light normalises its chains. Each chain starts at a strategy of
// a sample, drawn in proportion to its light (systematically over samples), and keeps the strategy:
// large steps draw other numbers for it. So there is no start-up bias, and the halves of a job are
// independent.
//
// All strategies of a sample start from the same two subpaths, so samples estimate the mean with
// far less noise than states of a chain would, of which most are black. Samples end paths by
// Russian roulette, states do not: a sample's light has the right mean over the numbers of its
// roulette, which no state uses.
//
// Sources: Hachisuka, Kaplanyan and Dachsbacher 2014, "Multiplexed Metropolis Light Transport";
// Kelemen and others 2002, "A Simple and Robust Mutation Strategy for the Metropolis Light
// Transport Algorithm"; start-up: Veach 1997, 11.3.1; both states of a mutation weighted by their
// expected probability: Veach 1997, 11.5; lazy mutation of numbers: PBR 3rd ed., 16.4. Short chains
// with many starts: Cline, Talbot and Egbert 2005, "Energy Redistribution Path Tracing".
//
// Camera paths contribute the light that the camera sees without scattering.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/film/filter.h"
#include "core/integrators/bidirectional/bdpt_tracer.h"
#include "core/integrators/registry.h"
#include "core/math/numbers.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/hash.h"
#include "core/samplers/primary_numbers.h"
#include "core/samplers/streams.h"

namespace core {
namespace {

/// Probability of a large step, and width of small ones. Source: PBR 3rd ed., 16.4.
constexpr float kLargeStep = 0.3F;
constexpr float kSigma = 0.01F;
/// Minimum number of samples of a unit; otherwise one for each pixel.
constexpr int kFirstSamples = 64;
/// States of chains for each pixel, and of a single chain. Source: the lowest errors of
/// tests/bench/integrators_bench on keyhole, glass, caustic-pool and cornell-box. More states for
/// each sample give less grain and more outliers, as do longer chains.
constexpr int kStatesPerPixel = 8;
constexpr int kChainStates = 64;
/// Streams of one state: its subpaths.
constexpr std::uint64_t kCameraNumbers = 1;
constexpr std::uint64_t kLightNumbers = 2;

Vec4 uniform_4d(std::uint64_t a, std::uint64_t b) noexcept {
  const std::uint64_t h = hash_combine(a, b);
  return PathSampler::independent_4d(h, second_hash(h));
}

/// The numbers of a state: those of the last large step, with all small steps since. Computed only
/// for numbers that a state has requested.
class ChainNumbers final : public PrimaryNumbers {
 public:
  explicit ChainNumbers(std::uint64_t seed) : seed_(seed) {}

  /// Starts a state that is independent of all earlier ones.
  void start(std::uint64_t base) {
    numbers_.clear();
    touched_.clear();
    base_ = large_base_ = base;
    step_ = large_step_ = 0;
    is_large_ = true;
    ++proposal_;
  }
  void propose(bool is_large) {
    touched_.clear();
    ++proposal_;
    ++step_;
    is_large_ = is_large;
    base_ = hash_combine(seed_, proposal_);
  }
  void accept() {
    if (is_large_) {
      large_step_ = step_;
      large_base_ = base_;
    }
  }
  void reject() {
    for (Number* number : touched_) {
      number->value = number->value_before;
      number->step = number->step_before;
    }
    --step_;
  }

  Vec4 at(std::uint64_t key) noexcept override;

 private:
  struct Number {
    Vec4 value{};
    Vec4 value_before{};
    int step = -1;  ///< accepted steps at its last mutation
    int step_before = -1;
    std::uint64_t proposal = 0;  ///< last proposal that used it
  };

  std::uint64_t seed_;
  std::uint64_t base_ = 0;  ///< seed of this proposal's numbers
  std::uint64_t large_base_ = 0;
  std::uint64_t proposal_ = 0;
  int step_ = 0;  ///< accepted steps, plus the proposed one
  int large_step_ = 0;
  bool is_large_ = true;
  std::unordered_map<std::uint64_t, Number> numbers_;
  std::vector<Number*> touched_;  ///< by this proposal
};

/// Moves each number by a normally distributed distance; [0,1) wraps around.
Vec4 moved(Vec4 from, float sigma, Vec4 u) noexcept {
  // Box and Muller.
  const float r1 = sigma * std::sqrt(-2 * std::log(1 - u.x));
  const float r2 = sigma * std::sqrt(-2 * std::log(1 - u.z));
  const auto wrapped = [](float v) {
    const float w = v - std::floor(v);
    return w < 1 ? w : 0.0F;
  };
  return {wrapped(from.x + r1 * std::cos(2 * kPi * u.y)),
          wrapped(from.y + r1 * std::sin(2 * kPi * u.y)),
          wrapped(from.z + r2 * std::cos(2 * kPi * u.w)),
          wrapped(from.w + r2 * std::sin(2 * kPi * u.w))};
}

Vec4 ChainNumbers::at(std::uint64_t key) noexcept {
  Number& number = numbers_[key];
  if (number.proposal == proposal_) {
    return number.value;
  }
  number.proposal = proposal_;
  number.value_before = number.value;
  number.step_before = number.step;
  touched_.push_back(&number);
  const Vec4 fresh = uniform_4d(base_, key);
  if (is_large_) {
    number.value = fresh;
  } else {
    if (number.step < large_step_) {
      number.value = uniform_4d(large_base_, key);
      number.step = large_step_;
    }
    number.value =
        moved(number.value, kSigma * std::sqrt(static_cast<float>(step_ - number.step)), fresh);
  }
  number.step = step_;
  return number.value;
}

double luminance_of(Rgb value) noexcept {
  const Rgb size = {std::fabs(value.r), std::fabs(value.g), std::fabs(value.b)};
  return is_finite(value) ? static_cast<double>(luminance(size)) : 0.0;
}

/// A state of a chain: a strategy and its contributions to the film. A strategy with t = 1 may have
/// several, where the light subpath passes surfaces without a change of direction.
class State final : public StrategyLights {
 public:
  explicit State(SubpathLengths strategy) : strategy_(strategy) {}

  SubpathLengths strategy() const noexcept { return strategy_; }
  /// Total luminance; chains visit states in proportion to it.
  double light() const noexcept { return light_; }

  /// Starts a sample. camera_px: of the camera subpath; scale: factor of its contributions.
  void reset(Vec2 camera_px, float scale) noexcept {
    parts_.clear();
    light_ = 0;
    camera_px_ = camera_px;
    scale_ = scale;
  }
  void add(SubpathLengths strategy, Rgb value) noexcept override {
    splat(strategy, camera_px_, value * scale_);
  }
  void splat(SubpathLengths, Vec2 film_px, Rgb value) noexcept override {
    const double light = luminance_of(value);
    if (light > 0) {
      parts_.push_back({film_px, value});
      light_ += light;
    }
  }
  void add_to(CameraSplats& film, double weight) const {
    for (const Part& part : parts_) {
      film.add(part.film_px, part.value * static_cast<float>(weight));
    }
  }

 private:
  struct Part {
    Vec2 film_px;
    Rgb value;
  };

  SubpathLengths strategy_;
  Vec2 camera_px_;
  float scale_ = 0;
  double light_ = 0;
  std::vector<Part> parts_;
};

/// Adds up the light of all strategies of a sample, to draw one in proportion to its light.
class StrategyChoice final : public StrategyLights {
 public:
  /// scale: of contributions to the camera subpath's pixel.
  explicit StrategyChoice(float scale) : scale_(scale) {}
  void add(SubpathLengths strategy, Rgb value) noexcept override {
    if (strategy.light + strategy.camera > 2) {
      add_light(strategy, value * scale_);
    }
  }
  void splat(SubpathLengths strategy, Vec2, Rgb value) noexcept override {
    add_light(strategy, value);
  }
  double sum() const noexcept { return sum_; }
  /// Pre: sum() > 0; u in [0,1).
  SubpathLengths draw(double u) const noexcept {
    const auto at =
        std::upper_bound(entries_.begin(), entries_.end() - 1, u * sum_,
                         [](double value, const Entry& entry) { return value < entry.sum; });
    return at->strategy;
  }

 private:
  struct Entry {
    SubpathLengths strategy;
    double sum = 0;  ///< up to this entry
  };
  void add_light(SubpathLengths strategy, Rgb value) {
    const double light = luminance_of(value);
    if (light > 0) {
      sum_ += light;
      entries_.push_back({strategy, sum_});
    }
  }

  float scale_;
  double sum_ = 0;
  std::vector<Entry> entries_;
};

IntegratorInput without_scattering(const IntegratorInput& input, RenderSettings& settings) {
  settings = input.settings;
  settings.max_depth = 0;
  return {input.scene, input.environment, settings, input.camera};
}

class Metropolis final : public Integrator {
 public:
  explicit Metropolis(const IntegratorInput& input)
      : settings_(input.settings),
        camera_(*input.camera),
        reach_px_(FilterSampler(settings_.film.filter).radius_px()),
        width_(static_cast<float>(settings_.film.width) - 1 + 2 * reach_px_),
        height_(static_cast<float>(settings_.film.height) - 1 + 2 * reach_px_),
        paths_(input) {
    RenderSettings settings;
    unscattered_ = find_integrator("bdpt")->make(without_scattering(input, settings));
  }

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override {
    return unscattered_->trace(camera_ray, sampler, rays);
  }
  bool has_chains() const noexcept override { return true; }
  void trace_chain(const ChainStart& from, std::uint64_t& rays,
                   CameraSplats& splats) const override;

 private:
  std::uint64_t seed_of(const ChainStart& from) const noexcept;
  /// Draws the start of both subpaths. film_px: position of the camera ray.
  SubpathPair subpaths(ChainNumbers& numbers, Vec2& film_px) const;
  /// Computes the contribution of the state's strategy.
  void evaluate(ChainNumbers& numbers, State& state, std::uint64_t& rays,
                const CameraSplats& film) const;
  /// Follows a chain from the last start of `numbers`. scale: weight of a state of luminance 1.
  void follow_chain(ChainNumbers& numbers, SubpathLengths strategy, double scale,
                    std::uint64_t choices, std::uint64_t& rays, CameraSplats& splats) const;

  RenderSettings settings_;
  const Camera& camera_;
  // Camera rays start on the film, extended as far as filters reach.
  float reach_px_;
  float width_;
  float height_;
  BidirectionalPathTracer paths_;
  std::unique_ptr<const Integrator> unscattered_;  ///< bdpt at depth 0
};

std::uint64_t Metropolis::seed_of(const ChainStart& from) const noexcept {
  const auto replicates = static_cast<std::uint32_t>(settings_.replicates);
  const auto sample = static_cast<std::uint32_t>(from.sample);
  const std::uint32_t replicate =
      static_cast<std::uint32_t>(settings_.first_replicate) + sample % replicates;
  std::uint64_t seed = mix_bits(settings_.seed | kChainStream);
  for (const std::uint32_t name :
       {static_cast<std::uint32_t>(from.x), static_cast<std::uint32_t>(from.y), replicate,
        sample / replicates}) {
    seed = hash_combine(seed, name);
  }
  return seed;
}

SubpathPair Metropolis::subpaths(ChainNumbers& numbers, Vec2& film_px) const {
  const PathSampler from_camera(numbers, kCameraNumbers);
  const Vec4 u = from_camera.get_4d(kCameraGroup);
  film_px = {0.5F - reach_px_ + u.x * width_, 0.5F - reach_px_ + u.y * height_};
  return {camera_.ray(film_px, {u.z, u.w}), from_camera, PathSampler(numbers, kLightNumbers)};
}

void Metropolis::evaluate(ChainNumbers& numbers, State& state, std::uint64_t& rays,
                          const CameraSplats& film) const {
  Vec2 film_px;
  const SubpathPair from = subpaths(numbers, film_px);
  state.reset(film_px, width_ * height_);
  paths_.trace_strategies(from, {state.strategy()}, rays, film, state);
}

void Metropolis::follow_chain(ChainNumbers& numbers, SubpathLengths strategy, double scale,
                              std::uint64_t choices, std::uint64_t& rays,
                              CameraSplats& splats) const {
  State current(strategy);
  State proposed(strategy);
  evaluate(numbers, current, rays, splats);
  double weight = 0;  // accumulated by the current state
  for (int i = 1; i <= kChainStates; ++i) {
    const Vec4 u = uniform_4d(choices, static_cast<std::uint64_t>(i));
    numbers.propose(u.x < kLargeStep);
    evaluate(numbers, proposed, rays, splats);
    const double accept =
        current.light() > 0 ? std::min(1.0, proposed.light() / current.light()) : 1;
    const double to_proposed = proposed.light() > 0 ? accept * scale / proposed.light() : 0;
    weight += current.light() > 0 ? (1 - accept) * scale / current.light() : 0;
    if (static_cast<double>(u.y) < accept) {
      current.add_to(splats, weight);
      std::swap(current, proposed);
      weight = to_proposed;
      numbers.accept();
    } else {
      proposed.add_to(splats, to_proposed);
      numbers.reject();
    }
  }
  current.add_to(splats, weight);
}

void Metropolis::trace_chain(const ChainStart& from, std::uint64_t& rays,
                             CameraSplats& splats) const {
  if (settings_.max_depth == 0) {
    return;
  }
  const std::uint64_t seed = seed_of(from);
  const std::uint64_t first = hash_combine(seed, 1);
  const std::uint64_t choices = hash_combine(seed, 2);
  ChainNumbers numbers(hash_combine(seed, 3));
  const auto trace_sample = [&](std::ptrdiff_t i) {
    numbers.start(hash_combine(first, static_cast<std::uint64_t>(i)));
    Vec2 film_px;
    const SubpathPair subpath = subpaths(numbers, film_px);
    StrategyChoice light(width_ * height_);
    paths_.trace_strategies(subpath, {}, rays, splats, light);
    return light;
  };
  const int samples = std::max(kFirstSamples, from.mutations);
  std::vector<double> sums;
  double sum = 0;
  for (int i = 0; i < samples; ++i) {
    sum += trace_sample(i).sum();
    sums.push_back(sum);
  }
  if (!(sum > 0)) {
    return;
  }
  const int chains = std::max(1, kStatesPerPixel * from.mutations / kChainStates);
  // The film expects the light of `from.mutations` paths.
  const double scale =
      sum / samples * from.mutations / (static_cast<double>(chains) * kChainStates);
  const auto shift = static_cast<double>(uniform_4d(choices, 0).x);
  for (int chain = 0; chain < chains; ++chain) {
    const double pick = (chain + shift) / chains * sum;
    const auto taken = std::upper_bound(sums.begin(), sums.end() - 1, pick) - sums.begin();
    const StrategyChoice light = trace_sample(taken);
    const std::uint64_t own = hash_combine(choices, static_cast<std::uint64_t>(chain) + 1);
    follow_chain(numbers, light.draw(static_cast<double>(uniform_4d(own, 0).x)), scale, own, rays,
                 splats);
  }
}

}  // namespace

std::unique_ptr<const Integrator> make_metropolis(const IntegratorInput& input) {
  return std::make_unique<Metropolis>(input);
}

}  // namespace core
