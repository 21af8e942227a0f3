/// Lights that can be sampled: emissive triangles, and punctual lights.
#pragma once

#include <cstdint>

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
  Rgb radiance;  ///< mean over the triangle; exact when the material has no emissive texture, black
                 ///< only when it shines nowhere
  std::uint32_t placed = 0;  ///< PlacedMesh
  std::uint32_t triangle = 0;
  bool two_sided = false;
  bool textured = false;
};

/// KHR_lights_punctual and EXT_lights_ies in world space. Delta: never hit by rays.
struct PunctualLight {
  PunctualType type = PunctualType::kPoint;
  Vec3 position;
  Vec3 direction;  ///< unit, the way the light shines (all but points)
  Rgb intensity;   ///< W/sr, or W/m^2 for directional; of a profile a factor
  float range_m = 0;
  float cos_inner = 1;
  float cos_outer = 0;
  std::uint32_t group = 0;              ///< SceneData::light_groups
  const IesProfile* profile = nullptr;  ///< of kProfile
  Vec3 up;                              ///< its x axis in the world, unit
  Vec3 side;                            ///< its y axis

  /// Light that arrives at `to` [W/(m^2 sr) integrated over the delta, i.e. W/m^2 facing the
  /// light]; wi_world and distance_m are set. Formulas: KHR_lights_punctual.
  Rgb arriving(Vec3 to, Vec3& wi_world, float& distance_m) const noexcept;

  /// Share of the light that the range lets arrive.
  float range_factor(float distance_squared) const noexcept;
  /// What all but directional lights send in a direction away from them, over `intensity`.
  float shape(Vec3 direction_world) const noexcept;
  /// Its integral over directions [sr].
  float shape_integral_sr() const noexcept;
  /// Unit, away from the light; density pdf_solid_angle().
  Vec3 sample_direction(Vec2 u) const noexcept;
  float pdf_solid_angle(Vec3 direction_world) const noexcept;

 private:
  /// From the world to the profile's frame.
  Vec3 to_profile(Vec3 direction_world) const noexcept {
    return {dot(direction_world, up), dot(direction_world, side), -dot(direction_world, direction)};
  }
};

/// In the world; profile: of kProfile, must outlive the light.
PunctualLight punctual_light(const PunctualLightDescription& description,
                             const IesProfile* profile);

}  // namespace core
