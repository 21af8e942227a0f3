#include "core/integrators/registry.h"

#include <array>

#include "core/base/check.h"
#include "core/settings/cache_rules.h"
#include "core/settings/photon_rules.h"
#include "core/settings/registry.h"

namespace core {
namespace {

constexpr std::array<std::string_view, 16> kPathOptions = {
    "/integrator/caustics",
    "/integrator/max_depth",
    "/estimator/strategy",
    "/estimator/mis",
    "/estimator/roulette",
    "/estimator/splitting",
    "/estimator/control_variate",
    "/estimator/expected_values",
    "/sampler/type",
    "/sampler/replicates",
    "/light_sampler",
    "/adaptive",
    "/medium",
    "/spectral",
    "/shutter_seconds",
    kThroughGlass,
};
constexpr std::array<std::string_view, 6> kDirectOptions = {
    "/sampler/type", "/sampler/replicates", "/adaptive",
    "/spectral",     "/shutter_seconds",    kThroughGlass};
constexpr std::array<std::string_view, 3> kLightTraceOptions = {
    "/integrator/max_depth", "/sampler/type", "/sampler/replicates"};
constexpr std::array<std::string_view, 5> kBdptOptions = {
    "/integrator/max_depth", "/sampler/type", "/sampler/replicates", "/medium", kThroughGlass};
constexpr std::array<std::string_view, 6> kAutomaticOptions = {"/integrator/max_depth",
                                                               "/sampler/type",
                                                               "/sampler/replicates",
                                                               "/medium",
                                                               "/spectral",
                                                               kThroughGlass};
constexpr std::array<std::string_view, 2> kMltOptions = {"/integrator/max_depth",
                                                         "/sampler/replicates"};
constexpr std::array<std::string_view, 7> kSppmOptions = {
    "/integrator/max_depth", "/integrator/photons", "/integrator/radius_m", "/integrator/alpha",
    "/sampler/type",         "/sampler/replicates", kThroughGlass};
constexpr std::array<std::string_view, 8> kMergingOptions = {"/integrator/max_depth",
                                                             "/integrator/photons",
                                                             "/integrator/radius_m",
                                                             "/integrator/alpha",
                                                             "/sampler/type",
                                                             "/sampler/replicates",
                                                             "/medium",
                                                             kThroughGlass};
constexpr std::array<std::string_view, 7> kPhotonMapOptions = {"/integrator/max_depth",
                                                               "/integrator/photons",
                                                               "/integrator/radius_m",
                                                               "/integrator/final_gather",
                                                               "/sampler/type",
                                                               "/sampler/replicates",
                                                               kThroughGlass};
constexpr std::array<std::string_view, 7> kCacheOptions = {
    "/integrator/max_depth", "/integrator/tolerance", "/integrator/rays", "/integrator/records",
    "/sampler/type",         "/sampler/replicates",   kThroughGlass};

constexpr std::array kIntegrators = {
    IntegratorEntry{.name = "path",
                    .summary = "Path tracing with next-event estimation and BSDF sampling combined "
                               "by MIS.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_path_tracer,
                    .accepts = kPathOptions,
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
        .make = &make_bdpt,
        .accepts = kMergingOptions,
        .disperses = false,
        .prepass_bytes = &merged_photon_bytes,
        .compared_with = "bdpt"},
    IntegratorEntry{
        .name = "direct",
        .summary = "Emitted and direct light only: the path tracer's image at max_depth 1.",
        .bias = "none",
        .error = ErrorValidity::kValid,
        .make = &make_direct,
        .accepts = kDirectOptions,
        .set_defaults = [](RenderSettings& settings) { settings.max_depth = 1; }},
    IntegratorEntry{
        .name = "light-trace",
        .summary = "Light tracing: particles from the lights; each surface they hit is connected "
                   "to the camera. For caustics; mirrors and glass are path traced.",
        .bias = "none",
        .error = ErrorValidity::kValid,
        .make = &make_light_tracer,
        .accepts = kLightTraceOptions,
        .splats = true},
    IntegratorEntry{.name = "bdpt",
                    .summary = "Bidirectional path tracing: subpaths from the camera and the "
                               "lights, connected in all ways and combined by MIS.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_bdpt,
                    .accepts = kBdptOptions,
                    .splats = true,
                    .shares = true,
                    .strategies = true},
    IntegratorEntry{
        .name = "mlt",
        .summary = "Metropolis light transport: Markov chains of slightly mutated paths, which "
                   "stay where light is found. For light through a keyhole.",
        .bias = "none",
        .error = ErrorValidity::kFromChains,
        .make = &make_metropolis,
        .accepts = kMltOptions,
        .splats = true},
    IntegratorEntry{.name = "photon-map",
                    .summary = "Photon mapping: photons from the lights, gathered within a fixed "
                               "radius; caustics directly from the map, other indirect light after "
                               "one more reflection. The blur does not decrease with more samples.",
                    .bias = "biased",
                    .error = ErrorValidity::kByComparison,
                    .make = &make_photon_tracer,
                    .accepts = kPhotonMapOptions,
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
        .make = &make_photon_tracer,
        .accepts = kSppmOptions,
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
        .make = &make_bdpt,
        .accepts = kMergingOptions,
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
        .make = &make_irradiance_cache,
        .accepts = kCacheOptions,
        .prepass_bytes = &cache_bytes,
        .keeps_prepass = true,
        .compared_with = "path"},
    // Replaced before an image is started (core/render/task/choose_integrator.h); has the memory
    // needs of all candidates.
    IntegratorEntry{.name = kAutomaticIntegrator,
                    .summary = "path, bdpt or, without an error target, sppm, whichever is most "
                               "efficient in small pilot images; the job reports which, and why.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_path_tracer,
                    .accepts = kAutomaticOptions,
                    .splats = true,
                    .shares = true},
};

}  // namespace

std::span<const IntegratorEntry> integrators() { return kIntegrators; }

std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input) {
  const IntegratorEntry* row = find_integrator(input.settings.integrator);
  CHECK(row != nullptr);
  return row->make(input);
}

}  // namespace core
