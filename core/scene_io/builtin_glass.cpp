// Glass bodies on a diffuse floor under one small, bright panel: their caustics are most of the
// light in their shadows.
#include <array>
#include <cmath>
#include <vector>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

// Foot, stem and bowl of a goblet: up the outside, down the inside. Metres.
constexpr std::array<Vec2, 34> kGoblet = {{
    {0, 0.002F},       {0.10F, 0.002F},   {0.128F, 0.004F},  {0.132F, 0.009F}, {0.126F, 0.014F},
    {0.08F, 0.022F},   {0.04F, 0.034F},   {0.02F, 0.056F},   {0.0155F, 0.09F}, {0.0145F, 0.13F},
    {0.0155F, 0.16F},  {0.022F, 0.18F},   {0.05F, 0.198F},   {0.09F, 0.225F},  {0.122F, 0.26F},
    {0.14F, 0.30F},    {0.146F, 0.35F},   {0.14F, 0.40F},    {0.128F, 0.44F},  {0.118F, 0.47F},
    {0.1165F, 0.473F}, {0.114F, 0.4735F}, {0.1125F, 0.47F},  {0.122F, 0.44F},  {0.134F, 0.40F},
    {0.14F, 0.35F},    {0.134F, 0.302F},  {0.116F, 0.264F},  {0.085F, 0.231F}, {0.047F, 0.207F},
    {0.02F, 0.198F},   {0.008F, 0.1955F}, {0.003F, 0.1952F}, {0, 0.1951F},
}};

// A block with chamfered edges, which catch highlights.
PrimitiveDescription chamfered_block(Vec3 half, float cut) {
  const std::array<std::array<Vec3, 3>, 3> axes = {{{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}},
                                                    {{{0, 1, 0}, {0, 0, 1}, {1, 0, 0}}},
                                                    {{{0, 0, 1}, {1, 0, 0}, {0, 1, 0}}}}};
  PrimitiveDescription out;
  const auto add_facing_out = [&out](Vec3 a, Vec3 b, Vec3 c, Vec3 d) {
    const bool outward = dot(cross(b - a, d - a), a + b + c + d) > 0;
    append(out, outward ? quad(a, b, c, d) : quad(d, c, b, a));
  };
  for (const auto& [n, u, v] : axes) {
    const Vec3 face = n * dot(n, half);
    const Vec3 du = u * (dot(u, half) - cut);
    const Vec3 dv = v * (dot(v, half) - cut);
    for (const float side : {-1.0F, 1.0F}) {
      const Vec3 f = face * side;
      add_facing_out(f - du - dv, f + du - dv, f + du + dv, f - du + dv);
      for (const float other : {-1.0F, 1.0F}) {
        // The edge between the face along n and the one along u.
        const Vec3 near_u = u * (dot(u, half) * other);
        const Vec3 inner = n * ((dot(n, half) - cut) * side);
        add_facing_out(f + du * other - dv, f + du * other + dv, inner + near_u + dv,
                       inner + near_u - dv);
      }
    }
  }
  // Corners: one triangle each, because a quad would have an edge of zero length.
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3 s = {(corner & 1) != 0 ? 1.0F : -1.0F, (corner & 2) != 0 ? 1.0F : -1.0F,
                    (corner & 4) != 0 ? 1.0F : -1.0F};
    const Vec3 inner = {half.x - cut, half.y - cut, half.z - cut};
    Vec3 a = s * Vec3{half.x, inner.y, inner.z};
    Vec3 b = s * Vec3{inner.x, half.y, inner.z};
    const Vec3 c = s * Vec3{inner.x, inner.y, half.z};
    if (dot(cross(b - a, c - a), s) < 0) {
      const Vec3 t = a;
      a = b;
      b = t;
    }
    PrimitiveDescription triangle;
    const Vec3 n = normalize(s);
    triangle.positions = {a, b, c};
    triangle.normals = {n, n, n};
    triangle.uv[0] = {{0, 1}, {1, 1}, {0.5F, 0}};
    triangle.indices = {0, 1, 2};
    append(out, triangle);
  }
  return out;
}

// A floor that curves up into the wall behind.
PrimitiveDescription backdrop() {
  std::vector<Vec2> line;  // z, y
  constexpr int kSteps = 24;
  line.push_back({2.2F, 0});
  for (int i = 0; i <= kSteps; ++i) {
    const float angle = 1.5707963F * static_cast<float>(i) / kSteps;
    line.push_back({-0.9F - 0.6F * std::sin(angle), 0.6F - 0.6F * std::cos(angle)});
  }
  line.push_back({-1.5F, 3.0F});
  PrimitiveDescription p;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const Vec2 along = line[i + 1 < line.size() ? i + 1 : i] - line[i > 0 ? i - 1 : 0];
    const Vec3 n = normalize({0, -along.x, along.y});
    for (const float x : {-3.0F, 3.0F}) {
      p.positions.push_back({x, line[i].y, line[i].x});
      p.normals.push_back(n);
      p.uv[0].push_back(
          {x / 6 + 0.5F, static_cast<float>(i) / static_cast<float>(line.size() - 1)});
    }
    if (i > 0) {
      const auto v = static_cast<std::uint32_t>(i * 2);
      p.indices.insert(p.indices.end(), {v - 2, v - 1, v + 1, v - 2, v + 1, v});
    }
  }
  return p;
}

}  // namespace

Bytes make_glass() {
  SceneDescription scene;
  const int paper = add_material(scene, diffuse_material("paper", {0.8F, 0.78F, 0.74F}));
  const int clear = add_material(scene, glass_material("clear glass", Rgb(1), 0));
  const int amber = add_material(scene, glass_material("amber glass", {0.95F, 0.5F, 0.12F}, 0.16F));
  const int teal = add_material(scene, glass_material("teal glass", {0.35F, 0.8F, 0.78F}, 0.12F));
  const int lamp = add_material(scene, emissive_material("lamp", Rgb{170, 156, 134}));
  add_object(scene, "backdrop", backdrop(), paper);
  // Objects are a tenth of a millimetre above the floor, so that no two faces coincide.
  add_object(scene, "sphere", sphere(0.2F, 128), clear, translation({-0.4F, 0.2001F, 0.1F}));
  add_object(scene, "block", chamfered_block({0.12F, 0.16F, 0.12F}, 0.008F), amber,
             translation({0.12F, 0.1601F, -0.32F}) * rotation_y(0.55F));
  add_object(scene, "goblet", lathe(kGoblet, 128), teal, translation({0.48F, 0, 0.12F}));
  const Vec3 at = {-1.5F, 2.1F, -0.35F};
  const Vec3 n = normalize(Vec3{0.05F, 0.1F, 0} - at);
  const Vec3 u = normalize(cross({0, 1, 0}, n)) * 0.17F;
  const Vec3 v = cross(n, u);
  add_object(scene, "lamp", quad(at - u - v, at + u - v, at + u + v, at - u + v), lamp);
  add_camera(scene, {0.15F, 0.72F, 2.0F}, {0.06F, 0.17F, 0}, 0.55F);
  return write_glb(scene);
}

}  // namespace core
