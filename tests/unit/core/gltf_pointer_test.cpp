// KHR_animation_pointer; quotations are from the extension.
#include <cmath>
#include <optional>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

/// The target of an animation of two keys, at 1 s and 3 s.
struct Track {
  std::string pointer;
  std::vector<float> values;
  const char* shape = "SCALAR";
  const char* interpolation = "LINEAR";
};

std::size_t width_of(const Track& track) {
  return std::string_view(track.shape) == "SCALAR" ? 1
                                                   : static_cast<std::size_t>(track.shape[3] - '0');
}

void animate(core::GlbWriter& writer, const Track& track, int output) {
  const int times = accessor(writer, std::vector<float>{1, 3}, kF32, "SCALAR", 1);
  writer.add("animations", "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" +
                               number(output) + ",\"interpolation\":\"" + track.interpolation +
                               "\"}],\"channels\":[{\"sampler\":0,\"target\":{\"path\":\"pointer\","
                               "\"extensions\":{\"KHR_animation_pointer\":{\"pointer\":\"" +
                               track.pointer + "\"}}}}]}");
}

void animate(core::GlbWriter& writer, const Track& track) {
  animate(writer, track, accessor(writer, track.values, kF32, track.shape, width_of(track)));
}

/// A triangle with a material, a camera and a light, at 2 s.
core::Result<core::SceneDescription> at_two_seconds(const Track& track) {
  core::GlbWriter writer;
  writer.add("materials", R"({"pbrMetallicRoughness":{"roughnessFactor":1},)"
                          R"("extensions":{"KHR_materials_emissive_strength":{}}})");
  add_triangle(writer, "\"material\":0");
  writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1,"znear":0.1}})");
  writer.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"spot","spot":{}}]}})");
  writer.add("nodes", R"({"camera":0,"extensions":{"KHR_lights_punctual":{"light":0}}})");
  animate(writer, track);
  core::GltfOptions options;
  options.time_seconds = 2;
  return load(writer, options);
}

TEST(GltfPointer, AnimatesAMaterialFactor) {
  const auto scene = at_two_seconds({"/materials/0/pbrMetallicRoughness/baseColorFactor",
                                     {0, 0.5F, 1, 1, 1, 0.5F, 0, 1},
                                     "VEC4"});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].base_color.r, 0.5F);
  EXPECT_EQ(scene->materials[0].base_color.g, 0.5F);
  EXPECT_EQ(scene->materials[0].base_color.b, 0.5F);
}

// "A property is considered defined if it is present in the asset explicitly or if it has a default
// value and its enclosing object is present."
TEST(GltfPointer, AnimatesPropertiesWithADefault) {
  const auto scene =
      at_two_seconds({"/materials/0/pbrMetallicRoughness/metallicFactor", {0, 0.5F}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].metallic, 0.25F);
}

TEST(GltfPointer, AnimatesAMemberOfAnExtension) {
  const auto scene = at_two_seconds(
      {"/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength", {2, 4}});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(scene->has_emissive_strength);
}

TEST(GltfPointer, AnimatesCamerasAndLights) {
  const auto camera = at_two_seconds({"/cameras/0/perspective/yfov", {0.5F, 1.5F}});
  ASSERT_TRUE(camera) << camera.error().message;
  EXPECT_EQ(camera->cameras[0].vertical_fov_rad, 1);
  const auto light =
      at_two_seconds({"/extensions/KHR_lights_punctual/lights/0/intensity", {10, 30}});
  ASSERT_TRUE(light) << light.error().message;
  EXPECT_EQ(light->lights[0].intensity.r, 20);
  const auto cone =
      at_two_seconds({"/extensions/KHR_lights_punctual/lights/0/spot/outerConeAngle", {0.5F, 1}});
  ASSERT_TRUE(cone) << cone.error().message;
  EXPECT_EQ(cone->lights[0].outer_cone_rad, 0.75F);
}

// "The following two snippets represent the same animation expressed with an unextended animation
// target and with the animation pointer extension."
TEST(GltfPointer, AnimatesANodeLikeAPlainChannel) {
  const float half = std::sqrt(0.5F);
  const auto scene =
      at_two_seconds({"/nodes/0/rotation", {0, 0, half, half, 0, 0, -half, -half}, "VEC4"});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_NEAR(scene->instances[0].to_world.x.y, 1, 1e-6F);  // both keys are the same rotation
}

// "MUST use STEP interpolation", "`0` is converted to `false`, any other value [...] to `true`"
TEST(GltfPointer, HidesANodeTemporarily) {
  core::GlbWriter writer;
  add_triangle(writer, "", R"("extensions":{"KHR_node_visibility":{}})");
  const int output = accessor(writer, std::vector<std::uint8_t>{0, 7}, kU8, "SCALAR", 1);
  animate(writer, {"/nodes/0/extensions/KHR_node_visibility/visible", {}, "SCALAR", "STEP"},
          output);
  const core::Bytes file = writer.finish();
  const auto instances_at = [&file](std::optional<double> time) {
    core::GltfOptions options;
    options.time_seconds = time;
    const auto scene = load(file, options);
    return scene ? static_cast<int>(scene->instances.size()) : -1;
  };
  EXPECT_EQ(instances_at(2.9), 0);
  EXPECT_EQ(instances_at(3.0), 1);
  EXPECT_EQ(instances_at(std::nullopt), 1);
}

/// Luminous intensities of the lights of a scene with a light in a hidden or shown node below a
/// node whose visibility has two keys.
std::vector<float> lights_at(std::optional<double> time, const char* node,
                             const std::vector<std::uint8_t>& keys) {
  core::GlbWriter writer;
  add_triangle(writer);
  writer.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"point"}]}})");
  writer.add("nodes",
             R"({"children":[2],"extensions":{"KHR_node_visibility":)" + std::string(node) + "}}");
  writer.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":0}}})");
  animate(writer, {"/nodes/1/extensions/KHR_node_visibility/visible", {}, "SCALAR", "STEP"},
          accessor(writer, keys, kU8, "SCALAR", 1));
  core::GltfOptions options;
  options.time_seconds = time;
  const auto scene = load(writer, options);
  std::vector<float> intensities;
  for (const auto& light : scene.value().lights) {
    intensities.push_back(light.intensity.r);
  }
  return intensities;
}

// The sky that jobs get by default depends on whether a scene has lights, so at all times the same.
TEST(GltfPointer, LightsThatItHidesForATimeRemainWithoutIntensity) {
  const std::vector<float> lit = {1};
  const std::vector<float> dark = {0};
  for (const char* node : {"{}", R"({"visible":false})"}) {
    EXPECT_EQ(lights_at(0, node, {1, 0}), lit) << node;
    EXPECT_EQ(lights_at(3, node, {1, 0}), dark) << node;
    EXPECT_EQ(lights_at(0, node, {0, 1}), dark) << node;
    EXPECT_EQ(lights_at(3, node, {0, 1}), lit) << node;
  }
  EXPECT_EQ(lights_at(3, "{}", {0, 0}), dark);
  EXPECT_EQ(lights_at(std::nullopt, "{}", {0, 0}), lit);
  EXPECT_EQ(lights_at(std::nullopt, R"({"visible":false})", {0, 1}), dark);
  // Never shown:
  EXPECT_TRUE(lights_at(3, R"({"visible":false})", {0, 0}).empty());
  EXPECT_TRUE(lights_at(std::nullopt, R"({"visible":false})", {0, 0}).empty());
}

TEST(GltfPointer, EmissionIsStrongIfItIsAtAnyTime) {
  const auto is_strong = [](std::optional<double> time, const char* own, Track track) {
    core::GlbWriter writer;
    writer.add("materials",
               R"({"extensions":{"KHR_materials_emissive_strength":)" + std::string(own) + "}}");
    add_triangle(writer, "\"material\":0");
    track.pointer = "/materials/0/extensions/KHR_materials_emissive_strength/emissiveStrength";
    animate(writer, track);
    core::GltfOptions options;
    options.time_seconds = time;
    return load(writer, options).value().has_emissive_strength;
  };
  const char* const strong = R"({"emissiveStrength":4})";
  const std::vector<std::optional<double>> times = {std::nullopt, 0, 2, 3, 9};
  for (const std::optional<double> time : times) {
    EXPECT_TRUE(is_strong(time, "{}", {"", {4, 0}}));
    EXPECT_TRUE(is_strong(time, "{}", {"", {0, 4}}));
    EXPECT_TRUE(is_strong(time, strong, {"", {0, 0}}));
    EXPECT_FALSE(is_strong(time, "{}", {"", {0, 1}}));
    // Of splines the values count, not the tangents.
    EXPECT_FALSE(is_strong(time, "{}", {"", {5, 0, 0, 0, 1, 5}, "SCALAR", "CUBICSPLINE"}));
    EXPECT_TRUE(is_strong(time, "{}", {"", {0, 0, 0, 0, 4, 0}, "SCALAR", "CUBICSPLINE"}));
  }
}

TEST(GltfPointer, ClampsValuesToTheirRange) {
  // The spline exceeds [0, 1] between its keys: tangents of 100.
  const auto scene = at_two_seconds({"/materials/0/pbrMetallicRoughness/roughnessFactor",
                                     {0, 1, 100, -100, 1, 0},
                                     "SCALAR",
                                     "CUBICSPLINE"});
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].roughness, 1);
}

TEST(GltfPointer, AnimatesOneMorphTargetWeight) {
  core::GlbWriter writer;
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  const int lift = accessor(writer, std::vector<float>{0, 0, 2, 0, 0, 2, 0, 0, 2}, kF32, "VEC3", 3);
  writer.add("meshes", "{\"primitives\":[{\"attributes\":{\"POSITION\":" + number(positions) +
                           "},\"targets\":[{\"POSITION\":" + number(lift) +
                           "}]}],\"weights\":[0]}");
  writer.add("nodes", R"({"mesh":0})");
  animate(writer, {"/meshes/0/weights/0", {0, 1}});
  core::GltfOptions options;
  options.time_seconds = 2;
  EXPECT_EQ(only_primitive(load(writer, options)).positions.at(0).z, 1);
}

TEST(GltfPointer, IgnoresALaterAnimationOfTheSameProperty) {
  core::GlbWriter writer;
  writer.add("materials", R"({"alphaMode":"MASK"})");
  add_triangle(writer, "\"material\":0");
  animate(writer, {"/materials/0/alphaCutoff", {0.25F, 0.25F}});
  animate(writer, {"/materials/0/alphaCutoff", {0.75F, 0.75F}});
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].alpha_cutoff, 0.25F);
  ASSERT_EQ(scene->warnings.size(), 1U);
}

}  // namespace
