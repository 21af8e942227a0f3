/// Candidates for resampled importance sampling of lights (Talbot 2005).
///
/// The candidates y_i, i < M, together have the light sampler's density p. Let g(y) = w(y) f(y)
/// L(y) be the unshadowed light times the MIS weight w of M samples of p against one sample of the
/// BSDF's density, and t_i = |g(y_i)| / p(y_i). Candidate j is selected with probability t_j / sum
/// t, and its g/p is multiplied by sum t / (M t_j). Given the candidates, the mean of the
/// contribution is (1/M) sum V(y_i) g(y_i) / p(y_i), where V is visibility, and over candidates it
/// is the integral of V g. Weights are computed before the selection from known densities, so BSDF
/// samples get 1 - w, both together give the integral of V f L, and the density of the selected
/// candidate, which has no closed form, is not needed.
#pragma once

#include <type_traits>

#include "core/color/lane_color.h"
#include "core/math/generic.h"
#include "core/math/numbers.h"

namespace core {

/// Returns the magnitude of a contribution; positive for any value that is not black, of either
/// sign.
template <typename C>
auto size_of(C value) noexcept {
  return luminance(magnitudes(value));
}

/// Returns x modulo 1, for x >= 0.
template <typename F>
F fraction(F x) noexcept {
  return x - to_floats(truncated(x));
}

template <typename F>
struct CandidateOf {
  F pick;           ///< selects the light
  Vec2Of<F> place;  ///< on the light
};

/// Returns candidate k of `count`; u is uniform in [0,1)^3: a Vec4 or its lanes. The light is
/// picked in stratum k, and the point on it by an R2 sequence (Roberts 2018), so that all
/// candidates together have the light sampler's density.
template <typename U>
auto candidate(const U& u, int k, int count) noexcept {
  using F = std::remove_cvref_t<decltype(u.x)>;
  const auto i = static_cast<float>(k);
  return CandidateOf<F>{min((u.x + F(i)) / F(static_cast<float>(count)), F(kOneMinusEpsilon)),
                        {fraction(u.y + F(i * 0.754877666F)), fraction(u.z + F(i * 0.569840291F))}};
}

}  // namespace core
