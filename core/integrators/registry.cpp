#include "core/integrators/registry.h"

#include <array>

#include "core/base/check.h"
#include "core/settings/registry.h"

namespace core {
namespace {

constexpr std::array<std::string_view, 11> kPathOptions = {
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
};
constexpr std::array<std::string_view, 3> kDirectOptions = {"/sampler/type", "/sampler/replicates",
                                                            "/adaptive"};
constexpr std::array<std::string_view, 3> kLightTraceOptions = {
    "/integrator/max_depth", "/sampler/type", "/sampler/replicates"};

constexpr std::array kIntegrators = {
    IntegratorEntry{.name = "path",
                    .summary = "Path tracing with next-event estimation and BSDF sampling combined "
                               "by MIS.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_path_tracer,
                    .accepts = kPathOptions},
    IntegratorEntry{.name = "direct",
                    .summary = "Emitted and direct light only: the path tracer's picture at "
                               "max_depth 1.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_direct,
                    .accepts = kDirectOptions,
                    .set_defaults = [](RenderSettings& settings) { settings.max_depth = 1; }},
    IntegratorEntry{.name = "light-trace",
                    .summary = "Particles from the lights, each surface they meet connected to the "
                               "camera: caustics; mirrors and glass are path traced.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_light_tracer,
                    .accepts = kLightTraceOptions,
                    .splats = true},
    IntegratorEntry{.name = "bdpt",
                    .summary = "Bidirectional path tracing: subpaths from the camera and from the "
                               "lights, connected in every way and combined by MIS.",
                    .bias = "none",
                    .error = ErrorValidity::kValid,
                    .make = &make_bdpt,
                    .accepts = kLightTraceOptions,
                    .splats = true,
                    .disperses = false},
};

}  // namespace

std::span<const IntegratorEntry> integrators() { return kIntegrators; }

std::unique_ptr<const Integrator> make_integrator(const IntegratorInput& input) {
  const IntegratorEntry* row = find_integrator(input.settings.integrator);
  CHECK(row != nullptr);
  return row->make(input);
}

}  // namespace core
