/// Records of a path for coefficients that are fitted for each pixel (core/film/replicate_fit.h).
#pragma once

#include <cmath>

#include "core/color/rgb.h"
#include "core/film/replicate_fit.h"

namespace core {

/// How much a contribution weighs; above 0 for all that is not black, of whatever sign.
inline float size_of(Rgb c) { return luminance({std::fabs(c.r), std::fabs(c.g), std::fabs(c.b)}); }

/// Optimal MIS: a sample that has both densities, as light and as BSDF sample. value: f / m;
/// weight_light: p / m. Light samples of anything else (delta lights, black, occluded or not quite
/// clear) count with all of the weight, such BSDF samples with none and need not be noted: the
/// other technique does not have those outcomes, so densities integrate to 1 all the same.
inline void note_pair(FitSample& fit, float weight_light, Rgb value) noexcept {
  if (is_black(value)) {
    return;
  }
  fit.control += Rgb(weight_light);
  fit.x += weight_light;
  fit.xx += weight_light * weight_light;
  fit.y += value;
  fit.xy += value * weight_light;
}

/// Optimal MIS: the light sample of a vertex, and that a BSDF sample belongs to it.
inline void note_light_sample(FitSample& fit, float weight_light, Rgb value,
                              bool in_pair) noexcept {
  fit.n += 2;
  fit.control += Rgb(-1);
  if (in_pair && !is_black(value)) {
    note_pair(fit, weight_light, value);
  } else {
    fit.control += Rgb(1);
    fit.x += 1;
    fit.xx += 1;
  }
}

/// Regression: a light sample and its control variate, whose factor is fitted by luminance.
inline void note_control(FitSample& fit, Rgb control, Rgb value) noexcept {
  const float x = luminance(control);
  const float y = luminance(value);
  fit.n += 1;
  fit.control += control;
  fit.x += x;
  fit.xx += x * x;
  fit.y += Rgb(y);
  fit.xy += Rgb(x * y);
}

/// One of several branches, averaged with weight `share`.
inline void add_branch(FitSample& fit, const FitSample& branch, float share) noexcept {
  fit = {.control = fit.control + branch.control * share,
         .n = fit.n + branch.n,
         .x = fit.x + branch.x,
         .xx = fit.xx + branch.xx,
         .y = fit.y + branch.y,
         .xy = fit.xy + branch.xy};
}

}  // namespace core
