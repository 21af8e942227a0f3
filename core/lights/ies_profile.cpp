#include "core/lights/ies_profile.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/numbers.h"

namespace core {
namespace {

/// The interval of increasing values that contains x, and the position in it; none if x is outside.
struct Interval {
  std::size_t index = 0;
  float along = 0;
};

Interval interval_of(const std::vector<float>& values, float x) noexcept {
  const auto after = std::upper_bound(values.begin() + 1, values.end() - 1, x);
  const auto index = static_cast<std::size_t>(after - values.begin()) - 1;
  return {index, clamp01((x - values[index]) / (values[index + 1] - values[index]))};
}

/// At a theta of 0 or pi.
constexpr float kPoleSlack = 1e-6F;

}  // namespace

IesProfile::IesProfile(Grid grid) : grid_(std::move(grid)) {
  switch (grid_.photometry) {
    case Photometry::kC:
      pole_ = {0, 0, -1};
      zero_ = {1, 0, 0};
      quarter_ = {0, 1, 0};
      break;
    case Photometry::kB:
      pole_ = {0, -1, 0};
      zero_ = {0, 0, -1};
      quarter_ = {1, 0, 0};
      break;
    case Photometry::kA:
      pole_ = {1, 0, 0};
      zero_ = {0, 0, -1};
      quarter_ = {0, -1, 0};
      break;
  }
  for (const float theta : grid_.theta_rad) {
    cos_theta_.push_back(std::cos(theta));
  }
  const std::size_t width = grid_.theta_rad.size() - 1;
  const std::size_t height = grid_.phi_rad.size() - 1;
  std::vector<float> weights;
  weights.reserve(width * height);
  for (std::size_t p = 0; p < height; ++p) {
    for (std::size_t t = 0; t < width; ++t) {
      const double lumens = cell_lumens(p, t);
      weights.push_back(static_cast<float>(lumens));
      lumens_ += lumens;
      for (std::size_t k = 0; k < 4 && lumens > 0; ++k) {
        const Vec3 edge = direction(cos_theta_[t + k % 2], grid_.phi_rad[p + k / 2]);
        cos_reach_ = std::min(cos_reach_, -edge.z);
      }
    }
  }
  cells_ = Distribution2D(weights, static_cast<int>(width), static_cast<int>(height));
}

/// Returns the integral of a bilinear function times the sine of theta.
double IesProfile::cell_lumens(std::size_t phi, std::size_t theta) const noexcept {
  const double a = static_cast<double>(grid_.theta_rad[theta]);
  const double b = static_cast<double>(grid_.theta_rad[theta + 1]);
  const auto mean = [&](std::size_t t) {
    return 0.5 * (static_cast<double>(corner(phi, t)) + static_cast<double>(corner(phi + 1, t)));
  };
  const double at_a = mean(theta);
  const double at_b = mean(theta + 1);
  const double integral = at_a * std::cos(a) - at_b * std::cos(b) +
                          (at_b - at_a) / (b - a) * (std::sin(b) - std::sin(a));
  const double width = static_cast<double>(grid_.phi_rad[phi + 1] - grid_.phi_rad[phi]);
  return std::max(integral * width, 0.0);
}

float IesProfile::cell_solid_angle(std::size_t phi, std::size_t theta) const noexcept {
  return (cos_theta_[theta] - cos_theta_[theta + 1]) *
         (grid_.phi_rad[phi + 1] - grid_.phi_rad[phi]);
}

Vec3 IesProfile::direction(float cos_theta, float phi_rad) const noexcept {
  const float sin_theta = safe_sqrt(1 - cos_theta * cos_theta);
  return pole_ * cos_theta + (zero_ * std::cos(phi_rad) + quarter_ * std::sin(phi_rad)) * sin_theta;
}

IesProfile::Cell IesProfile::cell_at(Vec3 direction) const noexcept {
  const auto& thetas = grid_.theta_rad;
  const auto& phis = grid_.phi_rad;
  const float theta = std::acos(std::clamp(dot(direction, pole_), -1.0F, 1.0F));
  float phi = std::atan2(dot(direction, quarter_), dot(direction, zero_));
  if (grid_.photometry == Photometry::kC && phi < phis.front()) {
    phi += kTwoPi;
  }
  const bool is_beyond = theta < thetas.front() - kPoleSlack || theta > thetas.back() + kPoleSlack;
  if (is_beyond ||
      (grid_.photometry != Photometry::kC && (phi < phis.front() || phi > phis.back()))) {
    return {};
  }
  const Interval t = interval_of(thetas, theta);
  const Interval p = interval_of(phis, phi);
  return {t.index, p.index, t.along, p.along, true};
}

float IesProfile::candela(Vec3 direction) const noexcept {
  const Cell at = cell_at(direction);
  if (!at.is_inside) {
    return 0;
  }
  const auto along = [&](std::size_t phi) {
    const float a = corner(phi, at.theta);
    return a + (corner(phi, at.theta + 1) - a) * at.along_theta;
  };
  const float a = along(at.phi);
  return a + (along(at.phi + 1) - a) * at.along_phi;
}

Vec3 IesProfile::sample(Vec2 u) const noexcept {
  const auto cell = cells_.sample(u);
  const auto within = [](float x, std::size_t count, std::size_t index) {
    return clamp01(x * static_cast<float>(count) - static_cast<float>(index));
  };
  const auto column = static_cast<std::size_t>(cell.column);
  const auto row = static_cast<std::size_t>(cell.row);
  const float t = within(cell.uv.x, grid_.theta_rad.size() - 1, column);
  const float p = within(cell.uv.y, grid_.phi_rad.size() - 1, row);
  const float above = cos_theta_[column];
  const float left = grid_.phi_rad[row];
  return direction(above + (cos_theta_[column + 1] - above) * t,
                   left + (grid_.phi_rad[row + 1] - left) * p);
}

float IesProfile::pdf_solid_angle(Vec3 direction) const noexcept {
  const Cell at = cell_at(direction);
  const float solid_angle = at.is_inside ? cell_solid_angle(at.phi, at.theta) : 0;
  return solid_angle > 0 ? static_cast<float>(cell_lumens(at.phi, at.theta) / lumens_) / solid_angle
                         : 0.0F;
}

std::size_t IesProfile::bytes() const noexcept {
  const std::size_t floats =
      grid_.theta_rad.size() + grid_.phi_rad.size() + grid_.candela.size() + cos_theta_.size();
  return floats * sizeof(float) + cells_.bytes();
}

}  // namespace core
