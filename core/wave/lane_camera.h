/// The camera rays of N samples at once.
#pragma once

#include <span>

#include "core/camera/camera.h"
#include "core/camera/moving_camera.h"
#include "core/film/due_sample.h"
#include "core/film/filter.h"
#include "core/math/lane_math.h"
#include "core/samplers/sobol.h"

namespace core {

template <std::size_t N>
struct CameraRayLanes : Camera::PinholeRay<Floats<N>> {
  Floats<N> weight;  ///< of the reconstruction filter
  Vec2s<N> film_px;
};

/// Filters without negative lobes and cameras at rest without a lens or distortion are evaluated in
/// SIMD, all others lane by lane.
class LaneCamera {
 public:
  /// moving: while the shutter is open; null if the camera is at rest.
  LaneCamera(const Camera& camera, const FilterSampler& filter,
             const MovingCamera* moving = nullptr)
      : camera_(camera),
        moving_(moving),
        filter_(filter),
        is_pinhole_(moving == nullptr && camera.is_pinhole()) {}

  /// The random numbers that rays() needs.
  Drawn drawn() const { return is_pinhole_ ? Drawn::kPair : Drawn::kAll; }

  /// due: at most N samples; the results of lanes beyond them are unspecified. time: if it moves.
  template <std::size_t N>
  CameraRayLanes<N> rays(std::span<const DueSample> due, const Vec4s<N>& u,
                         Floats<N> time = Floats<N>(0)) const {
    Floats<N> weight(1);
    Floats<N> x(0.5F);
    Floats<N> y(0.5F);
    for (std::size_t k = 0; k < due.size(); ++k) {
      x.v[k] += static_cast<float>(due[k].x);
      y.v[k] += static_cast<float>(due[k].y);
    }
    if (filter_.is_positive()) {
      x = x + filter_.offset_px(u.x);
      y = y + filter_.offset_px(u.y);
    } else {
      for (std::size_t k = 0; k < due.size(); ++k) {
        const FilterSampler::Offset at = filter_.sample({u.x.v[k], u.y.v[k]});
        x.v[k] += at.offset_px.x;
        y.v[k] += at.offset_px.y;
        weight.v[k] = at.weight;
      }
    }
    if (is_pinhole_) {
      return {camera_.pinhole_ray(x, y), weight, {x, y}};
    }
    CameraRayLanes<N> out{{}, weight, {x, y}};
    for (std::size_t k = 0; k < due.size(); ++k) {
      const Vec2 film_px = {x.v[k], y.v[k]};
      const Vec2 lens = {u.z.v[k], u.w.v[k]};
      const Camera::CameraRay one =
          moving_ != nullptr ? moving_->ray(film_px, lens, time.v[k]) : camera_.ray(film_px, lens);
      out.origin.set(k, one.ray.origin);
      out.direction.set(k, one.ray.direction);
      out.spread_rad.v[k] = one.spread_rad;
      out.width_m.v[k] = one.width_m;
      out.start_m.v[k] = one.start_m;
      out.t_max.v[k] = one.ray.t_max;
    }
    return out;
  }

 private:
  const Camera& camera_;
  const MovingCamera* moving_;
  const FilterSampler& filter_;
  bool is_pinhole_;
};

}  // namespace core
