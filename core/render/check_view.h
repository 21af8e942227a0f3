/// Checks that a view's integrator supports the view and the options.
#pragma once

#include "core/base/result.h"
#include "core/camera/moving_camera.h"
#include "core/render/view.h"
#include "core/settings/registry.h"

namespace core {

/// Returns the view's camera. Pre: its integrator is not kAutomaticIntegrator. Errors: as
/// Renderer::create().
Result<MovingCamera> check_view(const View& view);
/// Checks that the integrator supports the dispersion, the media and the background of the scene,
/// and the job's fog, with these options. integrator: its row; null if there is none. Errors:
/// kInvalidArgument.
Status check_matter(const RenderSettings& settings, const SceneSummary& scene,
                    const IntegratorEntry* integrator);
/// Checks that the crop is inside the film. Errors: kInvalidArgument at "/film/crop".
Status check_crop(const FilmSettings& film);

}  // namespace core
