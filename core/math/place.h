/// Place: a point of the file's world in double precision.
///
/// Scenes count positions in floats from an origin of their own (SceneDescription::origin), so that
/// shapes far from the file's origin, as in maps and building models, keep their detail. What users
/// give and read is in the file's coordinates: these are Places; all others are Vec3.
#pragma once

#include "core/math/vec.h"

namespace core {

struct Place {
  double x = 0;
  double y = 0;
  double z = 0;

  constexpr Place() = default;
  constexpr Place(double ax, double ay, double az) noexcept : x(ax), y(ay), z(az) {}
  constexpr Place(Vec3 v) noexcept  // NOLINT(google-explicit-constructor): loses nothing
      : x(static_cast<double>(v.x)), y(static_cast<double>(v.y)), z(static_cast<double>(v.z)) {}

  constexpr double operator[](int i) const noexcept { return i == 0 ? x : (i == 1 ? y : z); }
  /// Rounds to floats.
  constexpr Vec3 rounded() const noexcept {
    return {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)};
  }
  friend constexpr Place operator+(Place a, Place b) noexcept {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend constexpr Place operator-(Place a, Place b) noexcept {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend constexpr bool operator==(const Place&, const Place&) = default;
};

}  // namespace core
