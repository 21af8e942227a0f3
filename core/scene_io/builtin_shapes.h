/// Shapes and helpers for the built-in scenes. Metres, y up; normals point outwards.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "core/description/scene_description.h"
#include "core/math/frame.h"
#include "core/math/transform.h"

namespace core {

/// Returns two triangles with corners a, b, c, d counter-clockwise seen from the front; uv (0,1)
/// (1,1) (1,0) (0,0).
PrimitiveDescription quad(Vec3 a, Vec3 b, Vec3 c, Vec3 d);
/// Returns six faces, each with its own vertices; uv is metres times `uv_per_metre`.
PrimitiveDescription box(Vec3 min, Vec3 max, float uv_per_metre = 1);
/// Returns a sphere around the origin with smooth normals; `segments` around, half as many from
/// pole to pole.
PrimitiveDescription sphere(float radius, int segments);
/// Returns a smooth surface of revolution around the y axis. profile: (radius, height) from bottom
/// to top of the outside; the surface is closed if it begins and ends at radius 0.
PrimitiveDescription lathe(std::span<const Vec2> profile, int segments);
/// Returns a smooth w by d grid in x and z around the origin, with height given by a function.
PrimitiveDescription height_field(float width, float depth, int cells,
                                  float (*height)(float x, float z));

/// Flips the orientation of all triangles.
void turn_inside_out(PrimitiveDescription& primitive);
/// Appends the triangles of `more` to `to`; both have the same attributes.
void append(PrimitiveDescription& to, const PrimitiveDescription& more);

/// Returns a Lambertian material with exactly this albedo: KHR_materials_specular 0 removes the
/// dielectric coat.
MaterialDescription diffuse_material(std::string name, Rgb albedo);
/// Returns a black emissive material; W/(m^2 sr).
MaterialDescription emissive_material(std::string name, Rgb radiance);
MaterialDescription metal_material(std::string name, Rgb color, float roughness);
MaterialDescription plastic_material(std::string name, Rgb color, float roughness);
/// Returns smooth glass that bounds a volume; ior 1.5.
MaterialDescription glass_material(std::string name, Rgb attenuation_color,
                                   float attenuation_distance_m);

int add_material(SceneDescription& scene, MaterialDescription material);
/// Adds a mesh of one primitive and returns its index.
int add_mesh(SceneDescription& scene, std::string name, PrimitiveDescription primitive,
             int material);
void add_instance(SceneDescription& scene, int mesh, const Transform& to_world = {});
/// Adds a mesh and one instance of it.
void add_object(SceneDescription& scene, std::string name, PrimitiveDescription primitive,
                int material, const Transform& to_world = {});
/// Adds the camera named "camera".
void add_camera(SceneDescription& scene, Vec3 position, Vec3 target, float vertical_fov_rad);

/// Returns a rotation about the y axis, counter-clockwise seen from above.
Transform rotation_y(float angle_rad);

/// A short, fixed sequence of numbers in [0,1) for placing objects; uses PCG's output function.
class PlacementNumbers {
 public:
  explicit PlacementNumbers(std::uint64_t seed) : state_(seed * 2 + 1) {}
  float next() noexcept;
  float between(float low, float high) noexcept { return low + (high - low) * next(); }

 private:
  std::uint64_t state_;
};

}  // namespace core
