/// Candidates of resampled importance sampling of the lights (Talbot 2005).
///
/// The candidates y_i, i < M, together follow the light sampler's density p. Let
/// g(y) = w(y) f(y) L(y) be the light without shadows times the weight w that MIS gives M samples
/// of p beside one of the BSDF's density, and t_i = |g(y_i)| / p(y_i). Candidate j is taken with
/// probability t_j / sum t, and its g/p is multiplied by sum t / (M t_j), so that, given the
/// candidates, the mean of what is added is (1/M) sum V(y_i) g(y_i) / p(y_i), V being visibility,
/// and over candidates the integral of V g. Weights are taken before the choice, with densities
/// that are known, so BSDF samples get 1 - w, both together the integral of V f L, and the density
/// of the taken candidate, which has no closed form, is never asked for.
#pragma once

#include <algorithm>

#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

/// x modulo 1, for x >= 0.
constexpr float fraction(float x) {
  return x < 1 ? x : x - static_cast<float>(static_cast<int>(x));
}

struct Candidate {
  float pick = 0;  ///< chooses the light
  Vec2 place;      ///< on the light
};

/// Candidate k of `count`, u being uniform in [0,1)^3: it picks its light in stratum k, and its
/// place on the light by an R2 sequence (Roberts 2018), so that all of them together follow the
/// light sampler's density.
inline Candidate candidate(Vec4 u, int k, int count) {
  const auto i = static_cast<float>(k);
  return {std::min((u.x + i) / static_cast<float>(count), kOneMinusEpsilon),
          {fraction(u.y + i * 0.754877666F), fraction(u.z + i * 0.569840291F)}};
}

}  // namespace core
