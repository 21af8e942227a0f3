/// Trial: the random numbers of one replicate, from the renderer's sampler, and its counters.
#pragma once

#include <cstdint>
#include <stop_token>

#include "core/lab/experiment.h"
#include "core/samplers/path_sampler.h"

namespace core::lab {

class Trial {
 public:
  Trial(const Setup& setup, std::int64_t n, std::uint64_t seed, const std::stop_token& stop)
      : setup_(setup),
        n_(n),
        stop_(stop),
        seed_(seed),
        sampler_(setup.sampler, 1, seed),
        set_(n_set(setup.sampler, n)) {}

  const Setup& setup() const noexcept { return setup_; }
  std::int64_t n() const noexcept { return n_; }
  std::size_t estimator() const noexcept { return setup_.estimator; }
  double parameter(std::size_t i) const noexcept { return setup_.parameters[i]; }
  int whole(std::size_t i) const noexcept { return setup_.whole(i); }

  /// Selects the numbers of evaluation i. Once the run is cancelled it always returns false, and
  /// the trial should end.
  bool start(std::int64_t i) noexcept { return start_at(0, i); }
  /// As start(), for evaluation i of stream x; streams are independent randomisations (pixels).
  bool start_at(std::int64_t x, std::int64_t i) noexcept;
  Vec4 get_4d(int group) const noexcept {
    return set_ > 0 ? whole_set_4d(group) : sampler_.get_4d(group);
  }
  /// Returns a number independent of get_4d().
  float extra_1d(std::uint32_t index) const noexcept { return sampler_.extra_1d(0, index); }

  /// Adds work in units chosen by the experiment. If it is never called, each evaluation counts 1.
  void add_cost(double units) noexcept { cost_ += units; }
  double cost() const noexcept { return cost_ > 0 ? cost_ : static_cast<double>(n_); }

  /// Rounds n for samplers with fixed sets. The renderer draws stratified points, Latin hypercubes
  /// and orthogonal arrays in small sets, so that an image can be extended; here a trial is one set
  /// of all n points, from the same functions.
  static std::int64_t rounded(SamplerType sampler, std::int64_t n);

 private:
  /// Returns the points of such a set; 0 if the sampler works as in the renderer. Beyond 2^20
  /// points there are several sets.
  static std::int64_t n_set(SamplerType sampler, std::int64_t n);
  Vec4 whole_set_4d(int group) const noexcept;

  const Setup& setup_;
  std::int64_t n_;
  const std::stop_token& stop_;
  std::uint64_t seed_;
  PathSampler sampler_;
  std::int64_t set_;
  std::uint64_t key_ = 0;    ///< selects the set
  std::uint32_t index_ = 0;  ///< within the set
  std::uint32_t starts_ = 0;
  bool is_stopped_ = false;
  double cost_ = 0;
};

/// Returns the mean of f() over the n evaluations; unspecified if cancelled.
template <typename F>
double mean_of(Trial& trial, F&& f) {
  double sum = 0;
  for (std::int64_t i = 0; i < trial.n(); ++i) {
    if (!trial.start(i)) {
      return 0;
    }
    sum += f();
  }
  return sum / static_cast<double>(trial.n());
}

}  // namespace core::lab
