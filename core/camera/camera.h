/// Camera: rays through the film; perspective, orthographic, thin lens.
#pragma once

#include "core/accel/accel.h"
#include "core/base/result.h"
#include "core/math/bounds.h"
#include "core/math/vec.h"
#include "core/render/settings.h"
#include "core/scene/scene_description.h"

namespace core {

class Camera {
 public:
  /// Picks and overrides the file's cameras as the job asks; a scene without one is framed.
  /// Errors: kInvalidArgument at "/camera/...".
  static Result<Camera> create(const CameraSettings& settings,
                               const std::vector<CameraDescription>& cameras, const Bounds& bounds,
                               int width, int height);

  struct CameraRay {
    Ray ray;               ///< direction is unit; t is metres
    float spread_rad = 0;  ///< angle of one pixel, for ray cones; 0 for orthographic
    float width_m = 0;     ///< width of a pixel at the origin; 0 for perspective
  };
  /// film: position in pixels of the full film, x to the right, y down. lens in [0,1)^2.
  CameraRay ray(Vec2 film_px, Vec2 lens) const noexcept;

 private:
  Vec3 eye_;
  Vec3 right_;
  Vec3 up_;
  Vec3 forward_;
  bool orthographic_ = false;
  float width_px_ = 1;
  float height_px_ = 1;
  float half_width_ = 1;   ///< at distance 1 (perspective) or in metres (orthographic)
  float half_height_ = 1;
  float aperture_radius_m_ = 0;
  float focus_distance_m_ = 1;
};

}  // namespace core
