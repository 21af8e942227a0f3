// A thousand small lanterns over dunes between standing stones: a test of light sampling. Octahedra
// of eight triangles each; 25 colours share their meshes.
#include <array>
#include <cmath>

#include "core/math/numbers.h"
#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

constexpr int kLanterns = 1000;
constexpr int kColors = 25;

float dunes(float x, float z) {
  return 0.45F * std::sin(0.55F * x + 0.6F * std::sin(0.35F * z)) +
         0.25F * std::sin(0.9F * z - 0.4F * x) + 0.012F * std::sin(7 * x + 2 * std::sin(1.3F * z));
}

PrimitiveDescription octahedron(float radius) {
  const std::array<Vec3, 6> corner = {
      {{1, 0, 0}, {-1, 0, 0}, {0, 1.4F, 0}, {0, -1.4F, 0}, {0, 0, 1}, {0, 0, -1}}};
  constexpr std::array<std::array<std::size_t, 3>, 8> kFaces = {
      {{0, 2, 4}, {4, 2, 1}, {1, 2, 5}, {5, 2, 0}, {4, 3, 0}, {1, 3, 4}, {5, 3, 1}, {0, 3, 5}}};
  PrimitiveDescription p;
  for (const auto& face : kFaces) {
    const Vec3 a = corner[face[0]] * radius;
    const Vec3 b = corner[face[1]] * radius;
    const Vec3 c = corner[face[2]] * radius;
    // Triangles face outwards; the sign of the volume checks the table's order.
    const bool outward = dot(cross(b - a, c - a), a + b + c) > 0;
    const Vec3 n = normalize(cross(b - a, c - a)) * (outward ? 1.0F : -1.0F);
    const auto first = static_cast<std::uint32_t>(p.positions.size());
    p.positions.insert(p.positions.end(), {a, outward ? b : c, outward ? c : b});
    p.normals.insert(p.normals.end(), {n, n, n});
    p.uv[0].insert(p.uv[0].end(), {{0, 1}, {1, 1}, {0.5F, 0}});
    p.indices.insert(p.indices.end(), {first, first + 1, first + 2});
  }
  return p;
}

// Amber, rose and turquoise, most of them amber; luminance 1.
Rgb lantern_color(float t) {
  const Rgb amber = {1, 0.42F, 0.06F};
  const Rgb rose = {1, 0.16F, 0.3F};
  const Rgb turquoise = {0.08F, 0.6F, 0.75F};
  const Rgb c =
      t < 0.7F ? lerp(amber, rose, t * t / 0.49F) : lerp(rose, turquoise, (t - 0.7F) / 0.3F);
  return c / luminance(c);
}

void add_stones(SceneDescription& scene) {
  const int slate = add_material(scene, plastic_material("slate", {0.16F, 0.17F, 0.2F}, 0.35F));
  const int marble = add_material(scene, plastic_material("marble", {0.75F, 0.72F, 0.68F}, 0.25F));
  const int copper = add_material(scene, metal_material("copper", {0.95F, 0.64F, 0.54F}, 0.22F));
  constexpr std::array<Vec2, 9> kProfile = {{{0, -0.5F},
                                             {0.5F, -0.5F},
                                             {0.52F, 0.2F},
                                             {0.46F, 0.9F},
                                             {0.4F, 1.5F},
                                             {0.3F, 1.9F},
                                             {0.16F, 2.1F},
                                             {0.06F, 2.16F},
                                             {0, 2.17F}}};
  const int pillar = add_mesh(scene, "pillar", lathe(kProfile, 48), slate);
  const int cube = add_mesh(scene, "block", box({-0.5F, -0.5F, -0.5F}, {0.5F, 0.5F, 0.5F}), marble);
  const int ball = add_mesh(scene, "ball", sphere(0.5F, 64), copper);
  PlacementNumbers numbers(7);
  for (int i = 0; i < 66; ++i) {
    const float x = numbers.between(-11, 11);
    const float z = numbers.between(-13, 5);
    const float size = numbers.between(0.5F, 1.4F);
    const Transform turn = rotation_y(numbers.between(0, kTwoPi)) * scaling({size, size, size});
    const int mesh = i % 3 == 0 ? pillar : (i % 3 == 1 ? cube : ball);
    const float lift = i % 3 == 0 ? 0 : 0.38F * size;
    add_instance(scene, mesh, translation({x, dunes(x, z) + lift, z}) * turn);
  }
}

}  // namespace

Bytes make_many_lights() {
  SceneDescription scene;
  const int sand = add_material(scene, diffuse_material("sand", {0.62F, 0.52F, 0.4F}));
  add_object(scene, "dunes", height_field(40, 40, 200, &dunes), sand);
  add_stones(scene);
  std::array<int, kColors> lanterns{};
  const PrimitiveDescription body = octahedron(0.06F);
  for (int i = 0; i < kColors; ++i) {
    const float t = static_cast<float>(i) / (kColors - 1);
    const int glow = add_material(scene, emissive_material("lantern", lantern_color(t) * 7.0F));
    lanterns[static_cast<std::size_t>(i)] = add_mesh(scene, "lantern", body, glow);
  }
  PlacementNumbers numbers(11);
  for (int i = 0; i < kLanterns; ++i) {
    const float x = numbers.between(-12, 12);
    const float z = numbers.between(-16, 6);
    const float height = 0.2F + 4.5F * numbers.next() * numbers.next();
    const Transform turn = rotation_y(numbers.between(0, kTwoPi));
    add_instance(scene, lanterns[static_cast<std::size_t>(i % kColors)],
                 translation({x, dunes(x, z) + height, z}) * turn);
  }
  add_camera(scene, {0, 3.1F, 10.5F}, {0, 0.55F, -1.5F}, 0.62F);
  return write_glb(scene);
}

}  // namespace core
