#include "core/integrators/registry.h"

#include <array>

#include "core/base/check.h"
#include "core/film/film.h"
#include "core/integrators/integrator.h"
#include "core/integrators/maps/cache_rules.h"
#include "core/integrators/maps/photon_rules.h"
#include "core/settings/choices.h"

namespace core {

namespace {

constexpr std::array kErrorValidities = {
    NamedValue<ErrorValidity>{"valid", ErrorValidity::kValid,
                              "The halves estimate the variance of the mean."},
    NamedValue<ErrorValidity>{
        "from-chains", ErrorValidity::kFromChains,
        "The halves estimate the variance of the mean; chains are independent, not samples."},
    NamedValue<ErrorValidity>{"by-comparison", ErrorValidity::kByComparison,
                              "The image is biased; it is compared with two independent unbiased "
                              "images of an eighth of its samples."},
};

}  // namespace

/// A function of this name, which the integrator's file defines in core.
#define MADE_BY(make_it)                                                  \
  [](const IntegratorInput& input) -> std::unique_ptr<const Integrator> { \
    std::unique_ptr<const Integrator> make_it(const IntegratorInput&);    \
    return make_it(input);                                                \
  }

constexpr std::array kIntegrators = {
    IntegratorEntry{
        .name = "path",
        .summary = "Path tracing with next-event estimation and BSDF sampling combined by MIS.",
        .bias = "none",
        .error = ErrorValidity::kValid,
        .make = MADE_BY(make_path_tracer),
        .accepts = {"/integrator/caustics", "/integrator/max_depth", "/estimator/strategy",
                    "/estimator/mis", "/estimator/roulette", "/estimator/splitting",
                    "/estimator/control_variate", "/estimator/expected_values", "/sampler/type",
                    "/sampler/replicates", "/light_sampler", "/adaptive", "/medium", "/spectral",
                    "/shutter_seconds", kThroughGlass},
        .in_lanes = true,
        .shares = true,
        .set_defaults =
            [](RenderSettings& settings) {
              settings.estimator.splitting = SplittingType::kMeasured;
            }},
    IntegratorEntry{
        .name = kCausticsIntegrator,
        .summary = "Path tracing, and photons of caustics: of light that smooth surfaces alone "
                   "bring to others, weighted by MIS. For glass, water, mirrors and jewels beside "
                   "other light.",
        .bias = "consistent",
        .error = ErrorValidity::kByComparison,
        .make = MADE_BY(make_bdpt),
        .accepts = {"/integrator/max_depth", "/integrator/photons", "/integrator/radius_m",
                    "/integrator/alpha", "/sampler/type", "/sampler/replicates", "/medium",
                    kThroughGlass},
        .disperses = false,
        .prepass_bytes = &merged_photon_bytes,
        .compared_with = "bdpt"},
    IntegratorEntry{
        .name = "direct",
        .summary = "Emitted and direct light only: the path tracer's image at max_depth 1.",
        .bias = "none",
        .error = ErrorValidity::kValid,
        .make = MADE_BY(make_path_tracer),
        .accepts = {"/sampler/type", "/sampler/replicates", "/adaptive", "/spectral",
                    "/shutter_seconds", kThroughGlass},
        .in_lanes = true,
        .set_defaults = [](RenderSettings& settings) { settings.max_depth = 1; }},
    IntegratorEntry{
        .name = "light-trace",
        .summary = "Light tracing: particles from the lights; each surface they hit is connected "
                   "to the camera. For caustics; mirrors and glass are path traced.",
        .bias = "none",
        .error = ErrorValidity::kValid,
        .make = MADE_BY(make_light_tracer),
        .accepts = {"/integrator/max_depth", "/sampler/type", "/sampler/replicates"},
        .splats = true},
    IntegratorEntry{.name = "bdpt",
                    .summary = "Bidirectional path tracing: subpaths from the camera and the "
                               "lights, connected in all ways and combined by MIS.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = MADE_BY(make_bdpt),
                    .accepts = {"/integrator/max_depth", "/sampler/type", "/sampler/replicates",
                                "/medium", kThroughGlass},
                    .splats = true,
                    .shares = true,
                    .strategies = true},
    IntegratorEntry{
        .name = "mlt",
        .summary = "Metropolis light transport: Markov chains of slightly mutated paths, which "
                   "stay where light is found. For light through a keyhole.",
        .bias = "none",
        .error = ErrorValidity::kFromChains,
        .make = MADE_BY(make_metropolis),
        .accepts = {"/integrator/max_depth", "/sampler/replicates"},
        .splats = true},
    IntegratorEntry{.name = "photon-map",
                    .summary = "Photon mapping: photons from the lights, gathered within a fixed "
                               "radius; caustics directly from the map, other indirect light after "
                               "one more reflection. The blur does not decrease with more samples.",
                    .bias = "biased",
                    .error = ErrorValidity::kByComparison,
                    .make = MADE_BY(make_photon_tracer),
                    .accepts = {"/integrator/max_depth", "/integrator/photons",
                                "/integrator/radius_m", "/integrator/final_gather", "/sampler/type",
                                "/sampler/replicates", kThroughGlass},
                    .disperses = false,
                    .prepass_bytes = &photon_bytes,
                    .compared_with = "bdpt"},
    IntegratorEntry{
        .name = "sppm",
        .summary =
            "Stochastic progressive photon mapping: photons from the lights, gathered within a "
            "radius that shrinks from sample to sample. For caustics behind glass and in mirrors.",
        .bias = "consistent",
        .error = ErrorValidity::kByComparison,
        .make = MADE_BY(make_photon_tracer),
        .accepts = {"/integrator/max_depth", "/integrator/photons", "/integrator/radius_m",
                    "/integrator/alpha", "/sampler/type", "/sampler/replicates", kThroughGlass},
        .disperses = false,
        .prepass_bytes = &photon_bytes,
        .compared_with = "bdpt"},
    IntegratorEntry{
        .name = "vcm",
        .summary = "Vertex connection and merging: bidirectional path tracing and photons in one "
                   "estimator, weighted by MIS. For caustics of every kind, also behind glass and "
                   "in mirrors, beside other light.",
        .bias = "consistent",
        .error = ErrorValidity::kByComparison,
        .make = MADE_BY(make_bdpt),
        .accepts = {"/integrator/max_depth", "/integrator/photons", "/integrator/radius_m",
                    "/integrator/alpha", "/sampler/type", "/sampler/replicates", "/medium",
                    kThroughGlass},
        .splats = true,
        .disperses = false,
        .prepass_bytes = &merged_photon_bytes,
        .compared_with = "bdpt"},
    IntegratorEntry{
        .name = "irradiance-cache",
        .summary = "Irradiance caching: diffuse indirect light is interpolated between records "
                   "placed where it changes; all other light as with path. Smooth interiors "
                   "quickly without noise; the blur does not decrease with more samples.",
        .bias = "biased",
        .error = ErrorValidity::kByComparison,
        .make = MADE_BY(make_irradiance_cache),
        .accepts = {"/integrator/max_depth", "/integrator/tolerance", "/integrator/rays",
                    "/integrator/records", "/sampler/type", "/sampler/replicates", kThroughGlass},
        .prepass_bytes = &cache_bytes,
        .keeps_prepass = true,
        .compared_with = "path"},
    // Replaced before an image is started (core/render/task/choose_integrator.h); its film has room
    // for that of each candidate.
    IntegratorEntry{.name = kAutomaticIntegrator,
                    .summary = "path, bdpt or, without an error target, sppm or path-caustics, "
                               "whichever is most efficient in small pilot images; the job "
                               "reports which, and why.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = MADE_BY(make_path_tracer),
                    .accepts = {"/integrator/max_depth", "/sampler/type", "/sampler/replicates",
                                "/medium", "/spectral", kThroughGlass},
                    .splats = true,
                    .shares = true},
};
#undef MADE_BY

std::span<const NamedValue<ErrorValidity>> error_validities() { return kErrorValidities; }
std::span<const IntegratorEntry> integrators() { return kIntegrators; }

const IntegratorEntry* find_integrator(std::string_view name) {
  const auto row = std::find_if(kIntegrators.begin(), kIntegrators.end(),
                                [name](const IntegratorEntry& r) { return r.name == name; });
  return row != kIntegrators.end() ? &*row : nullptr;
}

std::vector<std::string_view> integrator_options() {
  std::vector<std::string_view> all;
  for (const IntegratorEntry& row : integrators()) {
    for (const std::string_view option : row.accepts) {
      if (std::find(all.begin(), all.end(), option) == all.end()) {
        all.push_back(option);
      }
    }
  }
  return all;
}

RenderSettings default_settings(std::string_view integrator, const DefaultTerms& terms) {
  RenderSettings settings;
  settings.caustics = terms.caustics;
  if (find_integrator(integrator) == nullptr) {
    return settings;
  }
  settings.integrator = integrator;
  const IntegratorEntry* row = find_integrator(with_caustics(settings).integrator);
  if (row->set_defaults != nullptr) {
    row->set_defaults(settings);
  }
  if (row->accepts.has("/light_sampler")) {
    settings.light_sampler = terms.light_sampler;
  }
  if (terms.has_error_target && row->accepts.has("/adaptive")) {
    settings.adaptive.type = AdaptiveType::kPilot;
  }
  if (light_reuse(terms.light_sampler) == LightReuse::kShare) {
    settings.estimator.splitting = SplittingType::kNone;
  }
  return settings;
}

RenderSettings with_caustics(const RenderSettings& settings) {
  RenderSettings out = settings;
  if (settings.integrator == "path" && settings.caustics != CausticsType::kOff) {
    out.integrator = kCausticsIntegrator;
    out.caustics = CausticsType::kOff;
  }
  return out;
}

std::vector<std::string_view> candidates_of(const RenderSettings& settings, bool has_error_target) {
  if (settings.integrator == kAutomaticIntegrator) {
    // Biased images have no shares of light and no meter.
    const bool may_be_biased =
        !has_error_target && settings.film.shares.empty() && settings.meter.empty();
    return may_be_biased
               ? std::vector<std::string_view>{"path", "bdpt", "sppm", kCausticsIntegrator}
               : std::vector<std::string_view>{"path", "bdpt"};
  }
  const IntegratorEntry* row = find_integrator(with_caustics(settings).integrator);
  if (row == nullptr) {
    return {};
  }
  return row->name == kCausticsIntegrator && settings.caustics == CausticsType::kAuto
             ? std::vector<std::string_view>{"path", row->name}
             : std::vector<std::string_view>{row->name};
}

std::string_view bias_of(const RenderSettings& settings) {
  const IntegratorEntry* entry = find_integrator(settings.integrator);
  return entry != nullptr ? entry->bias : "none";
}

bool halves_show_error(const RenderSettings& settings) {
  const IntegratorEntry* entry = find_integrator(settings.integrator);
  return entry != nullptr && entry->error != ErrorValidity::kByComparison;
}

bool keeps_share(const IntegratorEntry& integrator, const LightShare& share) {
  if (share.is_irradiance) {
    return integrator.prepass_bytes == nullptr;
  }
  return share.strategy ? integrator.strategies : integrator.shares;
}

bool integrator_splats(const RenderSettings& settings) {
  const IntegratorEntry* entry = find_integrator(settings.integrator);
  return entry != nullptr && entry->splats;
}

bool integrator_has_prepass(const RenderSettings& settings) {
  const IntegratorEntry* entry = find_integrator(settings.integrator);
  return entry != nullptr && entry->prepass_bytes != nullptr;
}

PixelErrors pixel_errors(const RenderSettings& settings) {
  const bool shares =
      light_reuse(settings.light_sampler) == LightReuse::kShare && settings.light_block > 1;
  return settings.sampler == SamplerType::kZsobol || shares || integrator_splats(settings) ||
                 integrator_has_prepass(settings)
             ? PixelErrors::kCorrelated
             : PixelErrors::kIndependent;
}

FilmShape film_shape(const RenderSettings& settings) {
  return {settings, pixel_errors(settings), integrator_splats(settings)};
}

std::shared_ptr<Film> make_film(const RenderSettings& settings) {
  return std::make_shared<Film>(film_shape(settings));
}

std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input) {
  const IntegratorEntry* row = find_integrator(input.settings.integrator);
  CHECK(row != nullptr);
  return row->make(input);
}

}  // namespace core
