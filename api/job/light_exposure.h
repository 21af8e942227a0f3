/// Automatic exposure of images.
#pragma once

#include <functional>

#include "api/job/job_spec.h"

namespace api {

/// Returns the exposure of an image of the job, in stops. If studio light illuminates it, a white
/// product stays white, however much of the image is white. Metering of the image itself
/// (core/layers/exposure.h) knows only the image, and would show white on white as grey. The light
/// is read from the camera's side, whatever the front of the model is; from +z for cameras of
/// files, whose pose only the scene knows. metered: gives the exposure under other light.
double auto_exposure_stops(const JobSpec& spec, const std::function<double()>& metered);

}  // namespace api
