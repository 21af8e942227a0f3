#include "core/render/task/pass_policy.h"

#include <algorithm>
#include <cmath>

#include "core/integrators/registry.h"
#include "core/render/task/pass_plan.h"
#include "core/settings/sample_sets.h"

namespace core {
namespace {

/// Per octave of samples: denoising takes as long as some samples of the image, so more checks
/// would cost more than they save.
constexpr int kDenoisedChecks = 2;
/// No error target ends a job earlier: fewer samples miss rare light.
constexpr int kSamplesBeforeErrorStop = 4;

}  // namespace

PassPolicy::PassPolicy(const RenderSettings& settings, const StopRules& stop, int samples_limit)
    : stop_(stop),
      replicates_(settings.replicates),
      unit_(sample_unit(settings)),
      samples_max_(whole_sets(samples_limit, unit_)),
      one_by_one_(integrator_has_prepass(settings)),
      asked_(false) {
  if (stop.samples_per_pixel) {
    const int asked = rounded_samples(settings, *stop.samples_per_pixel);
    asked_ = asked <= samples_limit;
    samples_max_ = std::min(samples_max_, asked);
  }
  samples_max_ = std::max(samples_max_, 1);
}

int PassPolicy::barrier(const Pass& pass) const {
  if (one_by_one_) {
    const int end = pass.base < pass.target ? pass.target : pass.target + 1;
    return std::max(std::min(end, samples_max_), pass.target);
  }
  if (has_clock()) {  // one pass at a time, so that the last complete one can be kept
    const int end = pass.base < pass.target
                        ? pass.target
                        : pass_end(pass.target, samples_max_, replicates_, unit_);
    return std::max(std::min(end, pass.planned_to), pass.target);
  }
  const int check = next_check(pass.base, replicates_, unit_);
  return std::max(std::min({check, samples_max_, pass.planned_to}), pass.target);
}

int PassPolicy::next_target(const Pass& pass) const {
  return std::min(pass_end(pass.target, samples_max_, replicates_, unit_), barrier(pass));
}

int PassPolicy::far_target(const Pass& pass) const {
  if (one_by_one_ || has_clock()) {
    return next_target(pass);
  }
  const int near = barrier(pass);
  if (stop_.has_error_target() || stop_.meter_error || stop_.light_not_found) {
    return near;
  }
  // The first image should come as early as without other machines.
  const int octave = next_check(pass.base, replicates_, unit_, 1);
  const int far = pass.base > 0 ? next_check(octave, replicates_, unit_, 1) : octave;
  const int end = std::min(samples_max_, pass.planned_to);
  // Avoids a short last pass.
  const bool is_last = far >= end || (pass.base > 0 && far >= end - far);
  return std::max(near, is_last ? end : far);
}

bool PassPolicy::checks_at(int samples) const {
  return samples >= samples_max_ || next_check(samples - 1, replicates_, unit_) == samples;
}

int PassPolicy::stop_at(double samples) const {
  const double least = std::max(samples, static_cast<double>(kSamplesBeforeErrorStop));
  // If the error has no bound, the count is infinite or NaN.
  return least < samples_max_
             ? std::min(next_check(static_cast<int>(std::ceil(least)) - 1, replicates_, unit_),
                        samples_max_)
             : samples_max_;
}

double PassPolicy::error_bound(const ErrorEstimate& check) const {
  // No correction for repeated checks: the noise of the interval's end is small beside its doubt.
  return stop_.worst_tile ? check.worst_tile(stop_.confidence) : check.image(stop_.confidence).high;
}

bool PassPolicy::may_stop_at(int samples) const {
  return samples >= std::min(kSamplesBeforeErrorStop, samples_max_);
}

bool PassPolicy::denoises_at(int samples) const {
  return stop_.denoised_error && may_stop_at(samples) &&
         (samples >= samples_max_ ||
          next_check(samples - 1, replicates_, unit_, kDenoisedChecks) == samples);
}

StopReason PassPolicy::decide(int samples, double bound, double denoised_bound,
                              double at_most) const {
  const bool may_stop = may_stop_at(samples) && allows_missing(at_most);
  if (stop_.relative_error && may_stop && bound <= *stop_.relative_error) {
    return StopReason::kRelativeError;
  }
  if (stop_.denoised_error && may_stop && denoised_bound <= *stop_.denoised_error) {
    return StopReason::kDenoisedError;
  }
  if (stop_.light_not_found && may_stop && !stop_.has_error_target() && !stop_.meter_error) {
    return StopReason::kLightNotFound;
  }
  if (samples >= samples_max_) {
    return asked_ ? StopReason::kSamples : StopReason::kLimit;
  }
  return StopReason::kNone;
}

}  // namespace core
