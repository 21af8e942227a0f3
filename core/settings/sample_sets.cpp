#include "core/settings/sample_sets.h"

#include <numeric>

namespace core {

int sample_unit(SamplerType sampler, int replicates) {
  const int set = samples_in_set(sampler);
  return set > 1 ? set * replicates : 1;
}

int rounded_samples(SamplerType sampler, int replicates, int samples_per_pixel) {
  if ((sampler == SamplerType::kSobol || sampler == SamplerType::kHalton) &&
      samples_per_pixel > 1) {
    return samples_per_pixel + samples_per_pixel % 2;
  }
  const int unit = sample_unit(sampler, replicates);
  return (samples_per_pixel + unit - 1) / unit * unit;
}

int shared_window(const RenderSettings& settings) {
  const bool shares =
      light_reuse(settings.light_sampler) == LightReuse::kShare && settings.light_history > 1;
  return shares ? settings.light_history * settings.replicates : 1;
}

int sample_unit(const RenderSettings& settings) {
  return std::lcm(sample_unit(settings.sampler, settings.replicates), shared_window(settings));
}

int rounded_samples(const RenderSettings& settings, int samples_per_pixel) {
  const int unit = sample_unit(settings);
  return unit > 1 ? (samples_per_pixel + unit - 1) / unit * unit
                  : rounded_samples(settings.sampler, settings.replicates, samples_per_pixel);
}

}  // namespace core
