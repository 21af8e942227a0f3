// Ids of objects, instances and primitives: functions of the file, independent of visibility.
#include "core/aovs/first_hit.h"
#include "core/scene/scene.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

/// Node 0 is empty, 1 has a triangle, 2 the same mesh three times, 3 a mesh of two primitives whose
/// second is a triangle farther away, 4 is hidden.
core::Result<core::SceneDescription> objects(const std::string& of_node_one = "",
                                             const std::string& variant = "") {
  core::GlbWriter writer;
  writer.add("nodes", R"({"name":"empty"})");
  add_triangle(writer, "", of_node_one.empty() ? R"("name":"first")" : of_node_one);
  const int places =
      accessor(writer, std::vector<float>{10, 0, 0, 20, 0, 0, 30, 0, 0}, kF32, "VEC3", 3);
  writer.add("nodes", R"({"mesh":0,"extensions":{"EXT_mesh_gpu_instancing":{"attributes":)"
                      R"({"TRANSLATION":)" +
                          number(places) + "}}}}");
  const int line = accessor(writer, std::vector<float>{0, 0, 0, 1, 0, 0}, kF32, "VEC3", 3);
  const int far =
      accessor(writer, std::vector<float>{0, 0, -5, 1, 0, -5, 0, 1, -5}, kF32, "VEC3", 3);
  const int mesh = writer.add(
      "meshes", R"({"name":"pair","primitives":[{"mode":1,"attributes":{"POSITION":)" +
                    number(line) + R"(}},{"attributes":{"POSITION":)" + number(far) +
                    R"(},"material":0,"extensions":{"KHR_materials_variants":{"mappings":)"
                    R"([{"material":1,"variants":[0]}]}}}]})");
  writer.add("materials", R"({"name":"oak"})");
  writer.add("materials", R"({"name":"ash"})");
  writer.set("extensions", R"({"KHR_materials_variants":{"variants":[{"name":"light"}]}})");
  writer.add("nodes", R"({"mesh":)" + number(mesh) + "}");
  writer.add("nodes", R"({"mesh":0,"extensions":{"KHR_node_visibility":{"visible":false}}})");
  core::GltfOptions options;
  if (!variant.empty()) {
    options.variant = variant;
  }
  return load(writer, options);
}

TEST(GltfObjects, AreTheNodesWithMeshes) {
  const auto scene = objects();
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->objects.size(), 4U);
  const std::vector<std::uint32_t> ids = {2, 3, 4, 5};
  const std::vector<std::uint32_t> first = {1, 2, 5, 6};
  const std::vector<std::uint32_t> counts = {1, 3, 1, 1};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(scene->objects[i].id, ids[i]);
    EXPECT_EQ(scene->objects[i].first_instance, first[i]);
    EXPECT_EQ(scene->objects[i].instances, counts[i]);
  }
  EXPECT_EQ(scene->objects[0].name, "first");
  EXPECT_EQ(scene->objects[2].name, "pair");
  EXPECT_EQ(scene->mesh_primitives, (std::vector<std::uint32_t>{1, 2}));
  ASSERT_EQ(scene->instances.size(), 5U);
  EXPECT_EQ(scene->instances[2].object, 3U);
  EXPECT_EQ(scene->instances[2].instance, 3U);
}

core::FirstHitPixel first_hit_at(const core::Result<core::SceneDescription>& scene, float x) {
  EXPECT_TRUE(scene) << scene.error().message;
  const auto built = core::Scene::build(*scene, 1);
  EXPECT_TRUE(built);
  std::uint64_t rays = 0;
  return core::first_hit_pixel(
      (*built)->data(), {.origin = {x + 0.25F, 0.25F, 9}, .direction = {0, 0, -1}}, nullptr, rays);
}

TEST(GltfObjects, PrimitivesAreCountedOverAllMeshesIncludingSkippedOnes) {
  const core::FirstHitPixel behind = first_hit_at(objects(R"("translation":[0,50,0])"), 0);
  EXPECT_EQ(behind.object, 4U);
  EXPECT_EQ(behind.primitive, 3U);
  EXPECT_EQ(behind.material, 1U);
  const core::FirstHitPixel copy = first_hit_at(objects(), 20);
  EXPECT_EQ(copy.object, 3U);
  EXPECT_EQ(copy.instance, 3U);
  EXPECT_EQ(copy.primitive, 1U);
  EXPECT_EQ(copy.material, 3U) << "glTF's default material follows those of the file";
}

TEST(GltfObjects, IdsAreUnchangedIfAnotherNodeIsHiddenOrScaledToZero) {
  for (const char* node :
       {R"("scale":[0,0,0])", R"("extensions":{"KHR_node_visibility":{"visible":false}})"}) {
    const core::FirstHitPixel copy = first_hit_at(objects(node), 30);
    EXPECT_EQ(copy.object, 3U) << node;
    EXPECT_EQ(copy.instance, 4U) << node;
    EXPECT_EQ(first_hit_at(objects(node), 0).object, 4U);
  }
}

TEST(GltfObjects, VariantsChangeOnlyTheMaterial) {
  const core::FirstHitPixel plain = first_hit_at(objects(R"("scale":[0,0,0])"), 0);
  const core::FirstHitPixel other = first_hit_at(objects(R"("scale":[0,0,0])", "light"), 0);
  EXPECT_EQ(plain.material, 1U);
  EXPECT_EQ(other.material, 2U);
  EXPECT_EQ(other.object, plain.object);
  EXPECT_EQ(other.primitive, plain.primitive);
}

}  // namespace
