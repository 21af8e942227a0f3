/// The points of a set that lie farthest in many directions: a small hull for framing a model.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

#include "core/math/numbers.h"
#include "core/math/vec.h"

namespace core {

class ExtremePoints {
 public:
  /// The six axes, and spherical Fibonacci points. Every direction is within 10 degrees of one, so
  /// that the extent of a sphere is read at most 1.5 % too small, of a box exactly.
  static constexpr std::size_t kDirections = 256;

  ExtremePoints() {
    extents_.fill(-std::numeric_limits<float>::infinity());
    for (std::size_t i = 0; i < kAxes; ++i) {
      const float sign = i % 2 == 0 ? 1.0F : -1.0F;
      set(i, {i / 2 == 0 ? sign : 0, i / 2 == 1 ? sign : 0, i / 2 == 2 ? sign : 0});
    }
    constexpr float kGoldenAngle = kPi * (3 - 2.236067977F);
    for (std::size_t i = kAxes; i < kDirections; ++i) {
      const float turn = static_cast<float>(i - kAxes);
      const float z = 1 - (2 * turn + 1) / static_cast<float>(kDirections - kAxes);
      const float r = std::sqrt(1 - z * z);
      set(i, {r * std::cos(turn * kGoldenAngle), r * std::sin(turn * kGoldenAngle), z});
    }
  }

  void add(Vec3 p) noexcept {
    // First whether there is any: without a branch, the compiler takes several directions at once.
    int farther = 0;
    for (std::size_t i = 0; i < kDirections; ++i) {
      farther |= static_cast<int>(extent(i, p) > extents_[i]);
    }
    for (std::size_t i = 0; farther != 0 && i < kDirections; ++i) {
      if (extent(i, p) > extents_[i]) {
        extents_[i] = extent(i, p);
        points_[i] = p;
      }
    }
  }

  /// Returns each extreme point once; none if none was added.
  std::vector<Vec3> points() const {
    std::vector<Vec3> out;
    for (std::size_t i = 0; i < kDirections; ++i) {
      if (extents_[i] > -std::numeric_limits<float>::infinity() &&
          std::find(out.begin(), out.end(), points_[i]) == out.end()) {
        out.push_back(points_[i]);
      }
    }
    return out;
  }

 private:
  static constexpr std::size_t kAxes = 6;

  void set(std::size_t i, Vec3 direction) noexcept {
    x_[i] = direction.x;
    y_[i] = direction.y;
    z_[i] = direction.z;
  }
  float extent(std::size_t i, Vec3 p) const noexcept {
    return x_[i] * p.x + y_[i] * p.y + z_[i] * p.z;
  }

  std::array<float, kDirections> x_, y_, z_;
  std::array<float, kDirections> extents_;
  std::array<Vec3, kDirections> points_;
};

}  // namespace core
