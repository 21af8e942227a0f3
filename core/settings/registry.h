/// Tables of integrators, samplers, layers and every other named choice. Names in requests,
/// refusals, GET /v1/server and the OpenAPI page come from the rows: a row is the registration.
#pragma once

#include <algorithm>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/check.h"
#include "core/settings/settings.h"

namespace core {

class Integrator;
struct DenoisedLook;
struct FilmSnapshot;
struct IntegratorInput;

/// JSON pointers of the job's options.
using Options = std::span<const std::string_view>;

/// A value that a request may name.
template <typename T>
struct NamedValue {
  std::string_view name;
  T value;
  std::string_view summary;
  Options accepts = {};  ///< honours these; the other values of its group, unless they list them
                         ///< too, refuse them
  std::string_view bias = "none";
};

/// Does (A - B)^2 / 4 of a picture's halves estimate the variance of the mean?
enum class ErrorValidity {
  kValid,
  kFromChains,  ///< yes; independent are chains, not samples
  kNone         ///< no: the picture is biased, or its halves depend on each other
};

/// A row is all that an integrator needs to be offered: in requests, by GET /v1/server, on the
/// OpenAPI page, in the page's form and in the tests that walk the rows.
struct IntegratorEntry {
  std::string_view name;
  std::string_view summary;
  std::string_view bias;  ///< "none", "consistent" or "biased"
  ErrorValidity error;
  std::unique_ptr<const Integrator> (*make)(const IntegratorInput& input);
  /// Of integrator_options(): it honours these, and refuses other values than its defaults for the
  /// rest.
  Options accepts;
  bool splats = false;      ///< light paths add to any pixel: errors of pixels are correlated
  bool disperses = true;    ///< false: scenes with dispersion are refused
  bool media = false;       ///< false: scenes with media that scatter are refused
  bool shares = false;      ///< keeps shares of the picture's light in layers of their own
  bool strategies = false;  ///< also of its strategies
  /// Most that what camera paths look up takes, where a pass before them makes it
  /// (core/integrators/prepass.h); null: there is none.
  std::uint64_t (*prepass_bytes)(const RenderSettings& settings) = nullptr;
  /// That pass is made once, for all samples, so that workers take no jobs; false: for each anew.
  bool keeps_prepass = false;
  /// Its own defaults, over those of RenderSettings; null: it has none.
  void (*set_defaults)(RenderSettings& settings) = nullptr;
};
/// Stands for the row that choose_integrator() picks (core/render/choose_integrator.h).
inline constexpr std::string_view kAutomaticIntegrator = "auto";
/// The table is in core/integrators/registry.cpp.
std::span<const IntegratorEntry> integrators();
/// Null: no such row.
const IntegratorEntry* find_integrator(std::string_view name);
/// The row of a name. Pre: there is one.
inline const IntegratorEntry& row_of(std::span<const IntegratorEntry> rows, std::string_view name) {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [name](const IntegratorEntry& r) { return r.name == name; });
  CHECK(row != rows.end());
  return *row;
}
/// Options that at least one integrator accepts.
std::vector<std::string_view> integrator_options();

/// The settings of a job that names the integrator only. Unknown name: those of RenderSettings.
/// has_error_target: the job stops at an error. It then takes far fewer samples where a pilot
/// stream decides about them; other jobs take the same count everywhere, so that parts of a job
/// make up its film bit for bit.
RenderSettings default_settings(std::string_view integrator, bool has_error_target = false);

std::span<const NamedValue<ErrorValidity>> error_validities();
std::span<const NamedValue<SamplerType>> samplers();
std::span<const NamedValue<LightSamplerType>> light_samplers();
std::span<const NamedValue<Strategy>> strategies();
std::span<const NamedValue<MisType>> mis_types();
std::span<const NamedValue<RouletteType>> roulette_types();
std::span<const NamedValue<SplittingType>> splitting_types();
std::span<const NamedValue<ControlVariateType>> control_variate_types();
std::span<const NamedValue<bool>> expected_value_types();
std::span<const NamedValue<bool>> spectral_types();
std::span<const NamedValue<AdaptiveType>> adaptive_types();
std::span<const NamedValue<Granularity>> granularities();
std::span<const NamedValue<FilterType>> filters();
std::span<const NamedValue<FogType>> fog_types();
std::span<const NamedValue<BackgroundType>> backgrounds();
std::span<const NamedValue<GroundType>> grounds();
std::span<const NamedValue<EnvironmentPreset>> environment_presets();
std::span<const NamedValue<CameraType>> camera_types();

/// Is the ground seen by its shadow alone?
inline bool has_catcher(const RenderSettings& settings) {
  return settings.ground.type == GroundType::kCatcher;
}
inline bool is_transparent(const RenderSettings& settings) {
  return settings.background.type == BackgroundType::kTransparent;
}

/// The row of a value. Pre: there is one.
template <typename T>
const NamedValue<T>& row_of(std::span<const NamedValue<T>> rows, T value) {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [value](const NamedValue<T>& r) { return r.value == value; });
  CHECK(row != rows.end());
  return *row;
}

/// Adaptive rules that only the laboratory has: as an estimator of one of its experiments.
struct LaboratoryRule {
  std::string_view name;
  std::string_view experiment;
  std::string_view estimator;
};
std::span<const LaboratoryRule> laboratory_rules();

/// The worst bias of what the settings choose: "none", "consistent" or "biased".
std::string_view bias_of(const RenderSettings& settings);
/// Does the integrator's row say so?
bool errors_are_valid(const RenderSettings& settings);

/// The layer that is the picture.
inline constexpr std::string_view kBeauty = "beauty";

/// What the values of a layer are.
enum class LayerForm {
  kValues,  ///< colours or data, which can be averaged
  kIds,     ///< whole numbers
  kMattes   ///< pairs of Cryptomatte: an id whose bits are a float, its coverage
};

/// A layer that a film can show.
struct LayerEntry {
  std::string_view name;
  std::string_view summary;
  bool is_color;              ///< tone curve applies
  std::string_view channels;  ///< of its image, a letter each
  /// A letter for each channel in an EXR of all layers; empty: left out there.
  std::string_view exr_channels;
  /// Values of all pixels, channels together; NaN where unknown.
  void (*fill)(const FilmSnapshot& film, std::span<float> out);
  bool has_value = false;                  ///< of a pixel by itself
  bool FilmSettings::*recorded = nullptr;  ///< its switch; null: every film has it
  /// Does this film have it? For layers with a switch.
  bool (*is_held)(const FilmSnapshot& film) = nullptr;
  LayerForm form = LayerForm::kValues;
  /// Of layers that show a denoised picture, which is made on demand; null: of the film alone.
  void (*fill_denoised)(const FilmSnapshot& film, const DenoisedLook& look,
                        std::span<float> out) = nullptr;
};
/// The table is in core/layers/layers.cpp.
std::span<const LayerEntry> layers();
/// Null: no such row.
const LayerEntry* find_layer(std::string_view name);

/// Layers that have no row, for there is one for each number or name.
struct LayerPattern {
  std::string_view name;
  std::string_view summary;
};
std::span<const LayerPattern> layer_patterns();
/// Of a layer `bounce:N`, `bounce:N-` (N and more), `light:NAME`, `st:S,T`, `st:S,T:unweighted` or
/// `irradiance`; empty: it is none of them.
std::optional<LightShare> light_share(std::string_view layer);
/// Does the integrator keep it beside the picture?
bool keeps_share(const IntegratorEntry& integrator, const LightShare& share);

/// Samples per pixel of one whole set in every replicate, for samplers whose sets have no prefixes;
/// 1 for the others.
int sample_unit(SamplerType sampler, int replicates);

/// The sample count in force under the sampler's rule. sobol, halton: even counts, except 1.
/// Samplers without prefixes: multiples of sample_unit(). Never less than what was asked for.
int rounded_samples(SamplerType sampler, int replicates, int samples_per_pixel);

/// Samples per pixel, all replicates together, that share light samples over passes and are
/// rendered in one go; 1: none do.
int shared_window(const RenderSettings& settings);
/// The same where samples also come in whole windows: a unit is then whole sets and whole windows.
int sample_unit(const RenderSettings& settings);
int rounded_samples(const RenderSettings& settings, int samples_per_pixel);

/// Do light paths add to pixels anywhere?
bool integrator_splats(const RenderSettings& settings);
/// Do camera paths look up what a pass before them has made?
bool integrator_has_prepass(const RenderSettings& settings);

/// Does the estimation correlate the errors of neighbouring pixels?
PixelErrors pixel_errors(const RenderSettings& settings);

}  // namespace core
