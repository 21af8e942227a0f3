/// The table of integrators, and what follows from an integrator's row. A row is the registration:
/// names in requests, refusals, GET /v1/server and the OpenAPI page come from the rows.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

#include "core/base/check.h"
#include "core/settings/choices.h"

namespace core {

class Film;
class FilmShape;
class Integrator;
struct IntegratorInput;

/// How the error of an image is known: whether its halves, which show noise alone, show it.
enum class ErrorValidity {
  kValid,
  kFromChains,   ///< yes; chains are independent, samples are not
  kByComparison  ///< no, the image is biased: it is compared with independent unbiased images
};

std::span<const NamedValue<ErrorValidity>> error_validities();

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
  bool in_lanes = false;    ///< traced by the loop of core/wave where that knows the job
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
/// Replaced by one of candidates_of() that choose_integrator() picks
/// (core/render/task/choose_integrator.h).
inline constexpr std::string_view kAutomaticIntegrator = "auto";
/// Replaces `path` if it traces photons (core/render/task/choose_integrator.h).
inline constexpr std::string_view kCausticsIntegrator = "path-caustics";
/// Returns the settings as they are rendered with caustics, if they may be.
RenderSettings with_caustics(const RenderSettings& settings);
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
/// Returns the integrators of which one renders a job with these settings: several if one is chosen
/// by pilots, path first and path-caustics last. Empty if this build has no such integrator.
/// has_error_target: `auto` then chooses none that is biased.
std::vector<std::string_view> candidates_of(const RenderSettings& settings, bool has_error_target);
/// Returns the options that at least one integrator accepts.
std::vector<std::string_view> integrator_options();

/// Members of a job, besides its integrator, on which the defaults of others depend.
struct DefaultTerms {
  /// The job stops at an error target. It then uses pilot-driven adaptive sampling, which takes far
  /// fewer samples. Other jobs take the same count everywhere, so that parts of a job make up its
  /// film bit for bit.
  bool has_error_target = false;
  CausticsType caustics = CausticsType::kOff;  ///< if on, the defaults of with_caustics()
  /// Used if the integrator can choose. 'restir' gives each path one light sample, so that it does
  /// not split.
  LightSamplerType light_sampler = RenderSettings{}.light_sampler;
};
/// Of jobs that name only their integrator: pilots choose the light sampler.
inline constexpr DefaultTerms kJobTerms = {.light_sampler = LightSamplerType::kMeasured};
/// Returns the settings of a job that names only these. Unknown name: those of RenderSettings.
RenderSettings default_settings(std::string_view integrator, const DefaultTerms& terms = {});

/// The option of integrators whose clear surfaces can show the background.
inline constexpr std::string_view kThroughGlass = "/background/through_glass";
/// Returns whether the integrator honours the option.
inline bool accepts(const IntegratorEntry& integrator, std::string_view option) {
  return integrator.accepts.has(option);
}
/// Returns whether the integrator records this share besides the image.
bool keeps_share(const IntegratorEntry& integrator, const LightShare& share);

/// Returns the bias of the integrator; "none" if this build does not have it.
std::string_view bias_of(const RenderSettings& settings);
/// Returns whether the halves of an image show its error: it has no bias, and they are independent.
bool halves_show_error(const RenderSettings& settings);

/// Returns whether light paths splat to arbitrary pixels.
bool integrator_splats(const RenderSettings& settings);
/// Returns whether camera paths look up results of a prepass.
bool integrator_has_prepass(const RenderSettings& settings);

/// Returns whether the estimator correlates the errors of neighbouring pixels.
PixelErrors pixel_errors(const RenderSettings& settings);

/// Returns what the film of a job with these settings is like.
FilmShape film_shape(const RenderSettings& settings);
/// Makes it.
std::shared_ptr<Film> make_film(const RenderSettings& settings);

}  // namespace core
