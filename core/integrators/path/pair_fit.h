/// Records the data of a path for coefficients fitted per pixel (core/film/replicate_fit.h).
#pragma once

#include "core/color/rgb.h"
#include "core/film/replicate_fit.h"

namespace core {

/// Optimal MIS: records a sample that has both densities, whether it is a light or a BSDF sample.
/// value: f / m; weight_light: p / m. Other light samples (delta lights, black, occluded or partly
/// transparent) have weight 1, and such BSDF samples weight 0, so they need not be recorded: the
/// other technique lacks these outcomes, and densities still integrate to 1.
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

/// Optimal MIS: records the light sample of a vertex, and that a BSDF sample belongs to it.
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

/// Regression: records a light sample and its control variate, whose coefficient is fitted by
/// luminance.
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

/// Adds one of several branches, averaged with weight `share`.
inline void add_branch(FitSample& fit, const FitSample& branch, float share) noexcept {
  fit = {.control = fit.control + branch.control * share,
         .n = fit.n + branch.n,
         .x = fit.x + branch.x,
         .xx = fit.xx + branch.xx,
         .y = fit.y + branch.y,
         .xy = fit.xy + branch.xy};
}

}  // namespace core
