/// A job's camera: plain values; core/integrators/rules.h says what goes together, and
/// core/camera/camera_choice.h which members a type of camera has.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "core/math/place.h"
#include "core/math/vec.h"

namespace core {

enum class CameraType { kPerspective, kOrthographic, kPanorama, kPinhole };

enum class DistortionModel { kNone, kOpencv, kFisheye };

/// Lens distortion with OpenCV's coefficients (core/camera/distortion.h).
struct DistortionSettings {
  DistortionModel model = DistortionModel::kNone;
  std::vector<double> k;  ///< opencv: k1 k2 p1 p2 [k3 [k4 k5 k6 [s1 s2 s3 s4]]]; fisheye: k1 to k4
  friend bool operator==(const DistortionSettings&, const DistortionSettings&) = default;
};

/// Axes of a camera: x, y, z are right, down, ahead (opencv); right, up, back (opengl); ahead,
/// left, up (ros: REP 103, of a body).
enum class PoseConvention { kOpencv, kOpengl, kRos };

struct CameraPose {
  PoseConvention convention = PoseConvention::kOpencv;
  /// From the camera's axes to the world [m], row by row.
  std::array<double, 16> matrix = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
  Place position() const noexcept { return {matrix[3], matrix[7], matrix[11]}; }
  /// Returns the image of an axis of the camera, nearly of unit length.
  Vec3 axis(std::size_t i) const noexcept {
    return Place{matrix[i], matrix[4 + i], matrix[8 + i]}.rounded();
  }
  Vec3 forward() const noexcept {
    return convention == PoseConvention::kRos      ? axis(0)
           : convention == PoseConvention::kOpengl ? -axis(2)
                                                   : axis(2);
  }
  Vec3 up() const noexcept {
    return convention == PoseConvention::kRos      ? axis(2)
           : convention == PoseConvention::kOpengl ? axis(1)
                                                   : -axis(1);
  }
  friend bool operator==(const CameraPose&, const CameraPose&) = default;
};

/// Overrides of the file's camera; empty members keep the file's values.
struct CameraSettings {
  std::optional<CameraType> type;  ///< empty: perspective if the pose differs from the file's
  std::optional<std::string> name;
  std::optional<int> index;
  std::optional<Place> position;
  std::optional<Place> target;
  std::optional<Vec3> up;
  std::optional<float> vertical_fov_degrees;
  /// Height of the film in metres; empty: the file's, or the height that a perspective camera
  /// covers in the plane through the target (or else the scene's centre).
  std::optional<float> orthographic_height_m;
  std::optional<float> aperture_radius_m;
  std::optional<float> focus_distance_m;
  std::optional<CameraPose> pose = {};  ///< instead of position, target and up
  /// How far the view moves to the right and up, in widths and heights of the film; for
  /// kPerspective.
  std::optional<Vec2> shift = {};
  /// For kPinhole, in pixels of the full film, whose left upper corner is (0, 0). Only fx is
  /// needed: fy is then fx, and (cx, cy) the film's centre.
  std::optional<double> fx_px = {};
  std::optional<double> fy_px = {};
  std::optional<double> cx_px = {};
  std::optional<double> cy_px = {};
  DistortionSettings distortion = {};  ///< for kPinhole

  /// Returns whether the job places the camera.
  bool is_placed() const noexcept { return position.has_value() || pose.has_value(); }
};

}  // namespace core
