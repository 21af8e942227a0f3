/// Tables of integrators, samplers, layers and every other named choice. A row is the registration:
/// names in requests, refusals, GET /v1/server and the OpenAPI page come from the rows.
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
  Options accepts = {};  ///< options that it honours; other values of its group refuse them unless
                         ///< they list them too
  std::string_view bias = "none";
};

/// How the error of an image is known: whether its halves, which show noise alone, show it.
enum class ErrorValidity {
  kValid,
  kFromChains,   ///< yes; chains are independent, samples are not
  kByComparison  ///< no, the image is biased: it is compared with independent unbiased images
};

/// Everything needed to offer an integrator: in requests, by GET /v1/server, on the OpenAPI page,
/// in the page's form and in the tests that iterate over the rows.
struct IntegratorEntry {
  std::string_view name;
  std::string_view summary;
  std::string_view bias;  ///< "none", "consistent" or "biased"
  ErrorValidity error;
  std::unique_ptr<const Integrator> (*make)(const IntegratorInput& input);
  /// The integrator_options() that it honours; it refuses non-default values of all others. With
  /// "/medium", also scenes with media that scatter.
  Options accepts;
  bool splats = false;      ///< light paths add to any pixel, so errors of pixels are correlated
  bool disperses = true;    ///< false: scenes with dispersion are refused
  bool shares = false;      ///< records shares of the image's light as separate layers
  bool strategies = false;  ///< including shares by strategy
  /// Maximum memory of data from the prepass (core/integrators/prepass.h); null if there is no
  /// prepass.
  std::uint64_t (*prepass_bytes)(const RenderSettings& settings) = nullptr;
  /// True: one prepass serves all samples, so workers take no jobs. False: one prepass per sample.
  bool keeps_prepass = false;
  /// Integrator of the images that a biased one is compared with
  /// (core/render/task/reference_images.h).
  std::string_view compared_with = {};
  /// Sets defaults that differ from those of RenderSettings; null if there are none.
  void (*set_defaults)(RenderSettings& settings) = nullptr;
};
/// Replaced by the row that choose_integrator() picks (core/render/task/choose_integrator.h).
inline constexpr std::string_view kAutomaticIntegrator = "auto";
/// Replaces `path` if it traces photons (core/render/task/choose_integrator.h).
inline constexpr std::string_view kCausticsIntegrator = "path-caustics";
/// Returns the settings as they are rendered with caustics, if they may be.
RenderSettings with_caustics(const RenderSettings& settings);
/// The table is in core/integrators/registry.cpp.
std::span<const IntegratorEntry> integrators();
/// Returns null if there is no such row.
const IntegratorEntry* find_integrator(std::string_view name);
/// Returns the row of a name. Pre: it exists.
inline const IntegratorEntry& row_of(std::span<const IntegratorEntry> rows, std::string_view name) {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [name](const IntegratorEntry& r) { return r.name == name; });
  CHECK(row != rows.end());
  return *row;
}
/// Returns the options that at least one integrator accepts.
std::vector<std::string_view> integrator_options();

/// Returns the settings of a job that names only the integrator. Unknown name: those of
/// RenderSettings. has_error_target: the job stops at an error target. It then uses pilot-driven
/// adaptive sampling, which takes far fewer samples. Other jobs take the same count everywhere, so
/// that parts of a job make up its film bit for bit.
RenderSettings default_settings(std::string_view integrator, bool has_error_target = false);

std::span<const NamedValue<ErrorValidity>> error_validities();
std::span<const NamedValue<SamplerType>> samplers();
std::span<const NamedValue<LightSamplerType>> light_samplers();
std::span<const NamedValue<Strategy>> strategies();
std::span<const NamedValue<MisType>> mis_types();
std::span<const NamedValue<RouletteType>> roulette_types();
std::span<const NamedValue<SplittingType>> splitting_types();
std::span<const NamedValue<CausticsType>> caustics_types();
std::span<const NamedValue<ControlVariateType>> control_variate_types();
std::span<const NamedValue<bool>> expected_value_types();
std::span<const NamedValue<bool>> spectral_types();
std::span<const NamedValue<AdaptiveType>> adaptive_types();
std::span<const NamedValue<Granularity>> granularities();
std::span<const NamedValue<FilterType>> filters();
std::span<const NamedValue<FogType>> fog_types();
std::span<const NamedValue<BackgroundType>> backgrounds();
std::span<const NamedValue<GroundType>> grounds();
std::span<const NamedValue<ShadowColor>> shadow_colors();
std::span<const NamedValue<Units>> units();
std::span<const NamedValue<EnvironmentPreset>> environment_presets();
std::span<const NamedValue<CameraType>> camera_types();
std::span<const NamedValue<DistortionModel>> distortion_models();
std::span<const NamedValue<PoseConvention>> pose_conventions();

/// Returns whether the ground is a shadow catcher.
inline bool has_catcher(const RenderSettings& settings) {
  return settings.ground.type == GroundType::kCatcher;
}
/// The option of integrators whose clear surfaces can show the background.
inline constexpr std::string_view kThroughGlass = "/background/through_glass";
/// Returns whether the integrator honours the option.
inline bool accepts(const IntegratorEntry& integrator, std::string_view option) {
  return std::find(integrator.accepts.begin(), integrator.accepts.end(), option) !=
         integrator.accepts.end();
}
inline bool is_transparent(const RenderSettings& settings) {
  return settings.background.type == BackgroundType::kTransparent;
}

/// Returns the row of a value. Pre: it exists.
template <typename T>
const NamedValue<T>& row_of(std::span<const NamedValue<T>> rows, T value) {
  const auto row = std::find_if(rows.begin(), rows.end(),
                                [value](const NamedValue<T>& r) { return r.value == value; });
  CHECK(row != rows.end());
  return *row;
}

/// Adaptive rules available only in the laboratory, as estimators of its experiments.
struct LaboratoryRule {
  std::string_view name;
  std::string_view experiment;
  std::string_view estimator;
};
std::span<const LaboratoryRule> laboratory_rules();

/// Returns the worst bias among the choices of the settings: "none", "consistent" or "biased".
std::string_view bias_of(const RenderSettings& settings);
/// Returns whether the halves of an image show its error: it has no bias, and they are independent.
bool halves_show_error(const RenderSettings& settings);

/// The layer that is the image.
inline constexpr std::string_view kBeauty = "beauty";

/// The kind of values in a layer.
enum class LayerForm {
  kValues,  ///< colours or other values that can be averaged
  kIds,     ///< integers
  kMattes   ///< Cryptomatte pairs: an id whose bits form a float, and its coverage
};

/// A layer that a film can show.
struct LayerEntry {
  std::string_view name;
  std::string_view summary;
  bool is_color;              ///< the tone curve applies
  std::string_view channels;  ///< of its image, one letter each
  /// One letter per channel in an EXR of all layers; empty if the layer is left out there.
  std::string_view exr_channels;
  /// Writes the values of all pixels, channels interleaved; NaN if unknown.
  void (*fill)(const FilmSnapshot& film, std::span<float> out);
  bool has_value = false;                  ///< defined for a single pixel
  bool FilmSettings::*recorded = nullptr;  ///< its setting; null if every film has the layer
  /// Returns whether the film has the layer. For layers with a setting.
  bool (*is_held)(const FilmSnapshot& film) = nullptr;
  LayerForm form = LayerForm::kValues;
  /// For layers that show a denoised image, which is computed on demand; null: the film suffices.
  void (*fill_denoised)(const FilmSnapshot& film, const DenoisedLook& look,
                        std::span<float> out) = nullptr;
};
/// The table is in core/layers/layer_rows.cpp.
std::span<const LayerEntry> layers();
/// Returns null if there is no such row.
const LayerEntry* find_layer(std::string_view name);

/// Layers without a row of their own, one per number or name.
struct LayerPattern {
  std::string_view name;
  std::string_view summary;
};
std::span<const LayerPattern> layer_patterns();
/// Parses a layer `bounce:N`, `bounce:N-` (N and more), `light:NAME`, `st:S,T`, `st:S,T:unweighted`
/// or `irradiance`; empty for other names.
std::optional<LightShare> light_share(std::string_view layer);
/// Returns whether the integrator records this share besides the image.
bool keeps_share(const IntegratorEntry& integrator, const LightShare& share);

/// Returns the samples per pixel of one complete set in every replicate, for samplers whose sets
/// have no useful prefixes; 1 for the others.
int sample_unit(SamplerType sampler, int replicates);

/// Rounds a sample count up to what the sampler supports. sobol, halton: even counts, except 1.
/// Samplers without prefixes: multiples of sample_unit().
int rounded_samples(SamplerType sampler, int replicates, int samples_per_pixel);

/// Returns the samples per pixel, summed over replicates, that share light samples across passes
/// and are rendered together; 1 if none do.
int shared_window(const RenderSettings& settings);
/// As above, also counting windows: a unit consists of complete sets and complete windows.
int sample_unit(const RenderSettings& settings);
int rounded_samples(const RenderSettings& settings, int samples_per_pixel);

/// Returns whether light paths splat to arbitrary pixels.
bool integrator_splats(const RenderSettings& settings);
/// Returns whether camera paths look up results of a prepass.
bool integrator_has_prepass(const RenderSettings& settings);

/// Returns whether the estimator correlates the errors of neighbouring pixels.
PixelErrors pixel_errors(const RenderSettings& settings);

}  // namespace core
