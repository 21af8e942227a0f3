/// FilterSampler::sample() and Camera::ray() in lanes.
#pragma once

#include <optional>
#include <span>

#include "core/camera/camera.h"
#include "core/camera/moving_camera.h"
#include "core/film/due_sample.h"
#include "core/film/filter.h"
#include "core/math/lane_math.h"
#include "core/wave/lane_sampler.h"

namespace core {

template <std::size_t N>
struct CameraRayLanes {
  Vec3s<N> origin;
  Vec3s<N> direction;
  Floats<N> spread_rad;
  Floats<N> width_m;
  Floats<N> start_m;  ///< as in Camera::CameraRay
  Floats<N> t_max;
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
        pinhole_(moving == nullptr ? camera.pinhole() : std::nullopt) {}

  /// The random numbers that rays() needs.
  Drawn drawn() const { return pinhole_ ? Drawn::kPair : Drawn::kAll; }

  /// due: at most N samples; the results of lanes beyond them are unspecified. time: if it moves.
  template <std::size_t N>
  CameraRayLanes<N> rays(std::span<const DueSample> due, const Vec4s<N>& u,
                         Floats<N> time = Floats<N>(0)) const {
    CameraRayLanes<N> out{};
    Floats<N> x(0.5F);
    Floats<N> y(0.5F);
    for (std::size_t k = 0; k < due.size(); ++k) {
      x.v[k] += static_cast<float>(due[k].x);
      y.v[k] += static_cast<float>(due[k].y);
    }
    if (filter_.is_positive()) {
      const bool is_box = filter_.is_box();
      const Floats<N> radius(filter_.radius_px());
      const auto offset = [&](Floats<N> t) {
        const Floats<N> at = is_box ? t : filter_.table().sample(t).x;
        return (at + at - Floats<N>(1)) * radius;
      };
      x = x + offset(u.x);
      y = y + offset(u.y);
      out.weight = Floats<N>(1);
    } else {
      for (std::size_t k = 0; k < due.size(); ++k) {
        const FilterSampler::Offset at = filter_.sample({u.x.v[k], u.y.v[k]});
        x.v[k] += at.offset_px.x;
        y.v[k] += at.offset_px.y;
        out.weight.v[k] = at.weight;
      }
    }
    out.film_px = {x, y};
    if (pinhole_) {
      through_pinhole(*pinhole_, x, y, out);
      return out;
    }
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
  template <std::size_t N>
  static void through_pinhole(const Camera::Pinhole& p, Floats<N> x_px, Floats<N> y_px,
                              CameraRayLanes<N>& out) {
    const Floats<N> one(1);
    const Floats<N> x = ((x_px + x_px) / Floats<N>(p.width_px) - one) * Floats<N>(p.half_width) +
                        Floats<N>(p.middle.x);
    const Floats<N> y = (one - (y_px + y_px) / Floats<N>(p.height_px)) * Floats<N>(p.half_height) +
                        Floats<N>(p.middle.y);
    const Vec3s<N> d = Vec3s<N>(p.forward) + Vec3s<N>(p.right) * x + Vec3s<N>(p.up) * y;
    const Floats<N> secant = length(d);
    out.origin = Vec3s<N>(p.eye) + d * Floats<N>(p.near_m);
    out.direction = d * (one / secant);
    out.spread_rad = Floats<N>(p.spread_rad);
    out.start_m = secant * Floats<N>(p.near_m);
    out.width_m = out.spread_rad * out.start_m;
    out.t_max = min(secant * Floats<N>(p.depth_m), Floats<N>(Ray{}.t_max));
  }

  const Camera& camera_;
  const MovingCamera* moving_;
  const FilterSampler& filter_;
  std::optional<Camera::Pinhole> pinhole_;
};

}  // namespace core
