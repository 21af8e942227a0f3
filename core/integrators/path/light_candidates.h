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

#include <algorithm>

#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

/// Returns x modulo 1, for x >= 0.
constexpr float fraction(float x) {
  return x < 1 ? x : x - static_cast<float>(static_cast<int>(x));
}

struct Candidate {
  float pick = 0;  ///< selects the light
  Vec2 place;      ///< on the light
};

/// Returns candidate k of `count`; u is uniform in [0,1)^3. The light is picked in stratum k, and
/// the point on it by an R2 sequence (Roberts 2018), so that all candidates together have the light
/// sampler's density.
inline Candidate candidate(Vec4 u, int k, int count) {
  const auto i = static_cast<float>(k);
  return {std::min((u.x + i) / static_cast<float>(count), kOneMinusEpsilon),
          {fraction(u.y + i * 0.754877666F), fraction(u.z + i * 0.569840291F)}};
}

}  // namespace core
