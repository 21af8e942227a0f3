// Warnings about settings that have no effect on a job, and about the file of its scene.
#include <algorithm>
#include <span>
#include <string>
#include <vector>

#include "api/answers/job_view.h"
#include "api/job/job_spec.h"
#include "core/film/replicate_fit.h"
#include "core/integrators/registry.h"
#include "core/render/task/pass_plan.h"
#include "core/settings/choices.h"

namespace api {
namespace {

template <typename Value>
std::string quoted_name(std::span<const core::NamedValue<Value>> rows, Value value) {
  return "'" + std::string(core::row_of(rows, value).name) + "'";
}

}  // namespace

std::vector<std::string> adaptive_warnings(const JobSpec& spec) {
  std::vector<std::string> warnings;
  const core::AdaptiveSettings& adaptive = spec.render.adaptive;
  if (adaptive.type == core::AdaptiveType::kNone) {
    return warnings;
  }
  const int first = core::first_epoch(spec.render);
  const core::RenderSettings usual = core::default_settings(
      spec.render.integrator, {.has_error_target = spec.stop.relative_error.has_value()});
  if (adaptive.type != usual.adaptive.type && spec.stop.samples_per_pixel &&
      *spec.stop.samples_per_pixel <= first) {
    warnings.push_back(
        "adaptive: every pixel gets the same number of samples, because the first decision is made "
        "at " +
        std::to_string(first) + " samples and " + std::to_string(*spec.stop.samples_per_pixel) +
        " are asked for.");
  }
  return warnings;
}

std::vector<std::string> idle_warnings(const JobSpec& spec) {
  std::vector<std::string> warnings;
  const core::RenderSettings& render = spec.render;
  const core::EstimatorSettings& estimator = render.estimator;
  if (estimator.strategy != core::Strategy::kMis && estimator.strategy != core::Strategy::kLight) {
    const std::string strategy = quoted_name(core::strategies(), estimator.strategy);
    if (render.light_sampler !=
        core::default_settings(render.integrator, core::kJobTerms).light_sampler) {
      warnings.push_back(
          "light_sampler: " + quoted_name(core::light_samplers(), render.light_sampler) +
          " has no effect: strategy " + strategy +
          " samples no lights except punctual lights, which it selects uniformly.");
    }
    if (estimator.roulette == core::RouletteType::kThreshold) {
      warnings.push_back(
          "estimator.roulette: 'threshold' applies to the shadow rays of light samples, and "
          "strategy " +
          strategy + " uses none except those of punctual lights.");
    }
  }
  if (!render.film.motion && spec.motion_seconds != JobSpec{}.motion_seconds) {
    warnings.emplace_back("motion_seconds has no effect: film.layers has no 'motion'.");
  }
  if (render.film.motion && !spec.time_seconds) {
    warnings.emplace_back(
        "film.layers: 'motion' is 0 everywhere: time_seconds is null, the rest "
        "pose.");
  }
  for (const core::LightShare& share : render.film.shares) {
    const int scatterings =
        share.strategy ? share.strategy->light + share.strategy->camera - 2 : share.first_bounce;
    if (scatterings > render.max_depth) {
      warnings.push_back("film.layers: '" + share.layer + "' is black: paths have at most " +
                         std::to_string(render.max_depth) +
                         " scattering events (integrator.max_depth).");
    }
  }
  const int learnt = static_cast<int>(core::kFirstFit) * render.replicates;
  if (estimator.control_variate == core::ControlVariateType::kRegression &&
      spec.stop.samples_per_pixel && *spec.stop.samples_per_pixel <= learnt) {
    warnings.push_back(
        "estimator.control_variate: 'regression' has no effect: it learns from the first " +
        std::to_string(learnt) + " samples of a pixel, and " +
        std::to_string(*spec.stop.samples_per_pixel) + " are asked for.");
  }
  return warnings;
}

void add_warning(JobView& job, const core::Warning& warning) {
  const std::string text = warning.text();
  if (std::find(job.warnings.begin(), job.warnings.end(), text) == job.warnings.end()) {
    job.warnings.push_back(text);
    job.warning_details.push_back(warning);
  }
}

}  // namespace api
