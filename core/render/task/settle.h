/// Settles what a job leaves to pilots: the integrator `auto`, the light sampler `measured`,
/// `measured` splitting, and light samples in media. The only step before rendering that traces
/// paths; it can be stopped.
#pragma once

#include <memory>
#include <stop_token>
#include <string>

#include "core/base/result.h"
#include "core/render/picture/renderer.h"
#include "core/render/picture/view.h"

namespace core {

/// Sets view.measured, and replaces `auto` by the integrator chosen, with its defaults, and light
/// sampler `measured` by its choice. Returns a warning that names the integrator chosen; empty if
/// the job names it. Errors: as Renderer::create(); kCancelled if a stop was requested.
Result<std::string> settle(View& view, const StopRules& rules, const std::stop_token& stop = {});

/// Copies to a job's settings what settle() replaces in those of its view.
void adopt_settled(RenderSettings& to, const RenderSettings& settled);

/// Sets view.measured. Pre: the integrator is not `auto`. Errors: as above.
Status measure(View& view, const std::stop_token& stop = {});

/// Settles the view and creates its renderer. Errors: as above.
Result<std::shared_ptr<const Renderer>> settled_renderer(View view, const StopRules& rules = {},
                                                         const std::stop_token& stop = {});

}  // namespace core
