#include "core/render/picture/view.h"

#include <utility>

#include "core/integrators/registry.h"

namespace core {

SceneTraits traits_of(const SceneSummary& scene) {
  return {.has_scattering = scene.has_scattering,
          .has_dispersion = scene.has_dispersion,
          .light_groups = scene.light_groups};
}

bool leaves_a_choice(const RenderSettings& settings) {
  return settings.integrator == kAutomaticIntegrator ||
         settings.light_sampler == LightSamplerType::kMeasured;
}

Status check_rules(const View& view) {
  const SceneTraits scene = traits_of(view.scene->summary());
  auto broken = broken_rules(view.settings, view.camera, &scene);
  if (broken.empty()) {
    return ok_status();
  }
  return Error{ErrorCode::kInvalidArgument, std::move(broken.front().reason),
               std::move(broken.front().pointer)};
}

Result<MovingCamera> camera_of(const View& view) {
  if (const Status fits = check_rules(view); !fits) {
    return fits.error();
  }
  const SceneSummary& scene = view.scene->summary();
  const FilmSettings& film = view.settings.film;
  return MovingCamera::create(view.camera, scene.cameras, scene.bounds, film.width, film.height);
}

}  // namespace core
