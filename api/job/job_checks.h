/// Rules of a job request that depend on several members.
#pragma once

#include <string>

#include "api/job/job_spec.h"
#include "api/json/faults.h"
#include "core/base/result.h"
#include "core/denoise/denoiser_type.h"
#include "core/integrators/rules.h"

namespace api {

/// Checks for camera members that exclude or require each other, or that describe no view.
void check_camera(const JobSpec& spec, Faults& faults);
/// Checks the size of the film (the only fault with 413).
void check_film(const core::FilmSettings& film, Faults& faults);
/// Makes the film of a job without an image a single pixel without layers.
void drop_image(JobSpec& spec);
/// Refuses a job with neither image nor meter.
void check_image(const JobSpec& spec, Faults& faults);
/// Refuses preview_key without class preview.
void check_class(const JobSpec& spec, Faults& faults);
/// Refuses what the rules of the core do not let go together (core/integrators/rules.h). scene:
/// null while it is not known.
void check_rules(const JobSpec& spec, const core::SceneTraits* scene, Faults& faults);
/// Refuses an open shutter in the rest pose.
void check_shutter(const JobSpec& spec, Faults& faults);
/// Refuses to denoise without a denoiser. where: who asks for it.
core::Status check_denoiser(core::DenoiserType type, std::string where);
/// Refuses a stop rule that needs an error estimate that the job lacks. stop: may differ from the
/// job's.
void check_error_target(const core::StopRules& stop, const JobSpec& spec, Faults& faults);

}  // namespace api
