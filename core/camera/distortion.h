/// Distortion: where a lens shows a direction, and its inverse.
///
/// Frame: as OpenCV's, x to the right, y down, z ahead. A point of the image counts in focal
/// lengths from the principal point. Without distortion a direction is shown at (x / z, y / z).
///
/// opencv moves that point (x, y), r^2 = x^2 + y^2, to
///   x (1 + k1 r^2 + k2 r^4 + k3 r^6) / (1 + k4 r^2 + k5 r^4 + k6 r^6)
///     + 2 p1 x y + p2 (r^2 + 2 x^2) + s1 r^2 + s2 r^4
///   y (the same) + p1 (r^2 + 2 y^2) + 2 p2 x y + s3 r^2 + s4 r^4.
/// fisheye shows a direction at angle theta from ahead at the distance
///   theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8), also where theta > pi / 2.
/// Source: OpenCV 4, modules calib3d and cv::fisheye.
///
/// Beyond the distance at which the image begins to fold back, polynomials say nothing about a
/// lens: such directions are not shown.
#pragma once

#include <array>
#include <optional>

#include "core/math/place.h"
#include "core/settings/camera_settings.h"

namespace core {

class Distortion {
 public:
  /// Pre: settings.k has as many coefficients as the model takes.
  explicit Distortion(const DistortionSettings& settings) noexcept;

  bool is_fisheye() const noexcept { return is_fisheye_; }

  struct Point {
    double x = 0;
    double y = 0;
  };
  struct Projected {
    Point at;
    /// Areas of the image per area of the undistorted image (fisheye: per solid angle).
    double scale = 1;
  };
  /// direction: of any length. Empty if it is not shown.
  std::optional<Projected> project(Place direction) const noexcept;

  struct Unprojected {
    Place direction;       ///< not of unit length; opencv: z is 1
    bool is_shown = true;  ///< false: the point shows nothing; this direction is shown near it
  };
  /// Inverse of project(), to kTolerance.
  Unprojected unproject(Point at) const noexcept;

  static constexpr double kTolerance = 1e-10;  ///< focal lengths

 private:
  /// The distorted point and its derivatives.
  struct Local {
    Point at;
    double xx, xy, yx, yy;
    double determinant() const noexcept { return xx * yy - xy * yx; }
  };
  Local local(Point p) const noexcept;
  /// Returns the distance at this angle from ahead, and its derivative.
  Point radius(double theta) const noexcept;
  Unprojected undistorted(Point at) const noexcept;

  bool is_fisheye_ = false;
  std::array<double, 12> k_{};
  double theta_max_ = 0;  ///< fisheye: up to here, distances grow
};

}  // namespace core
