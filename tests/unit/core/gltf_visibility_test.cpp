// KHR_node_visibility; quotations are from the extension.
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

constexpr const char* kHidden = R"("extensions":{"KHR_node_visibility":{"visible":false}})";
constexpr const char* kShown = R"("extensions":{"KHR_node_visibility":{"visible":true}})";

// "A value of `false` causes all nodes below in the hierarchy to be omitted from display, even any
// nodes below that have a value of `true`."
TEST(GltfVisibility, HidesANodeAndItsDescendants) {
  core::GlbWriter writer;
  add_triangle(writer, "", std::string(kHidden) + ",\"children\":[1]");
  writer.add("nodes", R"({"children":[2]})");
  writer.add("nodes", std::string(R"({"mesh":0,)") + kShown + "}");
  add_triangle(writer);
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.size(), 1U);
}

// "default: `true`"
TEST(GltfVisibility, IsTrueByDefault) {
  core::GlbWriter writer;
  add_triangle(writer, "", R"("extensions":{"KHR_node_visibility":{}})");
  add_triangle(writer, "", kShown);
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->instances.size(), 2U);
}

// "all its visual features including but not limited to meshes, light sources [...] are not
// rendered. Visibility affects neither cameras, ..."
TEST(GltfVisibility, HidesLightsButNotCameras) {
  core::GlbWriter writer;
  add_triangle(writer);
  writer.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"point"}]}})");
  writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1,"znear":0.1}})");
  writer.add("nodes", R"({"camera":0,"extensions":{"KHR_lights_punctual":{"light":0},)"
                      R"("KHR_node_visibility":{"visible":false}}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->lights.size(), 0U);
  EXPECT_EQ(scene->cameras.size(), 1U);
}

TEST(GltfVisibility, MayBeRequired) {
  core::GlbWriter writer;
  add_triangle(writer);
  writer.set("extensionsRequired", R"(["KHR_node_visibility"])");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(scene->warnings.empty());
}

}  // namespace
