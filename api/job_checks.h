/// Rules of a job request that look at more than one member.
#pragma once

#include "api/faults.h"
#include "api/job_spec.h"

namespace api {

/// Camera members that exclude or need each other, or that describe no view.
void check_camera(const core::CameraSettings& camera, Faults& faults);
/// Crop inside the film; size of the film (the one fault that is 413).
void check_film(const core::FilmSettings& film, Faults& faults);
/// preview_key without class preview.
void check_class(const JobSpec& spec, Faults& faults);
/// An option that differs from its default, though neither strategy nor integrator uses it.
void check_options(const JobSpec& spec, Faults& faults);

}  // namespace api
