/// Shapes and placements that the built-in scenes are made of. Metres, y up; normals point out.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/description/scene_description.h"
#include "core/math/frame.h"
#include "core/math/transform.h"

namespace core {

/// Two triangles a, b, c, d counter-clockwise as seen from their front; uv (0,1) (1,1) (1,0) (0,0).
PrimitiveDescription quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d);
/// Six faces, each with its own vertices and uv that measures metres times `uv_per_metre`.
PrimitiveDescription box(Vec3 min, Vec3 max, float uv_per_metre = 1);
/// Sphere around the origin with smooth normals; `segments` around, half as many from pole to pole.
PrimitiveDescription sphere(float radius, int segments);
/// Surface of revolution around the y axis. profile: (radius, height) from bottom to top of the
/// outside, smooth; closed when it begins and ends at radius 0.
PrimitiveDescription lathe(std::span<const Vec2> profile, int segments);
/// A w by d grid in x and z around the origin, whose height is given by a function; smooth.
PrimitiveDescription height_field(float width, float depth, int cells,
                                  float (*height)(float x, float z));

/// The other triangles' side up.
void turn_inside_out(PrimitiveDescription& primitive);
/// Adds `more`'s triangles to `to`; both have the same attributes.
void append(PrimitiveDescription& to, const PrimitiveDescription& more);

/// Lambertian with exactly this albedo: KHR_materials_specular 0 removes the dielectric coat.
MaterialDescription diffuse_material(std::string name, Rgb albedo);
/// Black and shining; W/(m^2 sr).
MaterialDescription emissive_material(std::string name, Rgb radiance);
MaterialDescription metal_material(std::string name, Rgb color, float roughness);
MaterialDescription plastic_material(std::string name, Rgb color, float roughness);
/// Smooth glass that bounds a volume; ior 1.5.
MaterialDescription glass_material(std::string name, Rgb attenuation_color,
                                   float attenuation_distance_m);

int add_material(SceneDescription& scene, MaterialDescription material);
/// A mesh of one primitive; its index.
int add_mesh(SceneDescription& scene, std::string name, PrimitiveDescription primitive,
             int material);
void add_instance(SceneDescription& scene, int mesh, const Transform& to_world = {});
/// Mesh and one instance of it.
void add_object(SceneDescription& scene, std::string name, PrimitiveDescription primitive,
                int material, const Transform& to_world = {});
/// The camera named "camera".
void add_camera(SceneDescription& scene, Vec3 position, Vec3 target, float vertical_fov_rad);

/// Rotation about the y axis, counter-clockwise seen from above.
Transform rotation_y(float angle_rad);

/// A small, fixed sequence of numbers in [0,1) for placing things; PCG's output function.
class PlacementNumbers {
 public:
  explicit PlacementNumbers(std::uint64_t seed) : state_(seed * 2 + 1) {}
  float next() noexcept;
  float between(float low, float high) noexcept { return low + (high - low) * next(); }

 private:
  std::uint64_t state_;
};

}  // namespace core
