/// Equiangular: samples distances along a ray in proportion to 1 / r^2, where r is the distance to
/// a fixed point. For the light of a point source in a medium.
///
/// Source: Kulla and Fajardo, Importance Sampling Techniques for Path Tracing in Participating
/// Media, 2012, section 3; expressed in the angle from the beginning, which stays accurate if the
/// point is distant.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/math/vec.h"

namespace core {

class Equiangular {
 public:
  /// Range from begin_m to end_m along the ray; direction: unit.
  Equiangular(Vec3 origin, Vec3 direction, float begin_m, float end_m, Vec3 point) noexcept
      : begin_m_(begin_m), length_m_(end_m - begin_m) {
    const Vec3 from = origin + direction * begin_m - point;
    past_m_ = dot(from, direction);
    height_m_ = length(from - direction * past_m_);
    angle_rad_ =
        std::atan2(height_m_ * length_m_, height_m_ * height_m_ + past_m_ * (past_m_ + length_m_));
  }
  /// Samples a distance; u in [0,1). Pre: is_possible().
  float sample(float u) const noexcept {
    const float sine = std::sin(u * angle_rad_);
    const float cosine = std::cos(u * angle_rad_);
    const float way =
        sine * (height_m_ * height_m_ + past_m_ * past_m_) / (height_m_ * cosine - past_m_ * sine);
    return begin_m_ + std::clamp(way, 0.0F, length_m_);
  }
  /// Returns the density of sample() at a distance within the range [1/m]; 0 if sampling is
  /// impossible.
  float pdf_m(float distance_m) const noexcept {
    const float past = past_m_ + (distance_m - begin_m_);
    return is_possible() ? height_m_ / (angle_rad_ * (height_m_ * height_m_ + past * past)) : 0.0F;
  }
  /// Returns false if the ray passes through the point or the range is empty.
  bool is_possible() const noexcept { return height_m_ > 0 && angle_rad_ > 0; }

 private:
  float begin_m_;
  float length_m_;
  float past_m_;  ///< of the beginning, beyond the foot of the perpendicular
  float height_m_;
  float angle_rad_;
};

}  // namespace core
