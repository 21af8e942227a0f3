#include "core/integrators/path/path_options.h"

namespace core {

StudyOptions::StudyOptions(const RenderSettings& s)
    : strategy(s.estimator.strategy),
      mis(s.estimator.mis == MisType::kOptimal
              ? DefaultOptions::mis
              : MisRule{s.estimator.mis, s.estimator.mis_exponent}),
      roulette(s.estimator.roulette),
      control_variate(s.estimator.control_variate),
      fit(fit_type(s)),
      shadow_threshold(roulette == RouletteType::kThreshold ? s.estimator.roulette_delta : 0.0F),
      candidates(light_reuse(s.light_sampler) == LightReuse::kResample ? s.light_candidates : 1),
      first_candidates(light_reuse(s.light_sampler) == LightReuse::kShare ? s.block_candidates
                                                                          : candidates),
      expected_values(s.estimator.expected_values),
      split_count(s.estimator.splitting == SplittingType::kFixed ? s.estimator.split_count : 1),
      max_depth(s.max_depth) {}

DefaultOptions::DefaultOptions(const RenderSettings& settings)
    : split_count(StudyOptions(settings).split_count), max_depth(settings.max_depth) {}

bool has_default_estimators(const RenderSettings& settings) {
  using D = DefaultOptions;
  const StudyOptions asked(settings);
  const bool power_of_two = asked.mis.type == D::mis.type && asked.mis.exponent == D::mis.exponent;
  return asked.strategy == D::strategy && power_of_two && asked.roulette == D::roulette &&
         asked.control_variate == D::control_variate && asked.fit == D::fit &&
         asked.expected_values == D::expected_values &&
         light_reuse(settings.light_sampler) != LightReuse::kShare;
}

bool DefaultOptions::serves(const RenderSettings& settings) {
  return has_default_estimators(settings) && !settings.spectral &&
         StudyOptions(settings).candidates == candidates;
}

bool DefaultOptions::serves(const IntegratorInput& input) {
  return serves(input.settings) && !needs_whole_options(input);
}

bool needs_whole_options(const IntegratorInput& input) {
  return input.scene.has_scattering || input.settings.fog || !input.settings.film.shares.empty();
}

SkyDensity sky_density(const RenderSettings& settings) {
  const StudyOptions asked(settings);
  const bool stands_alone = asked.fit == FitType::kNone && asked.candidates == 1 &&
                            asked.first_candidates == 1 &&
                            asked.control_variate == ControlVariateType::kNone &&
                            light_reuse(settings.light_sampler) != LightReuse::kShare;
  return asked.strategy == Strategy::kMis && stands_alone ? SkyDensity::kCompensated
                                                          : SkyDensity::kRadiance;
}

}  // namespace core
