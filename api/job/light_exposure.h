/// Exposure of images whose light is known.
#pragma once

#include <optional>

#include "api/job/job_spec.h"

namespace api {

/// Returns the exposure in stops of an image of the job, if studio light illuminates it: a white
/// product stays white, however much of the image is white. Metering of the image itself
/// (core/layers/exposure.h) knows only the image, and would show white on white as grey. The light
/// is read from the camera's side, whatever the front of the model is; from +z for cameras of
/// files, whose pose only the scene knows.
std::optional<float> light_exposure_stops(const JobSpec& spec);

}  // namespace api
