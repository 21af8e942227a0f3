/// Camera: generates rays for film positions, and evaluates their importance. Perspective,
/// orthographic and calibrated (pinhole) with a thin lens, fisheye, and panorama.
///
/// A panorama is equirectangular: its centre looks along forward(), `right` is a quarter of its
/// width to the right of it, and the top row is up. Viewed along +x it matches the layout of an
/// environment map.
///
/// Positions on the film are those of COLMAP: pixel i goes from i to i + 1. OpenCV's count from the
/// centre of the first pixel, so 0.5 is added to its cx and cy.
///
/// A camera of the file sees what lies between its znear and zfar, measured along forward(): its
/// rays begin at the near plane, so that neither surfaces nor fog before it exist for them, and end
/// at the far plane. Cameras that a job places, fisheyes and panoramas see everything.
///
/// Importance is normalised per pixel: over the rays of any square pixel of film, importance times
/// the cosine to forward() integrates to 1. With a reconstruction filter f that integrates to 1 (in
/// pixels), the value of pixel j is the integral of f(film_px - centre of j) * we * cos * L over
/// the lens and all directions. A path tracer that draws film_px from f averages the same. Source:
/// Veach 1997, 8.2 and 8.3; PBR 3rd ed. 16.1.1.
#pragma once

#include <memory>
#include <optional>
#include <utility>

#include "core/accel/accel.h"
#include "core/base/result.h"
#include "core/camera/camera_choice.h"
#include "core/camera/distortion.h"
#include "core/description/scene_description.h"
#include "core/math/bounds.h"
#include "core/math/generic.h"
#include "core/math/vec.h"
#include "core/media/medium_stack.h"
#include "core/settings/settings.h"

namespace core {

class Camera {
 public:
  /// Selects a camera of the file and applies the job's overrides; frames the scene if there is
  /// none. All positions count from the scene's origin. Errors: kInvalidArgument at "/camera/...".
  static Result<Camera> create(const CameraSettings& settings,
                               const std::vector<CameraDescription>& cameras, const Bounds& bounds,
                               int width, int height);

  struct CameraRay {
    Ray ray;               ///< direction is unit; t is metres; ends at the far plane
    float start_m = 0;     ///< from the lens to the origin, which lies on the near plane
    float spread_rad = 0;  ///< angle of one pixel, for ray cones; 0 if orthographic
    float width_m = 0;     ///< width of a pixel at the origin
    Vec2 film_px{};
    const StartMedia* start = nullptr;  ///< around the origin; null: in no solid
    /// Returns the point on the lens.
    Vec3 from_lens() const noexcept { return ray.origin - ray.direction * start_m; }
  };
  /// Returns the ray of a film position in pixels of the full film, x to the right, y down. lens in
  /// [0,1)^2.
  CameraRay ray(Vec2 film_px, Vec2 lens) const noexcept;
  /// Sets the solids around the camera, for all its rays; null: in none.
  void start_in(std::shared_ptr<const StartMedia> start) noexcept { start_ = std::move(start); }
  bool is_in_solids() const noexcept { return start_ != nullptr; }

  /// Returns whether rays start at one point and have no distortion.
  bool is_pinhole() const noexcept {
    return !is_sphere() && !is_orthographic() && !is_distorted() && !(aperture_radius_m_ > 0);
  }
  /// As in CameraRay, of one film position or of lanes.
  template <typename F>
  struct PinholeRay {
    Vec3Of<F> origin, direction;
    F start_m, spread_rad, width_m, t_max;
  };
  /// Returns ray(). Pre: is_pinhole().
  template <typename F>
  PinholeRay<F> pinhole_ray(F x_px, F y_px) const noexcept {
    using V = Vec3Of<F>;
    const auto [x, y] = plane_position(x_px, y_px);
    const V d = V(forward_) + V(right_) * x + V(up_) * y;
    const F secant = length(d);
    const F start_m = secant * near_m_;
    const F spread_rad(pixel_height());
    return {V(eye_) + d * F(near_m_),
            d * (1 / secant),
            start_m,
            spread_rad,
            spread_rad * start_m,
            min(secant * depth_m_, F(Ray{}.t_max))};
  }

  /// The densities of ray() for one ray per pixel, anywhere on the film; their product is we * cos.
  /// A pinhole has no area, so its position has probability 1 (pdf_area 1). An orthographic camera
  /// without a lens has a single direction (pdf_solid_angle 1). The film of a panorama or fisheye
  /// is a sphere around its pinhole, so its cosine is 1.
  struct Importance {
    Vec2 film_px;               ///< may lie outside the film, where filters still reach
    float we = 0;               ///< [1/(m^2 sr)]; 0 outside the view
    float pdf_area = 0;         ///< of the origin [1/m^2]
    float pdf_solid_angle = 0;  ///< of the direction [1/sr]
  };
  /// Returns pbrt's We and PDF_We. direction: unit, away from the camera. origin: anywhere on the
  /// ray from the lens (panorama, fisheye: the eye).
  Importance importance(Vec3 origin, Vec3 direction) const noexcept;

  /// A connection from a scene point to a point on the lens; pbrt's SampleWi. A particle of power
  /// beta that leaves `point` with BSDF f adds beta * f * cos * importance.we / pdf_solid_angle to
  /// the film if `origin` is visible from `point`.
  struct ImportanceSample {
    Vec3 wi_world;  ///< unit, from the point to the camera
    Vec3 origin;    ///< of the camera's ray: on the near plane
    float distance_m = 0;
    float pdf_solid_angle = 0;  ///< of wi_world at the point; 0 outside of the clipping planes
    Importance importance;
  };
  /// Samples the lens; lens in [0,1)^2. Without a lens, pdf_solid_angle is that of a lens of unit
  /// area, or 1 if the camera is orthographic, so the quotient stays correct.
  ImportanceSample sample_wi(Vec3 point, Vec2 lens) const noexcept;
  /// Returns the film position at which ray() with this lens position would see the point without
  /// clipping planes; empty behind the camera.
  std::optional<Vec2> project(Vec3 point, Vec2 lens) const noexcept;

  CameraType type() const noexcept { return type_; }
  bool is_orthographic() const noexcept { return type_ == CameraType::kOrthographic; }
  Vec3 forward() const noexcept { return forward_; }
  Vec3 right() const noexcept { return right_; }
  Vec3 up() const noexcept { return up_; }
  /// Returns the middle of the lens.
  Vec3 eye() const noexcept { return eye_; }
  /// Returns pixels per unit of the film (focal length, metre or radian) and its origin.
  Intrinsics intrinsics() const noexcept { return intrinsics_; }
  /// Returns whether the camera bends straight lines.
  bool is_distorted() const noexcept { return distortion_.has_value(); }
  bool is_fisheye() const noexcept { return distortion_ && distortion_->is_fisheye(); }

 private:
  bool is_sphere() const noexcept { return type_ == CameraType::kPanorama || is_fisheye(); }
  Vec3 toward(Vec2 film_px) const noexcept;
  /// x to the right and y up, in the unit of half_width_.
  template <typename F>
  Vec2Of<F> plane_position(F x_px, F y_px) const noexcept {
    return {((x_px + x_px) / width_px_ - 1) * half_width_ + middle_.x,
            (1 - (y_px + y_px) / height_px_) * half_height_ + middle_.y};
  }
  /// In the unit of half_height_.
  float pixel_height() const noexcept { return 2 * half_height_ / height_px_; }
  ImportanceSample seen_without_planes(Vec3 point, Vec2 lens) const noexcept;
  /// Sets position and axes. file: null if no camera of the scene is chosen. Errors: of create().
  Status place(const CameraSettings& settings, const CameraDescription* file, const Bounds& bounds);
  /// file: null if its lens does not count. distance_m: of the focus, by default.
  Intrinsics intrinsics(const CameraSettings& settings, const CameraDescription* file,
                        float distance_m) const noexcept;
  void set_film(Intrinsics film) noexcept;
  void set_planes(const CameraDescription& file, const Bounds& bounds) noexcept;
  Vec2 film_position(float x, float y) const noexcept;
  float pixels_per_area() const noexcept;
  float lens_area_m2() const noexcept;

  Vec3 eye_;
  Vec3 right_;
  Vec3 up_;
  Vec3 forward_;
  CameraType type_ = CameraType::kPerspective;
  float width_px_ = 1;
  float height_px_ = 1;
  /// Extent of the film: at distance 1 (perspective), in metres (orthographic) or in radians
  /// (panorama).
  float half_width_ = 1;
  float half_height_ = 1;
  Vec2 middle_{};  ///< of the film, in the same unit, x to the right and y up
  Intrinsics intrinsics_;
  std::optional<Distortion> distortion_;
  float aperture_radius_m_ = 0;
  float focus_distance_m_ = 1;
  std::shared_ptr<const StartMedia> start_;
  float near_m_ = 0;
  float depth_m_ = Ray{}.t_max;  ///< from the near to the far plane
};

}  // namespace core
