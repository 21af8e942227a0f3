/// Multiple importance sampling weights for two techniques of one sample each.
/// Source: Veach, Robust Monte Carlo Methods for Light Transport Simulation, 1997, section 9.2.
#pragma once

#include <cmath>

#include "core/math/generic.h"
#include "core/settings/settings.h"

namespace core {

/// Returns the weight of a sample of technique a by the power heuristic with exponent 2.
template <typename F>
F power_heuristic(F pdf_a, F pdf_b) noexcept {
  return select(pdf_b > 0, 1 / (1 + square(pdf_b / pdf_a)), F(1));
}

struct MisRule {
  MisType type = MisType::kPower;
  float exponent = 2;

  /// Returns the weight of a sample of technique a; pdf_a > 0 and pdf_b >= 0 are in the same
  /// measure. kOptimal is not a heuristic: its samples have the weights of kBalance, and
  /// core/film/replicate_fit.h does the rest.
  float weight(float pdf_a, float pdf_b) const noexcept {
    if (!(pdf_b > 0)) {
      return 1;
    }
    const float ratio = pdf_b / pdf_a;
    switch (type) {
      case MisType::kBalance:
      case MisType::kOptimal:
        return 1 / (1 + ratio);
      case MisType::kMaximum:
        return ratio < 1 ? 1.0F : (ratio > 1 ? 0.0F : 0.5F);
      case MisType::kPower:
        break;
    }
    if (exponent == 2) {
      return power_heuristic(pdf_a, pdf_b);
    }
    return 1 / (1 + std::pow(ratio, exponent));
  }
};

}  // namespace core
