/// Checks that a view's integrator supports the view and the options.
#pragma once

#include "core/base/result.h"
#include "core/render/view.h"
#include "core/settings/registry.h"

namespace core {

/// Checks that the integrator supports the dispersion and the media of the scene, and the job's
/// fog, with these options. integrator: its row; null if there is none. Errors: kInvalidArgument.
Status check_matter(const RenderSettings& settings, const SceneSummary& scene,
                    const IntegratorEntry* integrator);
/// Checks that the integrator supports the shares of the light and spectral paths with the options.
/// Parameters and errors as above.
Status check_light(const View& view, const IntegratorEntry* integrator);
/// Checks that the integrator supports an open shutter. Parameters and errors as above.
Status check_shutter(const RenderSettings& settings, const IntegratorEntry* integrator);

}  // namespace core
