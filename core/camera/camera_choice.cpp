#include "core/camera/camera_choice.h"

#include <string>
#include <utility>

namespace core {

Result<const CameraDescription*> chosen_camera(const CameraSettings& settings,
                                               const std::vector<CameraDescription>& cameras) {
  if (settings.name && settings.index) {
    return Error{ErrorCode::kInvalidArgument, "give a camera's name or its index, not both",
                 "/camera/index"};
  }
  if (settings.name) {
    for (const CameraDescription& camera : cameras) {
      if (camera.name == *settings.name) {
        return &camera;
      }
    }
    std::string names;
    for (const CameraDescription& camera : cameras) {
      names += (names.empty() ? "" : ", ") + ("'" + camera.name + "'");
    }
    return Error{ErrorCode::kInvalidArgument,
                 "the scene has no camera '" + *settings.name + "'; it has " +
                     (names.empty() ? std::string("none") : names),
                 "/camera/name"};
  }
  if (settings.index) {
    if (*settings.index < 0 || *settings.index >= static_cast<int>(cameras.size())) {
      return Error{ErrorCode::kInvalidArgument,
                   std::to_string(*settings.index) + " is not one of the scene's " +
                       std::to_string(cameras.size()) + " cameras",
                   "/camera/index"};
    }
    return &cameras[static_cast<std::size_t>(*settings.index)];
  }
  return cameras.empty() ? nullptr : &cameras.front();
}

CameraType camera_type(const CameraSettings& settings, const CameraDescription* file,
                       bool is_posed) noexcept {
  const bool is_orthographic = !is_posed && file != nullptr && file->orthographic;
  return settings.type.value_or(is_orthographic ? CameraType::kOrthographic
                                                : CameraType::kPerspective);
}

Status check_members(const CameraSettings& settings, CameraType type) {
  const auto refused = [](std::string message, std::string pointer) {
    return Error{ErrorCode::kInvalidArgument, std::move(message), std::move(pointer)};
  };
  if (type != CameraType::kPerspective && settings.vertical_fov_degrees) {
    return refused("applies only to perspective cameras", "/camera/vertical_fov_degrees");
  }
  if (type == CameraType::kPanorama && settings.aperture_radius_m.value_or(0) > 0) {
    return refused("a panorama has no lens", "/camera/aperture_radius");
  }
  if (type != CameraType::kOrthographic && settings.orthographic_height_m) {
    return refused("applies only to orthographic cameras", "/camera/orthographic_height");
  }
  return ok_status();
}

}  // namespace core
