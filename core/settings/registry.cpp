#include "core/settings/registry.h"

#include <algorithm>
#include <array>
#include <numeric>

#include "core/settings/sample_sets.h"

namespace core {
namespace {

constexpr std::array kSamplers = {
    NamedValue<SamplerType>{"independent", SamplerType::kIndependent,
                            "Independent uniform numbers; error falls as N^-1/2."},
    NamedValue<SamplerType>{
        "antithetic", SamplerType::kAntithetic,
        "Pairs of mirrored points on film, lens and lamps; counts are rounded up to whole pairs in "
        "every replicate: multiples of 2 times the replicates."},
    NamedValue<SamplerType>{"stratified", SamplerType::kStratified,
                            "Independent sets of 16 points, jittered in 4 x 4 cells of film, lens, "
                            "lamp and direction; counts "
                            "are rounded up to multiples of 16 times the replicates."},
    NamedValue<SamplerType>{
        "latin-hypercube", SamplerType::kLatinHypercube,
        "Independent sets of 16 points, one in each of 16 intervals of every dimension; counts are "
        "rounded up to multiples of 16 times the replicates."},
    NamedValue<SamplerType>{
        "orthogonal-array", SamplerType::kOrthogonalArray,
        "Independent sets of 25 points, one in each of 5 x 5 cells of every pair within four "
        "dimensions; counts are rounded up to multiples of 25 times the replicates."},
    NamedValue<SamplerType>{"halton", SamplerType::kHalton,
                            "Halton points with scrambled digits in bases 2 to 311, one sequence "
                            "over ten bounces; even "
                            "sample counts (odd ones above 1 are rounded up)."},
    NamedValue<SamplerType>{"sobol", SamplerType::kSobol,
                            "Owen-scrambled Sobol points in groups of four dimensions; even sample "
                            "counts (odd ones above "
                            "1 are rounded up)."},
    NamedValue<SamplerType>{
        "zsobol", SamplerType::kZsobol,
        "Sobol points in blue-noise order, for previews: errors of neighbouring pixels cancel, so "
        "variances do not add up over a block; independent sets of 8 points a pixel, counts are "
        "rounded "
        "up to multiples of 8 times the replicates."},
};

constexpr std::array kLightSamplers = {
    NamedValue<LightSamplerType>{"uniform", LightSamplerType::kUniform, "Every light alike."},
    NamedValue<LightSamplerType>{"power", LightSamplerType::kPower, "By emitted power."},
    NamedValue<LightSamplerType>{"tree", LightSamplerType::kTree,
                                 "A tree of lights, by what each can contribute at the point."},
    NamedValue<LightSamplerType>{
        "ris", LightSamplerType::kRis,
        "Of `candidates` that the tree gives, one by what it would add without "
        "shadows (resampled importance sampling)."},
    NamedValue<LightSamplerType>{
        "restir", LightSamplerType::kRestir,
        "Where the camera looks, of the light samples of all pixels in a square of `block` by "
        "`block` and of `history` passes, one by what it would add without shadows (reservoirs "
        "that are shared, with weights that keep it unbiased); errors of neighbouring pixels are "
        "correlated. Counts are rounded up to multiples of `history` times the replicates."},
};

constexpr std::array kStrategies = {
    NamedValue<Strategy>{"mis", Strategy::kMis, "Light and BSDF sampling combined."},
    NamedValue<Strategy>{"light", Strategy::kLight, "Next-event estimation alone."},
    NamedValue<Strategy>{"bsdf", Strategy::kBsdf, "BSDF sampling alone."},
    NamedValue<Strategy>{"cosine", Strategy::kCosine,
                         "Cosine-weighted directions, whatever the BSDF."},
    NamedValue<Strategy>{"uniform", Strategy::kUniform, "Uniform directions over the hemisphere."},
};

constexpr std::array kMisTypes = {
    NamedValue<MisType>{"balance", MisType::kBalance, "Balance heuristic."},
    NamedValue<MisType>{"power", MisType::kPower, "Power heuristic with `exponent`."},
    NamedValue<MisType>{"maximum", MisType::kMaximum, "All weight to the larger density."},
    NamedValue<MisType>{"optimal", MisType::kOptimal,
                        "Where the camera looks: the weights of least variance for each pixel, "
                        "which may be negative, from a 2x2 "
                        "system that one half solves for the other; power heuristic further on."},
};

constexpr std::array kRouletteTypes = {
    NamedValue<RouletteType>{"none", RouletteType::kNone, "Paths end at max_depth only."},
    NamedValue<RouletteType>{
        "throughput", RouletteType::kThroughput,
        "Paths that carry little go on by chance: the less, the darker they are, and "
        "rather after glossy surfaces."},
    NamedValue<RouletteType>{
        "threshold", RouletteType::kThreshold,
        "The same; and of light samples that would add less than `delta` to the pixel "
        "without shadows, a share in proportion has its shadow ray traced."},
};

constexpr std::array kSplittingTypes = {
    NamedValue<SplittingType>{"none", SplittingType::kNone, "One path for each camera ray."},
    NamedValue<SplittingType>{
        "fixed", SplittingType::kFixed,
        "`count` continuations at the first surface that a camera ray meets, averaged."},
    NamedValue<SplittingType>{
        "measured", SplittingType::kMeasured,
        "As fixed; the count, from 1 to 8, is the one that pays for variances and rays "
        "that a pilot of 4096 paths measures before the picture begins."},
};

constexpr std::array kControlVariateTypes = {
    NamedValue<ControlVariateType>{"none", ControlVariateType::kNone, "Light samples as they are."},
    NamedValue<ControlVariateType>{
        "analytic", ControlVariateType::kAnalytic,
        "On matt surfaces the light of uniform lamps without shadows in closed form, samples "
        "for shadows and gloss; clear where few shadows fall, noisier deep in shadow. Strategies "
        "'mis' and 'light'."},
    NamedValue<ControlVariateType>{
        "regression", ControlVariateType::kRegression,
        "Where the camera looks, the same with a factor for each pixel that one half fits for the "
        "other by least squares, small in shadow; BSDF samples keep their part. Strategies 'mis' "
        "and 'light'."},
};

constexpr std::array kExpectedValues = {
    NamedValue<bool>{"true", true,
                     "Absorption and transparency are factors of what a path carries."},
    NamedValue<bool>{
        "false", false,
        "Absorption by surfaces and media, and transparency in the way of light samples, end a "
        "path at random: the same mean, more noise."},
};

constexpr std::array kAdaptiveTypes = {
    NamedValue<AdaptiveType>{"none", AdaptiveType::kNone,
                             "Every pixel gets the same number of samples."},
    NamedValue<AdaptiveType>{"pilot", AdaptiveType::kPilot,
                             "More where a pilot stream finds noise that is never in the picture "
                             "and takes at most a tenth "
                             "on top; errors are valid."},
};

constexpr std::array kLaboratoryRules = {
    LaboratoryRule{"crosshalf", "stopping-bias", "cross-half"},
    LaboratoryRule{"sequential", "stopping-bias", "standard-error"},
};

constexpr std::array kGranularities = {
    NamedValue<Granularity>{"pixel", Granularity::kPixel, "Each pixel by its own neighbourhood."},
    NamedValue<Granularity>{"tile", Granularity::kTile, "All pixels of a tile alike."},
};

constexpr std::array kFilters = {
    NamedValue<FilterType>{"box", FilterType::kBox, "Constant."},
    NamedValue<FilterType>{"tent", FilterType::kTent, "Linear."},
    NamedValue<FilterType>{"gaussian", FilterType::kGaussian,
                           "Gaussian, sigma = radius / 3, truncated."},
    NamedValue<FilterType>{"mitchell", FilterType::kMitchell,
                           "Mitchell-Netravali with B = C = 1/3; has negative lobes."},
    NamedValue<FilterType>{"blackman-harris", FilterType::kBlackmanHarris,
                           "Blackman-Harris window."},
};

constexpr std::array kLayers = {
    LayerEntry{"beauty", "The picture: radiance and coverage.", true, 4},
    LayerEntry{"albedo", "Share of light that the first surface reflects or transmits.", true, 3},
    LayerEntry{"normal", "Shading normal of the first surface, world space, in [-1, 1].", false, 3},
    LayerEntry{"depth", "Distance from the eye to the first surface in metres, mean over hits.",
               false, 1},
    LayerEntry{"alpha", "Coverage; below 1 where a hidden environment shows.", false, 1},
    LayerEntry{"samples", "Samples taken.", false, 1},
    LayerEntry{"variance", "Variance of the mean, raw estimate from the two halves.", false, 3},
    LayerEntry{"error", "Relative error of the pixel, pooled over its neighbourhood.", false, 1},
};

}  // namespace

std::span<const NamedValue<SamplerType>> samplers() { return kSamplers; }
std::span<const NamedValue<LightSamplerType>> light_samplers() { return kLightSamplers; }
std::span<const NamedValue<Strategy>> strategies() { return kStrategies; }
std::span<const NamedValue<MisType>> mis_types() { return kMisTypes; }
std::span<const NamedValue<RouletteType>> roulette_types() { return kRouletteTypes; }
std::span<const NamedValue<SplittingType>> splitting_types() { return kSplittingTypes; }
std::span<const NamedValue<ControlVariateType>> control_variate_types() {
  return kControlVariateTypes;
}
std::span<const NamedValue<bool>> expected_value_types() { return kExpectedValues; }
std::span<const NamedValue<AdaptiveType>> adaptive_types() { return kAdaptiveTypes; }
std::span<const LaboratoryRule> laboratory_rules() { return kLaboratoryRules; }
std::span<const NamedValue<Granularity>> granularities() { return kGranularities; }
std::span<const NamedValue<FilterType>> filters() { return kFilters; }
std::span<const LayerEntry> layers() { return kLayers; }

std::string_view to_string(ErrorValidity error) noexcept {
  switch (error) {
    case ErrorValidity::kValid:
      return "valid";
    case ErrorValidity::kFromChains:
      return "from-chains";
    case ErrorValidity::kNone:
      break;
  }
  return "none";
}

const IntegratorEntry* find_integrator(std::string_view name) {
  const std::span<const IntegratorEntry> rows = integrators();
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [name](const IntegratorEntry& r) { return r.name == name; });
  return row != rows.end() ? &*row : nullptr;
}

std::string_view bias_of(const RenderSettings& settings) {
  std::string_view bias = "none";
  const auto add = [&bias](std::string_view more) {
    if (more == "biased" || bias == "none") {
      bias = more;
    }
  };
  if (const IntegratorEntry* entry = find_integrator(settings.integrator)) {
    add(entry->bias);
  }
  return bias;
}

bool errors_are_valid(const RenderSettings& settings) {
  const IntegratorEntry* entry = find_integrator(settings.integrator);
  return entry != nullptr && entry->error != ErrorValidity::kNone;
}

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
      settings.light_sampler == LightSamplerType::kRestir && settings.light_history > 1;
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

PixelErrors pixel_errors(const RenderSettings& settings) {
  const bool shares =
      settings.light_sampler == LightSamplerType::kRestir && settings.light_block > 1;
  return settings.sampler == SamplerType::kZsobol || shares ? PixelErrors::kCorrelated
                                                            : PixelErrors::kIndependent;
}

}  // namespace core
