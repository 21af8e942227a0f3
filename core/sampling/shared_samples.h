/// SharedSamples: the weights with which several paths use each other's samples.
///
/// Path j drew sample j, which represents M_j draws, in a measure that all paths share. t_i(y) is
/// proportional to the density with which path i draws y; it may be approximate, but must be 0
/// wherever path i cannot draw. A path that uses the samples of the set N gives sample j of N the
/// weight
///
///     m_j = M_j t_j(y_j) / sum_{i in N} M_i t_i(y_j),
///
/// the balance heuristic: as functions of y the m_j sum to 1 wherever any path of N can draw, so
/// the sum of m_j g(y_j) W_j has the integral of g as its mean if E[W_j | y_j] is one over the
/// density of y_j. N must not depend on the samples. Weights without t, M_j / sum M_i, are biased:
/// they count paths that could never have drawn y_j. Sources: Bitterli et al., Spatiotemporal
/// reservoir resampling for real-time ray tracing, 2020; Lin et al., Generalized resampled
/// importance sampling, 2022.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/settings/sample_sets.h"

namespace core {

class SharedSamples {
 public:
  static constexpr std::size_t kMost = kSharedPathsMost;

  SharedSamples() : densities_(kMost * kMost) {}

  /// Clears all densities. count <= kMost: number of paths, and of samples.
  void start(std::size_t count) noexcept {
    count_ = count;
    users_ = 0;
  }
  /// density: M t >= 0 of a path at a sample. Set all pairs before calling weight().
  void set(std::size_t path, std::size_t sample, float density) noexcept {
    densities_[path * count_ + sample] = density;
  }

  /// Sets N: bit i selects path i.
  void choose(std::uint64_t users) noexcept {
    if (users == users_) {
      return;
    }
    users_ = users;
    sums_.fill(0);
    for (std::size_t i = 0; i < count_; ++i) {
      for (std::size_t j = 0; j < count_ && has(users, i); ++j) {
        sums_[j] += densities_[i * count_ + j];
      }
    }
  }
  /// Returns m of sample j for the selected N; 0 if j is not in N or could not have drawn its
  /// sample.
  float weight(std::size_t j) const noexcept {
    const float own = densities_[j * count_ + j];
    return has(users_, j) && own > 0 ? own / sums_[j] : 0.0F;
  }

  static constexpr bool has(std::uint64_t set, std::size_t i) noexcept {
    return (set >> i & 1U) != 0;
  }

 private:
  std::vector<float> densities_;  ///< [path * count + sample]
  std::array<float, kMost> sums_{};
  std::size_t count_ = 0;
  std::uint64_t users_ = 0;
};

}  // namespace core
