/// The tables of what this build can do: names in requests, GET /v1/server and the OpenAPI page
/// all come from here. A row is the registration.
#pragma once

#include <memory>
#include <span>
#include <string_view>

#include "core/settings/settings.h"

namespace core {

class Integrator;
struct IntegratorInput;

/// What (A - B)^2 / 4 of a picture's halves says of its error.
enum class ErrorValidity {
  kValid,       ///< estimates the variance of the mean
  kFromChains,  ///< so do independent chains, not samples
  kNone         ///< nothing: the picture is biased, or its halves depend on each other
};
std::string_view to_string(ErrorValidity error) noexcept;

/// A row is all that an integrator needs to be offered: in requests, by GET /v1/server, on the
/// OpenAPI page, in the page's form and in the tests that walk the rows.
struct IntegratorEntry {
  std::string_view name;
  std::string_view summary;
  std::string_view bias;  ///< "none", "consistent" or "biased"
  ErrorValidity error;
  std::unique_ptr<const Integrator> (*make)(const IntegratorInput& input);
  /// JSON pointers of the job's options that it honours; it refuses other values than their
  /// defaults for the rest.
  std::span<const std::string_view> accepts;
  bool splats = false;  ///< light paths add to any pixel: errors of pixels are correlated
};
/// The table stands in core/integrators/registry.cpp.
std::span<const IntegratorEntry> integrators();
/// Null: no such row.
const IntegratorEntry* find_integrator(std::string_view name);

template <typename Enum>
struct NamedValue {
  std::string_view name;
  Enum value;
  std::string_view summary;
  std::string_view bias = "none";
};

std::span<const NamedValue<SamplerType>> samplers();
std::span<const NamedValue<LightSamplerType>> light_samplers();
std::span<const NamedValue<Strategy>> strategies();
std::span<const NamedValue<MisType>> mis_types();
std::span<const NamedValue<RouletteType>> roulette_types();
std::span<const NamedValue<SplittingType>> splitting_types();
std::span<const NamedValue<ControlVariateType>> control_variate_types();
std::span<const NamedValue<bool>> expected_value_types();
std::span<const NamedValue<AdaptiveType>> adaptive_types();
/// Adaptive rules that only the laboratory has: as an estimator of one of its experiments.
struct LaboratoryRule {
  std::string_view name;
  std::string_view experiment;
  std::string_view estimator;
};
std::span<const LaboratoryRule> laboratory_rules();
std::span<const NamedValue<Granularity>> granularities();
std::span<const NamedValue<FilterType>> filters();

/// The worst of what the settings choose: "none", "consistent" or "biased".
std::string_view bias_of(const RenderSettings& settings);
/// Does the integrator's row say so?
bool errors_are_valid(const RenderSettings& settings);

/// Layers a film can show. beauty albedo normal depth alpha samples variance error.
struct LayerEntry {
  std::string_view name;
  std::string_view summary;
  bool is_color;  ///< tone curve applies
  int channels;
};
std::span<const LayerEntry> layers();

/// Samples per pixel of one whole set in every replicate, for samplers whose sets have no prefixes;
/// 1 for the others.
int sample_unit(SamplerType sampler, int replicates);

/// What a sample count becomes under the sampler's rule. sobol, halton: even counts, except 1.
/// Samplers without prefixes: multiples of sample_unit(). Never less than what was asked for.
int rounded_samples(SamplerType sampler, int replicates, int samples_per_pixel);

/// Samples per pixel, all replicates together, that share light samples over passes and are
/// rendered in one go; 1: none do.
int shared_window(const RenderSettings& settings);
/// The same where samples also come in whole windows: a unit is then whole sets and whole windows.
int sample_unit(const RenderSettings& settings);
int rounded_samples(const RenderSettings& settings, int samples_per_pixel);

/// What the estimation does to the errors of neighbouring pixels.
PixelErrors pixel_errors(const RenderSettings& settings);

}  // namespace core
