#include "tests/render/agreement_scenes.h"

#include <cmath>
#include <utility>

namespace test_support {

using core::MaterialDescription;
using core::Rgb;
using core::Vec3;

namespace {

MaterialDescription dielectric(float roughness, Rgb base_color) {
  MaterialDescription m = lambert(base_color);
  m.specular = 1;
  m.roughness = roughness;
  return m;
}

MaterialDescription rough_glass(float roughness) {
  MaterialDescription m = dielectric(roughness, Rgb(1));
  m.transmission = 1;
  m.thickness = 1;
  return m;
}

core::PrimitiveDescription floor_of(int material) {
  return quad({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, material);
}

core::View view_at(core::SceneDescription scene, int side) {
  core::View view = view_of(std::move(scene), side, side);
  look_at(view, {0, 1.6F, 4}, {0, 0.7F, 0}, 45);
  view.settings.max_depth = 4;
  return view;
}

}  // namespace

core::View box(int side) {
  core::View view = view_of(cornell(), side, side);
  look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 40);
  view.settings.max_depth = 4;
  return view;
}

core::View glossy_box(int side) {
  core::SceneDescription scene = cornell();
  scene.materials[0] = dielectric(0.4F, scene.materials[0].base_color);
  MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = 0.6F;
  metal.base_color = {0.9F, 0.6F, 0.3F};
  const auto material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(metal);
  for (std::size_t i = 6; i < 11; ++i) {  // the tall block, after five walls and the emitter
    scene.meshes[0].primitives[i].material = material;
  }
  core::View view = box(side);
  view.scene = build(std::move(scene));
  return view;
}

core::View zoo(int side) {
  MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = 0.5F;
  metal.base_color = {0.9F, 0.6F, 0.3F};
  MaterialDescription lamp = emitter(Rgb(4));
  lamp.double_sided = true;
  core::SceneDescription scene =
      scene_of({dielectric(0.4F, {0.2F, 0.5F, 0.8F}), metal, rough_glass(0.5F), lamp},
               {floor_of(0), sphere({-0.9F, 0.6F, 0}, 0.6F, 12, false, 1),
                sphere({0.6F, 0.6F, 0.5F}, 0.6F, 12, false, 2),
                quad({-1, 2, -1.5F}, {2, 0, 0}, {0, 1, 0}, 3)});
  core::PunctualLightDescription point;
  point.intensity = {2, 1, 1};
  point.to_world = core::translation({1.5F, 2, 1.5F});
  scene.lights.push_back(point);
  core::View view = view_at(std::move(scene), side);
  view.environment = sky_map(
      16, 8, [](int x, int y) { return Rgb(0.2F + 0.1F * static_cast<float>((x + y) % 3)); });
  return view;
}

core::View pane(int side) {
  core::SceneDescription scene = cornell();
  MaterialDescription half = dielectric(0, Rgb(1));
  half.transmission = 0.5F;
  half.double_sided = true;
  scene.meshes[0].primitives.push_back(
      quad({0, 0.1F, 0.5F}, {1, 0, 0}, {0, 0.7F, 0.3F}, static_cast<int>(scene.materials.size())));
  scene.materials.push_back(half);
  core::View view = box(side);
  view.scene = build(std::move(scene));
  return view;
}

core::View instances(int side) {
  core::SceneDescription scene = scene_of({lambert({0.6F, 0.5F, 0.4F})}, {floor_of(0)});
  scene.materials.push_back(rough_glass(0));
  scene.materials.push_back(lambert({0.3F, 0.6F, 0.8F}));
  scene.meshes.resize(3);
  scene.meshes[1].primitives = {sphere({0, 0, 0}, 0.3F, 8, false, 1)};
  scene.meshes[2].primitives = {sphere({0, 0, 0}, 0.3F, 8, false, 2)};
  for (int i = 0; i < 30; ++i) {
    const auto at = static_cast<float>(i);
    const float mirror = i % 3 == 0 ? -1.0F : 1.0F;
    const Vec3 size = {mirror * (0.6F + 0.4F * std::sin(at)), 0.8F + 0.3F * std::cos(at), 0.9F};
    const Vec3 place = {-2 + 0.8F * static_cast<float>(i % 6), 0.5F + 0.3F * std::sin(2 * at),
                        -2 + 0.8F * static_cast<float>(i / 6)};
    const core::Transform turn = core::rotation({0, 0, std::sin(0.5F * at), std::cos(0.5F * at)});
    scene.instances.push_back(
        {.mesh = 1 + i % 2, .to_world = core::translation(place) * turn * core::scaling(size)});
  }
  core::View view = view_at(std::move(scene), side);
  view.environment =
      sky_map(16, 8, [](int x, int y) { return Rgb(x == 5 && y == 2 ? 20.0F : 0.2F); });
  return view;
}

core::View prisms(int side) {
  const auto flint = [](float roughness) {
    MaterialDescription m = rough_glass(roughness);
    m.ior = 1.7F;
    m.dispersion = 1;
    return m;
  };
  MaterialDescription lamp = emitter(Rgb(4));
  lamp.double_sided = true;
  core::SceneDescription scene =
      scene_of({dielectric(0.6F, {0.7F, 0.6F, 0.5F}), flint(0.4F), flint(0), lamp},
               {floor_of(0), sphere({-0.8F, 0.6F, 0}, 0.6F, 12, false, 1),
                sphere({0.7F, 0.5F, 0.4F}, 0.5F, 12, false, 2),
                quad({-1, 2, -1.5F}, {2, 0, 0}, {0, 1, 0}, 3)});
  core::View view = view_at(std::move(scene), side);
  view.environment = constant_sky(Rgb(0.3F));
  return view;
}

core::View fog_in_box(int side, Rgb scattering) {
  core::SceneDescription scene = cornell();
  core::PunctualLightDescription point;
  point.intensity = {0.1F, 0.2F, 0.3F};
  point.to_world = core::translation({0.3F, 0.7F, 0.6F});
  scene.lights.push_back(point);
  core::View view = box(side);
  view.scene = build(std::move(scene));
  view.settings.max_depth = 3;
  view.settings.estimator.roulette = core::RouletteType::kNone;
  view.settings.fog = core::FogSettings{
      .scattering = scattering, .absorption = {0.1F, 0.2F, 0.1F}, .g = 0.5F, .height_falloff = 1};
  return view;
}

}  // namespace test_support
