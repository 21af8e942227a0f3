// Metropolis light transport in primary sample space: a Markov chain of paths with small and large
// mutations, which spends its time where light is. A state is the contribution of one camera
// subpath and the light subpaths of bdpt, anywhere on the film.
//
// Chains are short, many and independent: each starts with samples of its own, one of which is
// drawn in proportion to its light, and the mean of these samples normalises the chain. So there is
// no start-up bias, and the halves of a job are independent.
//
// Sources: Kelemen and others 2002, "A Simple and Robust Mutation Strategy for the Metropolis Light
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
/// Minimum number of samples that a chain starts with; otherwise a quarter of its length.
constexpr int kFirstSamples = 64;
/// Streams of one state: the camera path with its light subpath, and the splatted light path.
constexpr std::uint64_t kCameraNumbers = 1;
constexpr std::uint64_t kLightNumbers = 2;

Vec4 uniform_4d(std::uint64_t a, std::uint64_t b) noexcept {
  const std::uint64_t h = hash_combine(a, b);
  return PathSampler::independent_4d(h, mix_bits(h + 0x632be59bd9b4e019ULL));
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

/// The contributions of a state to the film.
struct State {
  struct Part {
    Vec2 film_px;
    Rgb value;
  };
  std::vector<Part> parts;
  double light = 0;  ///< total luminance; chains visit states in proportion to it
};

/// Records the splats of light paths.
class NotedSplats final : public CameraSplats {
 public:
  NotedSplats(const CameraSplats& film, State& to) : film_(film), to_(to) {}
  const Camera& camera() const noexcept override { return film_.camera(); }
  bool reaches(Vec2 film_px) const noexcept override { return film_.reaches(film_px); }
  void add(Vec2 film_px, Rgb value) noexcept override { to_.parts.push_back({film_px, value}); }

 private:
  const CameraSplats& film_;
  State& to_;
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
        paths_(make_bdpt(input)) {
    RenderSettings settings;
    unscattered_ = make_bdpt(without_scattering(input, settings));
  }

  PathSample trace(const Camera::CameraRay& camera_ray, const PathSampler& sampler,
                   std::uint64_t& rays) const noexcept override {
    return unscattered_->trace(camera_ray, sampler, rays);
  }
  bool has_chains() const noexcept override { return true; }
  void trace_chain(const ChainStart& from, std::uint64_t& rays,
                   CameraSplats& splats) const override;

 private:
  void evaluate(ChainNumbers& numbers, State& out, std::uint64_t& rays,
                const CameraSplats& splats) const;

  RenderSettings settings_;
  const Camera& camera_;
  float reach_px_;
  std::unique_ptr<const Integrator> paths_;
  std::unique_ptr<const Integrator> unscattered_;  ///< the same integrator at depth 0
};

void Metropolis::evaluate(ChainNumbers& numbers, State& out, std::uint64_t& rays,
                          const CameraSplats& splats) const {
  out.parts.clear();
  const PathSampler camera_numbers(numbers, kCameraNumbers);
  const Vec4 u = camera_numbers.get_4d(kCameraGroup);
  // Extends beyond the film as far as filters reach.
  const float width = static_cast<float>(settings_.film.width) - 1 + 2 * reach_px_;
  const float height = static_cast<float>(settings_.film.height) - 1 + 2 * reach_px_;
  const Vec2 film_px = {0.5F - reach_px_ + u.x * width, 0.5F - reach_px_ + u.y * height};
  const Camera::CameraRay ray = camera_.ray(film_px, {u.z, u.w});
  const Rgb all = paths_->trace(ray, camera_numbers, rays).radiance;
  const Rgb seen = unscattered_->trace(ray, camera_numbers, rays).radiance;
  out.parts.push_back({film_px, (all - seen) * (width * height)});
  NotedSplats noted(splats, out);
  paths_->trace_light(PathSampler(numbers, kLightNumbers), rays, noted);
  out.light = 0;
  for (State::Part& part : out.parts) {
    if (!is_finite(part.value)) {
      part.value = {};
    }
    const Rgb size = {std::fabs(part.value.r), std::fabs(part.value.g), std::fabs(part.value.b)};
    out.light += static_cast<double>(luminance(size));
  }
}

void add_parts(const State& state, double weight, CameraSplats& splats) {
  for (const State::Part& part : state.parts) {
    if (weight > 0 && !is_black(part.value)) {
      splats.add(part.film_px, part.value * static_cast<float>(weight));
    }
  }
}

void Metropolis::trace_chain(const ChainStart& from, std::uint64_t& rays,
                             CameraSplats& splats) const {
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
  const std::uint64_t first = hash_combine(seed, 1);
  const std::uint64_t choices = hash_combine(seed, 2);

  ChainNumbers numbers(hash_combine(seed, 3));
  State current;
  const int count = std::max(kFirstSamples, from.mutations / 4);
  std::vector<double> light;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    numbers.start(hash_combine(first, static_cast<std::uint64_t>(i)));
    evaluate(numbers, current, rays, splats);
    sum += current.light;
    light.push_back(sum);
  }
  if (!(sum > 0)) {
    return;
  }
  const double mean = sum / count;
  const double pick = static_cast<double>(uniform_4d(choices, 0).x) * sum;
  const auto taken = std::upper_bound(light.begin(), light.end() - 1, pick) - light.begin();
  numbers.start(hash_combine(first, static_cast<std::uint64_t>(taken)));
  evaluate(numbers, current, rays, splats);

  State proposed;
  double weight = 0;  // accumulated by the current state
  for (int i = 1; i <= from.mutations; ++i) {
    const Vec4 u = uniform_4d(choices, static_cast<std::uint64_t>(i));
    numbers.propose(u.x < kLargeStep);
    evaluate(numbers, proposed, rays, splats);
    const double accept = current.light > 0 ? std::min(1.0, proposed.light / current.light) : 1;
    const double to_proposed = proposed.light > 0 ? accept * mean / proposed.light : 0;
    weight += current.light > 0 ? (1 - accept) * mean / current.light : 0;
    if (static_cast<double>(u.y) < accept) {
      add_parts(current, weight, splats);
      std::swap(current, proposed);
      weight = to_proposed;
      numbers.accept();
    } else {
      add_parts(proposed, to_proposed, splats);
      numbers.reject();
    }
  }
  add_parts(current, weight, splats);
}

}  // namespace

std::unique_ptr<const Integrator> make_metropolis(const IntegratorInput& input) {
  return std::make_unique<Metropolis>(input);
}

}  // namespace core
