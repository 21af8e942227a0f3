/// What a view's integrator and options do not go with.
#pragma once

#include "core/base/result.h"
#include "core/render/view.h"
#include "core/settings/registry.h"

namespace core {

/// Media and shares of the light: does the integrator render them, with these options?
/// integrator: its row; null: there is none. Errors: kInvalidArgument.
Status check_light(const View& view, const IntegratorEntry* integrator);
/// Does the picture go with an open shutter? The same.
Status check_shutter(const RenderSettings& settings, const IntegratorEntry* integrator);

}  // namespace core
