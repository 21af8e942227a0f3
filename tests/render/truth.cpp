#include "tests/render/truth.h"

#include "core/settings/choices.h"

namespace test_support {

std::vector<Variant> variants() {
  std::vector<Variant> all;
  for (const auto& strategy : core::strategies()) {
    for (const auto& lights : core::light_samplers()) {
      Variant v{std::string(strategy.name) + "/" + std::string(lights.name), {}};
      v.estimator.strategy = strategy.value;
      v.light_sampler = lights.value;
      const bool resamples = light_reuse(lights.value) != core::LightReuse::kNone;
      if (is_blind(v) && resamples) {
        continue;  // light samples of punctual lights: same as for the others
      }
      if (lights.value == core::LightSamplerType::kMeasured) {
        continue;  // tree or ris: choose_light_sampler_test.cpp
      }
      all.push_back(v);
    }
  }
  for (const auto& mis : core::mis_types()) {
    for (const float exponent : {1.0F, 4.0F}) {
      Variant v{std::string(mis.name) + " exponent " + std::to_string(static_cast<int>(exponent)),
                {}};
      v.estimator.mis = mis.value;
      v.estimator.mis_exponent = exponent;
      all.push_back(v);
    }
  }
  for (const auto& roulette : core::roulette_types()) {
    Variant v{"roulette " + std::string(roulette.name), {}};
    v.estimator.roulette = roulette.value;
    v.estimator.roulette_delta = 0.5F;
    all.push_back(v);
  }
  for (const auto& splitting : core::splitting_types()) {
    Variant v{"splitting " + std::string(splitting.name), {}};
    v.estimator.splitting = splitting.value;
    v.estimator.split_count = 3;
    all.push_back(v);
  }
  for (const auto lights : {core::LightSamplerType::kTree, core::LightSamplerType::kRis}) {
    Variant v{lights == core::LightSamplerType::kRis ? "control variate ris" : "control variate",
              {}};
    v.estimator.control_variate = core::ControlVariateType::kAnalytic;
    v.light_sampler = lights;
    all.push_back(v);
  }
  for (const core::Strategy strategy : {core::Strategy::kMis, core::Strategy::kLight}) {
    Variant v{strategy == core::Strategy::kMis ? "regression" : "regression light", {}};
    v.estimator.control_variate = core::ControlVariateType::kRegression;
    v.estimator.strategy = strategy;
    all.push_back(v);
  }
  for (const auto& expected : core::expected_value_types()) {
    Variant v{"expected values " + std::string(expected.name), {}};
    v.estimator.expected_values = expected.value;
    all.push_back(v);
  }
  for (const auto& sampler : core::samplers()) {
    Variant v{std::string(sampler.name), {}};
    v.sampler = sampler.value;
    all.push_back(v);
  }
  return all;
}

}  // namespace test_support
