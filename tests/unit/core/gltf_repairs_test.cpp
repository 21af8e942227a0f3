// Faults that do not keep a file from being drawn and are no rows of gltf_repairs.txt.
#include "core/scene_io/gltf_repairs.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>
#include <vector>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

using Scene = core::SceneDescription;

/// Whether a warning of this kind is about this place.
bool tells(const Scene& scene, const std::string& code, const std::string& pointer) {
  return std::any_of(scene.warnings.begin(), scene.warnings.end(), [&](const core::Warning& w) {
    return w.code == code && w.pointer == pointer && !w.detail.empty();
  });
}

std::string list_of(const Scene& scene) {
  std::string text;
  for (const core::Warning& w : scene.warnings) {
    text += "\n  " + w.code + " " + w.text();
  }
  return text;
}

// The other faults that are mended are rows of gltf_repairs.txt; these give values that no file
// without faults has.
TEST(GltfRepair, CamerasNeedNoNearPlane) {
  core::GlbWriter writer;
  writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1}})");
  writer.add("nodes", R"({"camera":0})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(tells(*scene, "missing", "/cameras/0/perspective")) << list_of(*scene);
  ASSERT_EQ(scene->cameras.size(), 1U);
  EXPECT_EQ(scene->cameras[0].near_m, 0);
}

TEST(GltfRepair, SpotsGetAnEdge) {
  core::GlbWriter writer;
  writer.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"spot",)"
                           R"("spot":{"innerConeAngle":0.5,"outerConeAngle":0.5}}]}})");
  writer.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":0}}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(tells(*scene, "clamped", "/extensions/KHR_lights_punctual/lights/0/spot"))
      << list_of(*scene);
  const auto& light = scene->lights.at(0);
  EXPECT_EQ(light.outer_cone_rad, 0.5F);
  EXPECT_LT(light.inner_cone_rad, 0.5F);
  EXPECT_GT(light.inner_cone_rad, 0.499F);
}

TEST(GltfRepair, DoesNotTouchAFileWithoutFaults) {
  core::GlbWriter writer;
  writer.add("materials", R"({"pbrMetallicRoughness":{"baseColorFactor":[1,0,0.5,1]}})");
  add_triangle(writer, "\"material\":0");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->warnings.empty()) << list_of(*scene);
}

TEST(GltfRepair, FilesOfUnusedPartsMayBeMissing) {
  const std::string json =
      R"({"asset":{"version":"2.0"},"buffers":[{"uri":"gone.bin","byteLength":4}],)"
      R"("images":[{"uri":"gone.png"}],"textures":[{"source":0}],)"
      R"("materials":[{"normalTexture":{"index":0}}],"nodes":[{}]})";
  EXPECT_TRUE(load_json(json));
  EXPECT_EQ(load_json_strictly(json).error().code, core::ErrorCode::kMissingFiles);
}

// Occlusion is computed by tracing paths, so its texture is not needed.
TEST(GltfRepair, OcclusionTexturesAreNotNeeded) {
  core::GlbWriter writer;
  writer.add("images", R"({"uri":"gone.png"})");
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"occlusionTexture":{"index":0}})");
  add_triangle(writer, "\"material\":0");
  EXPECT_TRUE(load(writer));
}

TEST(GltfRepair, NormalsAndTangentsAreMadeUnitVectors) {
  core::GlbWriter writer;
  const int normals =
      accessor(writer, std::vector<float>{0, 0, 3, 0, 0, 0, 0, 0, 1}, kF32, "VEC3", 3);
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"NORMAL\":" + number(normals) + "}");
  const auto scene = load(writer);
  for (const core::Vec3 n : only_primitive(scene).normals) {
    EXPECT_TRUE(n == (core::Vec3{0, 0, 1}));  // that of the triangle, where it is zero
  }
  EXPECT_TRUE(tells(*scene, "normalized", "/meshes/0/primitives/0/attributes/NORMAL"))
      << list_of(*scene);
}

core::Bytes plain_glb() {
  core::GlbWriter writer;
  add_triangle(writer);
  return writer.finish();
}

void put_u32(core::Bytes& file, std::size_t at, std::uint32_t value) {
  std::memcpy(file.data() + at, &value, sizeof value);
}

TEST(GltfRepair, ATotalLengthThatIsWrongDoesNotMatterIfTheChunksAreThere) {
  for (const int off : {-16, 16}) {
    core::Bytes file = plain_glb();
    put_u32(file, 8, static_cast<std::uint32_t>(static_cast<int>(file.size()) + off));
    const auto scene = load(file);
    ASSERT_TRUE(scene) << off << ": " << scene.error().message;
    EXPECT_EQ(scene->instances.size(), 1U);
    EXPECT_TRUE(tells(*scene, "container", "")) << off << list_of(*scene);
    EXPECT_FALSE(load(file, strictly())) << off;
  }
}

TEST(GltfRepair, BytesAfterTheGlbAreIgnored) {
  core::Bytes file = plain_glb();
  file.resize(file.size() + 5, std::byte{0xff});
  const auto scene = load(file);
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_TRUE(tells(*scene, "container", "")) << list_of(*scene);
}

TEST(GltfRepair, MissingPaddingDoesNotMatterButMissingDataDoes) {
  // The buffer has 37 bytes, of which the accessor reads 36.
  core::GlbWriter writer;
  add_triangle(writer);
  core::Bytes file = writer.finish();
  std::string text(reinterpret_cast<const char*>(file.data()), file.size());
  const std::size_t at = text.find("\"byteLength\":36");
  ASSERT_NE(at, std::string::npos);
  const auto with_length = [&](const char* digits) {
    core::Bytes changed = file;
    for (std::size_t i = text.find("\"byteLength\":36"); i != std::string::npos;
         i = text.find("\"byteLength\":36", i + 1)) {
      std::memcpy(changed.data() + i + 13, digits, 2);
    }
    return changed;
  };
  const auto padded = load(with_length("39"));
  ASSERT_TRUE(padded) << padded.error().message;
  EXPECT_TRUE(tells(*padded, "padding", "/buffers/0/byteLength")) << list_of(*padded);
  EXPECT_FALSE(load(with_length("39"), strictly()));
  EXPECT_FALSE(load(with_length("35")));  // one byte of a vertex is missing
}

TEST(GltfRepair, TakesTheMatrixOfAnAnimatedNodeApart) {
  // Half a turn about z, mirrored in x, scaled by 2, 3, 4, moved to (5, 6, 7).
  const std::string matrix = R"("matrix":[2,0,0,0,0,-3,0,0,0,0,4,0,5,6,7,1])";
  const auto animated = [&](const std::string& node, const char* path,
                            const std::vector<float>& value) {
    core::GlbWriter writer;
    add_triangle(writer, "", node);
    const int times = accessor(writer, std::vector<float>{0}, kF32, "SCALAR", 1);
    const int output = accessor(writer, value, kF32, "VEC3", 3);
    writer.add("animations", R"({"samplers":[{"input":)" + number(times) + R"(,"output":)" +
                                 number(output) +
                                 R"(}],"channels":[{"sampler":0,"target":{"node":0,"path":")" +
                                 path + R"("}}]})");
    return writer.finish();
  };
  const auto moved = load(animated(matrix, "translation", {1, 1, 1}));
  ASSERT_TRUE(moved) << moved.error().message;
  const core::Transform m = moved->instances.at(0).to_world;
  EXPECT_NEAR(length(m.x - core::Vec3{2, 0, 0}), 0, 1e-6);
  EXPECT_NEAR(length(m.y - core::Vec3{0, -3, 0}), 0, 1e-6);
  EXPECT_NEAR(length(m.z - core::Vec3{0, 0, 4}), 0, 1e-6);
  EXPECT_TRUE(m.t == (core::Vec3{1, 1, 1}));
  EXPECT_TRUE(tells(*moved, "decomposed", "/nodes/0/matrix")) << list_of(*moved);

  const auto scaled = load(animated(matrix, "scale", {1, 1, 1}));
  ASSERT_TRUE(scaled);
  EXPECT_NEAR(std::abs(scaled->instances.at(0).to_world.determinant()), 1, 1e-6);
  EXPECT_TRUE(scaled->instances.at(0).to_world.t == (core::Vec3{5, 6, 7}));

  const std::string shear = R"("matrix":[1,0,0,0,1,1,0,0,0,0,1,0,0,0,0,1])";
  expect_error_at(load(animated(shear, "translation", {1, 1, 1})), "/nodes/0/matrix");
  expect_error_at(load(animated(matrix, "translation", {1, 1, 1}), strictly()), "/nodes/0/matrix");
}

TEST(GltfRepair, ManyFaultsOfOneKindAreCounted) {
  core::GlbWriter writer;
  for (int i = 0; i < 1000; ++i) {
    writer.add("materials", R"({"pbrMetallicRoughness":{"metallicFactor":2}})");
  }
  writer.add("meshes", R"({"primitives":[{"attributes":{"POSITION":99}}]})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->warnings.size(), 12U) << list_of(*scene);
  EXPECT_EQ(scene->warnings.back().text(), "and 990 more of this kind (clamped)");
  EXPECT_TRUE(tells(*scene, "left_out", "/meshes/0/primitives/0/attributes/POSITION"));
}

}  // namespace
