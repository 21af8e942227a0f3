/// What can be said about a job's camera from the names and kinds of the file's cameras alone.
#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/settings/settings.h"

namespace core {

/// Returns the file's camera that the settings select, by default the first; null if the file has
/// none. Errors: kInvalidArgument at "/camera/name" or "/camera/index".
Result<const CameraDescription*> chosen_camera(const CameraSettings& settings,
                                               const std::vector<CameraDescription>& cameras);
/// Returns the type of the job's camera. file: as above. is_posed: the job places the camera.
CameraType camera_type(const CameraSettings& settings, const CameraDescription* file,
                       bool is_posed) noexcept;
/// Errors: kInvalidArgument at "/camera/..." for members that do not apply to the type.
Status check_members(const CameraSettings& settings, CameraType type);

}  // namespace core
