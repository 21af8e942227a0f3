/// What can be said about a job's camera from the names and kinds of the file's cameras alone.
#pragma once

#include <vector>

#include "core/base/result.h"
#include "core/description/scene_description.h"
#include "core/math/place.h"
#include "core/settings/settings.h"

namespace core {

/// Returns whether an image can be upright: forward is not 0, and up is neither 0 nor parallel to
/// it.
bool span_view(Place forward, Place up) noexcept;
/// Returns what members that place a camera lack, or why they describe no view, at "/camera/...".
std::vector<Error> view_faults(const CameraSettings& settings);

/// Returns the file's camera that the settings select, by default the first; null if the file has
/// none. Pre: no view_faults(). Errors: kInvalidArgument at "/camera/name" or "/camera/index".
Result<const CameraDescription*> chosen_camera(const CameraSettings& settings,
                                               const std::vector<CameraDescription>& cameras);
/// Returns the type of the job's camera. file: as above. is_posed: the job places the camera.
CameraType camera_type(const CameraSettings& settings, const CameraDescription* file,
                       bool is_posed) noexcept;
/// Errors: kInvalidArgument at "/camera/..." for members that do not apply to the type.
Status check_members(const CameraSettings& settings, CameraType type);

/// Where the film lies, in pixels: how many of them are one unit (focal length, metre or radian),
/// and where its origin is.
struct Intrinsics {
  double fx = 1;
  double fy = 1;
  double cx = 0;
  double cy = 0;
};
/// Returns those of a pinhole camera. Pre: fx is given. width, height: of the full film.
Intrinsics intrinsics_of(const CameraSettings& settings, int width, int height) noexcept;
/// Returns tangents of half the view's width and height around the middle of a view that is not
/// distorted or shifted. Cameras without a field of view of their own have 45 degrees.
Vec2 half_view(const CameraSettings& settings, int width, int height) noexcept;
/// Checks what the types and values of members leave open: a pinhole camera's lens, whose every
/// pixel must show something, and a pose's rotation. Errors: as check_members().
Status check_values(const CameraSettings& settings, int width, int height);

}  // namespace core
