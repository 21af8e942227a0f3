/// FilterSampler::sample() and Camera::ray() in lanes.
#pragma once

#include <optional>
#include <span>

#include "core/camera/camera.h"
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
  Floats<N> weight;  ///< of the filter
};

/// Filters without negative lobes and cameras without a lens side by side, whatever else lane by
/// lane.
class LaneCamera {
 public:
  LaneCamera(const Camera& camera, const FilterSampler& filter)
      : camera_(camera), filter_(filter), pinhole_(camera.pinhole()) {}

  /// due: at most N; in the lanes beyond it anything.
  template <std::size_t N>
  CameraRayLanes<N> rays(std::span<const DueSample> due, const Vec4s<N>& u) const {
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
        const Floats<N> at = is_box ? t : sample(filter_.table(), t);
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
    if (pinhole_) {
      through_pinhole(*pinhole_, x, y, out);
      return out;
    }
    for (std::size_t k = 0; k < due.size(); ++k) {
      const Camera::CameraRay one = camera_.ray({x.v[k], y.v[k]}, {u.z.v[k], u.w.v[k]});
      out.origin.set(k, one.ray.origin);
      out.direction.set(k, one.ray.direction);
      out.spread_rad.v[k] = one.spread_rad;
      out.width_m.v[k] = one.width_m;
    }
    return out;
  }

 private:
  /// Distribution1D::sample()
  template <std::size_t N>
  static Floats<N> sample(const Distribution1D::Table& table, Floats<N> u) {
    const auto* guide = reinterpret_cast<const std::int32_t*>(table.guide);
    const Floats<N> n(static_cast<float>(table.size));
    const Ints<N> one(1);
    const Ints<N> last(table.size - 1);
    const Ints<N> start = truncated(u * n);
    Ints<N> cell = gather(guide, select(last < start, last, start));
    const auto step = [&](Mask<N> wrong, Ints<N> by) {
      cell = select(wrong, cell + by, cell);
      return wrong.any();
    };
    while (step((Ints<N>(0) < cell) & (gather(table.cdf, cell) > u), Ints<N>(-1))) {
    }
    while (step((cell < last) & (gather(table.cdf, cell + one) <= u), one)) {
    }
    const Floats<N> low = gather(table.cdf, cell);
    const Floats<N> width = gather(table.cdf, cell + one) - low;
    const Floats<N> within = select(width > Floats<N>(0), (u - low) / width, Floats<N>(0.5F));
    Floats<N> x = min((to_floats(cell) + within) / n, Floats<N>(kOneMinusEpsilon));
    for (Mask<N> over = cell < truncated(x * n); over.any(); over = cell < truncated(x * n)) {
      x = select(over, floats_of(bits_of(x) - one), x);
    }
    return x;
  }
  template <std::size_t N>
  static void through_pinhole(const Camera::Pinhole& p, Floats<N> x_px, Floats<N> y_px,
                              CameraRayLanes<N>& out) {
    const Floats<N> one(1);
    const Floats<N> x = ((x_px + x_px) / Floats<N>(p.width_px) - one) * Floats<N>(p.half_width);
    const Floats<N> y = (one - (y_px + y_px) / Floats<N>(p.height_px)) * Floats<N>(p.half_height);
    const Vec3s<N> d = Vec3s<N>(p.forward) + Vec3s<N>(p.right) * x + Vec3s<N>(p.up) * y;
    out.origin = Vec3s<N>(p.eye);
    out.direction = d * (one / length(d));
    out.spread_rad = Floats<N>(p.spread_rad);
    out.width_m = Floats<N>(0);
  }

  const Camera& camera_;
  const FilterSampler& filter_;
  std::optional<Camera::Pinhole> pinhole_;
};

}  // namespace core
