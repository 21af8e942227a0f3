// Tea for two under a large soft box: glazed clay, brass, fruit and billy buttons on a walnut
// table. Large lights and rough surfaces converge within seconds.
#include <array>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <span>
#include <string>
#include <vector>

#include "core/scene_io/builtin_list.h"
#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/builtin_textures.h"
#include "core/scene_io/glb_writer.h"

namespace core {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;

// Profiles: (radius, height) in metres, up the outside; open vessels continue down the inside.
constexpr std::array<Vec2, 17> kPot = {{{0, 0},
                                        {0.05F, 0},
                                        {0.056F, 0.004F},
                                        {0.075F, 0.02F},
                                        {0.092F, 0.045F},
                                        {0.098F, 0.07F},
                                        {0.094F, 0.095F},
                                        {0.08F, 0.118F},
                                        {0.06F, 0.133F},
                                        {0.045F, 0.139F},
                                        {0.03F, 0.143F},
                                        {0.014F, 0.146F},
                                        {0.011F, 0.15F},
                                        {0.016F, 0.157F},
                                        {0.016F, 0.164F},
                                        {0.009F, 0.170F},
                                        {0, 0.171F}}};
constexpr std::array<Vec2, 15> kCup = {{{0, 0},
                                        {0.022F, 0},
                                        {0.024F, 0.004F},
                                        {0.026F, 0.008F},
                                        {0.036F, 0.02F},
                                        {0.042F, 0.038F},
                                        {0.044F, 0.058F},
                                        {0.0435F, 0.0605F},
                                        {0.0425F, 0.0605F},
                                        {0.0415F, 0.058F},
                                        {0.0395F, 0.038F},
                                        {0.033F, 0.021F},
                                        {0.022F, 0.011F},
                                        {0.01F, 0.008F},
                                        {0, 0.0075F}}};
constexpr std::array<Vec2, 14> kVase = {{{0, 0},
                                         {0.04F, 0},
                                         {0.046F, 0.006F},
                                         {0.062F, 0.05F},
                                         {0.068F, 0.095F},
                                         {0.058F, 0.145F},
                                         {0.034F, 0.185F},
                                         {0.022F, 0.215F},
                                         {0.02F, 0.24F},
                                         {0.026F, 0.258F},
                                         {0.0265F, 0.2605F},
                                         {0.024F, 0.2605F},
                                         {0.017F, 0.24F},
                                         {0, 0.20F}}};
constexpr std::array<Vec2, 15> kBowl = {{{0, 0},
                                         {0.045F, 0},
                                         {0.048F, 0.005F},
                                         {0.046F, 0.010F},
                                         {0.075F, 0.024F},
                                         {0.105F, 0.046F},
                                         {0.122F, 0.07F},
                                         {0.1235F, 0.0725F},
                                         {0.122F, 0.0735F},
                                         {0.119F, 0.071F},
                                         {0.102F, 0.049F},
                                         {0.073F, 0.028F},
                                         {0.04F, 0.016F},
                                         {0.015F, 0.0125F},
                                         {0, 0.012F}}};
constexpr std::array<Vec2, 8> kTable = {{{0, -0.04F},
                                         {0.59F, -0.04F},
                                         {0.612F, -0.035F},
                                         {0.62F, -0.02F},
                                         {0.615F, -0.006F},
                                         {0.6F, -0.0006F},
                                         {0.585F, 0},
                                         {0, 0}}};
constexpr std::array<Vec2, 9> kFruit = {{{0, -0.036F},
                                         {0.012F, -0.0345F},
                                         {0.027F, -0.026F},
                                         {0.0365F, -0.010F},
                                         {0.0375F, 0.004F},
                                         {0.032F, 0.021F},
                                         {0.018F, 0.032F},
                                         {0.006F, 0.034F},
                                         {0, 0.0325F}}};

/// Returns a tube along a line with the radius at each point, closed where it narrows to zero.
PrimitiveDescription tube(std::span<const Vec3> line, std::span<const float> radius, int segments) {
  PrimitiveDescription p;
  const auto count = line.size();
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 along = normalize(line[i + 1 < count ? i + 1 : i] - line[i > 0 ? i - 1 : 0]);
    // The lines lie in planes that contain z, but never run along z.
    const Vec3 side = normalize(cross({0, 0, 1}, along));
    const Vec3 other = cross(along, side);
    for (int s = 0; s <= segments; ++s) {
      const float phi = 2 * kPi * static_cast<float>(s % segments) / static_cast<float>(segments);
      const Vec3 n = side * std::cos(phi) + other * std::sin(phi);
      p.positions.push_back(line[i] + n * radius[i]);
      p.normals.push_back(n);
      p.uv[0].push_back({static_cast<float>(s) / static_cast<float>(segments),
                         static_cast<float>(i) / static_cast<float>(count - 1)});
    }
  }
  for (std::size_t i = 0; i + 1 < count; ++i) {
    for (int s = 0; s < segments; ++s) {
      const auto a = static_cast<std::uint32_t>(i) * static_cast<std::uint32_t>(segments + 1) +
                     static_cast<std::uint32_t>(s);
      const auto above = a + static_cast<std::uint32_t>(segments) + 1;
      p.indices.insert(p.indices.end(), {a, a + 1, above + 1, a, above + 1, above});
    }
  }
  return p;
}

/// Through four control points, with interpolated radii.
PrimitiveDescription bent_tube(const std::array<Vec3, 4>& c, float from, float to, int steps) {
  std::vector<Vec3> line;
  std::vector<float> radius;
  for (int i = 0; i <= steps; ++i) {
    const float t = static_cast<float>(i) / static_cast<float>(steps);
    const float s = 1 - t;
    line.push_back(c[0] * (s * s * s) + c[1] * (3 * s * s * t) + c[2] * (3 * s * t * t) +
                   c[3] * (t * t * t));
    radius.push_back(from + (to - from) * t);
  }
  return tube(line, radius, 24);
}

/// Adds a rectangle that emits on its front.
void add_panel(SceneDescription& scene, const std::string& name, Vec3 at, Vec3 towards, Vec2 half,
               Rgb radiance) {
  const Vec3 n = normalize(towards - at);
  const Vec3 u = normalize(cross({0, 1, 0}, n)) * half.x;
  const Vec3 v = normalize(cross(n, u)) * half.y;
  add_object(scene, name, quad(at - u - v, at + u - v, at + u + v, at - u + v),
             add_material(scene, emissive_material(name, radiance)));
}

MaterialDescription glaze(std::string name, Rgb color, float roughness) {
  MaterialDescription m = plastic_material(std::move(name), color, roughness);
  m.clearcoat = 0.6F;
  m.clearcoat_roughness = 0.06F;
  return m;
}

void add_tea(SceneDescription& scene) {
  const int celadon = add_material(scene, glaze("celadon", {0.30F, 0.47F, 0.40F}, 0.42F));
  const int cream = add_material(scene, glaze("cream", {0.78F, 0.71F, 0.58F}, 0.45F));
  const int tea = add_material(scene, plastic_material("tea", {0.34F, 0.12F, 0.025F}, 0.12F));
  const Transform pot = translation({-0.06F, 0.0002F, 0.01F}) * rotation_y(0.35F);
  add_object(scene, "pot", lathe(kPot, 96), celadon, pot);
  add_object(
      scene, "spout",
      bent_tube(
          {{{-0.08F, 0.045F, 0}, {-0.14F, 0.05F, 0}, {-0.125F, 0.115F, 0}, {-0.165F, 0.138F, 0}}},
          0.024F, 0.009F, 32),
      celadon, pot);
  add_object(
      scene, "handle",
      bent_tube(
          {{{0.068F, 0.122F, 0}, {0.155F, 0.165F, 0}, {0.175F, 0.045F, 0}, {0.083F, 0.032F, 0}}},
          0.0075F, 0.0065F, 40),
      celadon, pot);
  const int cup = add_mesh(scene, "cup", lathe(kCup, 72), cream);
  const int surface = add_mesh(
      scene, "tea", lathe(std::array<Vec2, 2>{{{0.0402F, 0.0445F}, {0, 0.0445F}}}, 64), tea);
  for (const Vec3 at : {Vec3{0.13F, 0.0002F, 0.2F}, Vec3{-0.2F, 0.0002F, 0.21F}}) {
    add_instance(scene, cup, translation(at));
    add_instance(scene, surface, translation(at));
  }
}

void add_flowers(SceneDescription& scene) {
  const int clay = add_material(scene, glaze("blue glaze", {0.06F, 0.13F, 0.27F}, 0.4F));
  const int green = add_material(scene, diffuse_material("stem", {0.16F, 0.24F, 0.08F}));
  const int yellow = add_material(scene, diffuse_material("billy button", {0.82F, 0.53F, 0.05F}));
  const Vec3 at = {-0.3F, 0.0002F, -0.13F};
  add_object(scene, "vase", lathe(kVase, 96), clay, translation(at));
  const int head = add_mesh(scene, "billy button", sphere(0.021F, 48), yellow);
  constexpr std::array<Vec3, 6> kTips = {{{-0.13F, 0.36F, 0.03F},
                                          {-0.05F, 0.415F, -0.05F},
                                          {0.03F, 0.385F, 0.04F},
                                          {0.10F, 0.335F, -0.02F},
                                          {0.17F, 0.375F, 0.05F},
                                          {-0.01F, 0.31F, 0.09F}}};
  for (const Vec3 tip : kTips) {
    const Vec3 foot = {0.1F * tip.x, 0.215F, 0.1F * tip.z};
    add_object(scene, "stem",
               bent_tube({{foot,
                           {0.3F * tip.x, 0.29F, 0.3F * tip.z},
                           {0.8F * tip.x, 0.82F * tip.y, 0.8F * tip.z},
                           tip}},
                         0.0022F, 0.0018F, 24),
               green, translation(at));
    add_instance(scene, head, translation(at + tip));
  }
}

void add_fruit(SceneDescription& scene) {
  const int brass = add_material(scene, metal_material("brass", {0.91F, 0.74F, 0.42F}, 0.32F));
  const int orange = add_material(scene, plastic_material("orange", {0.86F, 0.28F, 0.02F}, 0.48F));
  const int lemon = add_material(scene, plastic_material("lemon", {0.86F, 0.66F, 0.07F}, 0.48F));
  const Vec3 at = {0.24F, 0.0002F, -0.07F};
  add_object(scene, "bowl", lathe(kBowl, 96), brass, translation(at));
  const std::array<int, 2> kinds = {add_mesh(scene, "orange", lathe(kFruit, 64), orange),
                                    add_mesh(scene, "lemon", lathe(kFruit, 64), lemon)};
  constexpr std::array<Vec3, 6> kPlaces = {{{-0.045F, 0.059F, 0.032F},
                                            {0.044F, 0.061F, 0.038F},
                                            {0.052F, 0.062F, -0.042F},
                                            {-0.04F, 0.061F, -0.046F},
                                            {0.004F, 0.112F, -0.004F},
                                            {-0.17F, 0.0363F, 0.165F}}};
  for (std::size_t i = 0; i < kPlaces.size(); ++i) {
    const float turn = static_cast<float>(i);
    const bool is_lemon = i == 1 || i == 5;
    const Transform shape = is_lemon ? scaling({0.86F, 1.0F, 0.86F}) : Transform{};
    add_instance(scene, kinds[is_lemon ? 1 : 0],
                 translation(at + kPlaces[i]) * rotation_y(turn) * shape);
  }
}

}  // namespace

Bytes make_still_life() {
  SceneDescription scene;
  const int wall = add_material(scene, diffuse_material("wall", {0.36F, 0.41F, 0.42F}));
  MaterialDescription walnut = plastic_material("walnut", {0.62F, 0.5F, 0.42F}, 0.5F);
  walnut.base_color_texture = add_texture(scene, wood_planks(512));
  const int cloth = add_material(scene, diffuse_material("linen", {0.62F, 0.58F, 0.5F}));
  add_object(scene, "wall", quad({-3, -1, -1.1F}, {3, -1, -1.1F}, {3, 3, -1.1F}, {-3, 3, -1.1F}),
             wall);
  add_object(scene, "floor",
             quad({-3, -0.75F, 2.5F}, {3, -0.75F, 2.5F}, {3, -0.75F, -1.1F}, {-3, -0.75F, -1.1F}),
             add_material(scene, diffuse_material("floor", {0.3F, 0.27F, 0.24F})));
  PrimitiveDescription table = lathe(kTable, 128);
  // Planks lie flat: their texture follows the top, not the rotation.
  for (std::size_t i = 0; i < table.positions.size(); ++i) {
    table.uv[0][i] = {table.positions[i].x * 0.9F, table.positions[i].z * 0.9F};
  }
  add_object(scene, "table", table, add_material(scene, walnut));
  add_object(scene, "cloth", box({-0.13F, 0.0001F, -0.16F}, {0.13F, 0.0018F, 0.16F}), cloth,
             translation({0.13F, 0, 0.2F}) * rotation_y(0.3F));
  add_tea(scene);
  add_flowers(scene);
  add_fruit(scene);
  add_panel(scene, "window", {-1.5F, 1.35F, 0.75F}, {0, 0.1F, 0}, {0.65F, 0.75F},
            Rgb{15.0F, 14.2F, 13.0F});
  add_panel(scene, "fill", {1.7F, 0.9F, 1.4F}, {0, 0.1F, 0}, {0.7F, 0.7F}, Rgb{2.0F, 2.2F, 2.6F});
  add_panel(scene, "glow", {0.5F, 2.1F, -0.4F}, {0, 0.1F, -0.3F}, {0.7F, 0.35F},
            Rgb{3.2F, 2.7F, 2.0F});
  add_camera(scene, {0.02F, 0.45F, 1.32F}, {0.0F, 0.155F, 0}, 0.47F);
  return write_glb(scene);
}

}  // namespace core
