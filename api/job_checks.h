/// Rules of a job request that look at more than one member.
#pragma once

#include "api/faults.h"
#include "api/job_spec.h"
#include "core/settings/registry.h"

namespace api {

/// Camera members that exclude or need each other, or that describe no view.
void check_camera(const JobSpec& spec, Faults& faults);
/// Crop inside the film; size of the film (the one fault that is 413).
void check_film(const core::FilmSettings& film, Faults& faults);
/// preview_key without class preview.
void check_class(const JobSpec& spec, Faults& faults);
/// An option that differs from its default, though neither strategy nor integrator uses it.
void check_options(const JobSpec& spec, Faults& faults);
/// A stop rule that needs an error that the job has not. stop: may be other rules than the job's.
void check_error_target(const core::StopRules& stop, const JobSpec& spec, Faults& faults);

}  // namespace api
