/// Factories of the integrators, for the rows of the integrator registry.
#pragma once

#include <memory>

#include "core/integrators/integrator.h"

namespace core {

std::unique_ptr<const Integrator> make_path_tracer(const IntegratorInput& input);
/// Path tracing with the ground as shadow catcher.
std::unique_ptr<const Integrator> make_catcher(const IntegratorInput& input);
std::unique_ptr<const Integrator> make_direct(const IntegratorInput& input);
std::unique_ptr<const Integrator> make_light_tracer(const IntegratorInput& input);
std::unique_ptr<const Integrator> make_bdpt(const IntegratorInput& input);
std::unique_ptr<const Integrator> make_metropolis(const IntegratorInput& input);
std::unique_ptr<const Integrator> make_irradiance_cache(const IntegratorInput& input);
/// Makes sppm and photon-map.
std::unique_ptr<const Integrator> make_photon_tracer(const IntegratorInput& input);
/// Returns the initial radius of their gather disks, unless the job sets it.
float usual_photon_radius_m(const SceneData& scene, const Camera& camera, const FilmSettings& film);

}  // namespace core
