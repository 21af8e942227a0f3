#include "tests/render/truth.h"

#include "core/render/registry.h"

namespace test_support {

std::vector<Variant> variants() {
  std::vector<Variant> all;
  for (const auto& strategy : core::strategies()) {
    for (const auto& lights : core::light_samplers()) {
      Variant v{std::string(strategy.name) + "/" + std::string(lights.name), {}};
      v.estimator.strategy = strategy.value;
      v.light_sampler = lights.value;
      all.push_back(v);
    }
  }
  for (const auto& mis : core::mis_types()) {
    for (const float exponent : {1.0F, 4.0F}) {
      Variant v{std::string(mis.name) + " exponent " + std::to_string(static_cast<int>(exponent)), {}};
      v.estimator.mis = mis.value;
      v.estimator.mis_exponent = exponent;
      all.push_back(v);
    }
  }
  for (const auto& roulette : core::roulette_types()) {
    Variant v{"roulette " + std::string(roulette.name), {}};
    v.estimator.roulette = roulette.value;
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
