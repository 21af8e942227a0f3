/// Lights for sampling: emissive triangles and punctual lights.
#pragma once

#include <cstdint>

#include "core/accel/accel.h"
#include "core/color/rgb.h"
#include "core/description/scene_description.h"
#include "core/lights/ies_profile.h"
#include "core/math/vec.h"

namespace core {

/// An emissive triangle in world space.
struct TriangleLight {
  Vec3 p0;
  Vec3 edge1;   ///< p1 - p0
  Vec3 edge2;   ///< p2 - p0
  Vec3 normal;  ///< unit, front side
  float area_m2 = 0;
  Rgb radiance;  ///< times coverage; mean over the triangle and all directions, exact unless it
                 ///< `varies`; black only if it emits nowhere
  float error_m = 0;         ///< step off the triangle anywhere (core/math/offset_ray.h)
  std::uint32_t placed = 0;  ///< index of the PlacedMesh
  std::uint32_t triangle = 0;
  std::uint32_t instance = kNoInstance;
  bool two_sided = false;
  bool varies = false;     ///< from place to place or by direction: see triangle_radiance()
  bool is_coated = false;  ///< it varies by direction
};

/// KHR_lights_punctual and EXT_lights_ies in world space. Delta lights: rays never hit them.
struct PunctualLight {
  PunctualType type = PunctualType::kPoint;
  Vec3 position;
  Vec3 direction;  ///< unit, the direction of emission (all but points)
  Rgb intensity;   ///< W/sr, or W/m^2 for directional; a factor for profiles
  float range_m = 0;
  float cos_inner = 1;
  float cos_outer = 0;
  std::uint32_t group = 0;              ///< index into SceneData::light_groups
  const IesProfile* profile = nullptr;  ///< for kProfile
  Vec3 up;                              ///< x axis of the profile in the world, unit
  Vec3 side;                            ///< y axis of the profile

  /// Returns the light that arrives at `to` [W/(m^2 sr) integrated over the delta, i.e. W/m^2 on a
  /// surface facing the light], and sets wi_world and distance_m. Formulas: KHR_lights_punctual.
  Rgb arriving(Vec3 to, Vec3& wi_world, float& distance_m) const noexcept;

  /// Returns the fraction of light that the range lets through.
  float range_factor(float distance_squared) const noexcept;
  /// Returns the emission in a direction away from the light, relative to `intensity`. Not for
  /// directional lights.
  float shape(Vec3 direction_world) const noexcept;
  /// Returns the integral of shape() over directions [sr].
  float shape_integral_sr() const noexcept;
  /// Samples a unit direction away from the light with density pdf_solid_angle().
  Vec3 sample_direction(Vec2 u) const noexcept;
  float pdf_solid_angle(Vec3 direction_world) const noexcept;

 private:
  /// Transforms from the world to the profile's frame.
  Vec3 to_profile(Vec3 direction_world) const noexcept {
    return {dot(direction_world, up), dot(direction_world, side), -dot(direction_world, direction)};
  }
};

/// Returns the light in world space. profile: for kProfile; must outlive the light.
PunctualLight punctual_light(const PunctualLightDescription& description,
                             const IesProfile* profile);

}  // namespace core
