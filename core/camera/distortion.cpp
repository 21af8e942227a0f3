#include "core/camera/distortion.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace core {
namespace {

double norm(Distortion::Point p) noexcept { return std::sqrt(p.x * p.x + p.y * p.y); }
Distortion::Point minus(Distortion::Point a, Distortion::Point b) noexcept {
  return {a.x - b.x, a.y - b.y};
}

}  // namespace

Distortion::Distortion(const DistortionSettings& settings) noexcept
    : is_fisheye_(settings.model == DistortionModel::kFisheye) {
  std::copy_n(settings.k.begin(), std::min(settings.k.size(), k_.size()), k_.begin());
  constexpr int kSteps = 1024;  // at which the sign of the derivative is read
  for (int i = 1; is_fisheye_ && i <= kSteps; ++i) {
    const double theta = std::numbers::pi * i / kSteps;
    if (!(radius(theta).y > 0)) {
      break;
    }
    theta_max_ = theta;
  }
}

Distortion::Local Distortion::local(Point p) const noexcept {
  const auto& [k1, k2, p1, p2, k3, k4, k5, k6, s1, s2, s3, s4] = k_;
  const auto [x, y] = p;
  const double r2 = x * x + y * y;
  const double above = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
  const double factor = above / below;
  // By r^2.
  const double slope =
      (k1 + r2 * (2 * k2 + r2 * 3 * k3) - factor * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / below;
  const double slope_x = s1 + 2 * s2 * r2;
  const double slope_y = s3 + 2 * s4 * r2;
  return {{x * factor + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2),
           y * factor + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y + r2 * (s3 + s4 * r2)},
          factor + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x + 2 * x * slope_x,
          2 * x * y * slope + 2 * p1 * x + 2 * p2 * y + 2 * y * slope_x,
          2 * x * y * slope + 2 * p1 * x + 2 * p2 * y + 2 * x * slope_y,
          factor + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x + 2 * y * slope_y};
}

Distortion::Point Distortion::radius(double theta) const noexcept {
  const double t2 = theta * theta;
  return {theta * (1 + t2 * (k_[0] + t2 * (k_[1] + t2 * (k_[2] + t2 * k_[3])))),
          1 + t2 * (3 * k_[0] + t2 * (5 * k_[1] + t2 * (7 * k_[2] + t2 * 9 * k_[3])))};
}

std::optional<Distortion::Projected> Distortion::project(Place direction) const noexcept {
  if (is_fisheye_) {
    const double aside = std::hypot(direction.x, direction.y);
    const double theta = std::atan2(aside, direction.z);
    if (theta > theta_max_ || !(aside > 0)) {
      return theta > 0 ? std::nullopt : std::optional(Projected{});
    }
    const auto [r, slope] = radius(theta);
    return Projected{{r * direction.x / aside, r * direction.y / aside},
                     r * slope / std::sin(theta)};
  }
  if (!(direction.z > 0)) {
    return std::nullopt;
  }
  const Point p = {direction.x / direction.z, direction.y / direction.z};
  const Local here = local(p);
  // Other directions that the polynomials move to the same point are not shown.
  const Unprojected back = unproject(here.at);
  const Point found = {back.direction.x, back.direction.y};
  constexpr double kSame = 1e-6;
  if (!back.is_shown || !(norm(minus(found, p)) <= kSame * (1 + norm(p)))) {
    return std::nullopt;
  }
  return Projected{here.at, here.determinant()};
}

Distortion::Unprojected Distortion::unproject(Point at) const noexcept {
  if (!is_fisheye_) {
    return undistorted(at);
  }
  // Bisection that takes Newton's step where that stays in the interval.
  const double r = norm(at);
  double low = 0;
  double high = theta_max_;
  double theta = std::min(r, high);
  const bool is_shown = r <= radius(high).x;
  constexpr int kStepsMost = 64;
  for (int i = 0; i < kStepsMost && is_shown; ++i) {
    const auto [found, slope] = radius(theta);
    if (std::fabs(found - r) <= kTolerance) {
      break;
    }
    (found < r ? low : high) = theta;
    const double next = theta - (found - r) / slope;
    theta = next > low && next < high ? next : 0.5 * (low + high);
  }
  theta = is_shown ? theta : theta_max_;
  const double scale = r > 0 ? std::sin(theta) / r : 0;
  return {{at.x * scale, at.y * scale, std::cos(theta)}, is_shown};
}

/// Newton's method from the principal point, around which every lens is nearly undistorted. A step
/// is shortened until it comes nearer without crossing the fold, where the determinant is 0.
Distortion::Unprojected Distortion::undistorted(Point at) const noexcept {
  constexpr int kStepsMost = 64;
  constexpr double kShortest = 1e-6;
  Point p;
  Local here = local(p);
  Point left = minus(here.at, at);
  for (int i = 0; i < kStepsMost && norm(left) > kTolerance; ++i) {
    const double d = here.determinant();
    const Point step = {(here.yy * left.x - here.xy * left.y) / d,
                        (here.xx * left.y - here.yx * left.x) / d};
    double part = 1;
    for (; part >= kShortest; part *= 0.5) {
      const Point next = {p.x - part * step.x, p.y - part * step.y};
      const Local there = local(next);
      const Point rest = minus(there.at, at);
      if (there.determinant() > 0 && norm(rest) < norm(left)) {
        p = next;
        here = there;
        left = rest;
        break;
      }
    }
    if (part < kShortest) {
      break;
    }
  }
  return {{p.x, p.y, 1}, norm(left) <= kTolerance};
}

}  // namespace core
