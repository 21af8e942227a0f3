#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>

#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/windings.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::Vec2;
using core::Vec3;

std::string attributes(int positions, const std::string& more = "") {
  return "\"attributes\":{\"POSITION\":" + number(positions) + (more.empty() ? "" : "," + more) +
         "}";
}

// Five points; glTF 2.0, figure in section 3.7.2.1, defines the triangles of each mode.
std::vector<std::uint32_t> triangles_of_mode(int mode) {
  core::GlbWriter writer;
  const std::vector<float> points = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 2, 0};
  const int positions = accessor(writer, points, kF32, "VEC3", 3);
  add_primitive(writer, attributes(positions) + ",\"mode\":" + number(mode));
  return only_primitive(load(writer)).indices;
}

TEST(GltfGeometry, StripAlternatesItsOrder) {
  EXPECT_EQ(triangles_of_mode(5), (std::vector<std::uint32_t>{0, 1, 2, 1, 3, 2, 2, 3, 4}));
}

TEST(GltfGeometry, FanUsesItsFirstVertexForAllTriangles) {
  EXPECT_EQ(triangles_of_mode(6), (std::vector<std::uint32_t>{1, 2, 0, 2, 3, 0, 3, 4, 0}));
}

TEST(GltfGeometry, IncompleteTriangleIsLeftOut) {
  EXPECT_EQ(triangles_of_mode(4), (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(GltfGeometry, PointsAndLinesAreSkippedWithAWarning) {
  for (int mode = 0; mode < 4; ++mode) {
    core::GlbWriter writer;
    add_triangle(writer, "\"mode\":" + number(mode));
    const auto scene = load(writer);
    ASSERT_TRUE(scene);
    EXPECT_TRUE(scene->instances.empty());
    EXPECT_EQ(scene->warnings.size(), 1U);
  }
}

template <typename T>
std::vector<std::uint32_t> read_indices(int type) {
  core::GlbWriter writer;
  const int indices = accessor(writer, std::vector<T>{2, 0, 1}, type, "SCALAR", 1);
  add_triangle(writer, "\"indices\":" + number(indices));
  return only_primitive(load(writer)).indices;
}

TEST(GltfGeometry, ReadsAllIndexTypes) {
  const std::vector<std::uint32_t> expected = {2, 0, 1};
  EXPECT_EQ(read_indices<std::uint8_t>(kU8), expected);
  EXPECT_EQ(read_indices<std::uint16_t>(kU16), expected);
  EXPECT_EQ(read_indices<std::uint32_t>(kU32), expected);
}

TEST(GltfGeometry, MissingIndicesAreSequential) {
  core::GlbWriter writer;
  add_triangle(writer);
  EXPECT_EQ(only_primitive(load(writer)).indices, (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(GltfGeometry, MissingNormalsStayMissing) {
  core::GlbWriter writer;
  add_triangle(writer);
  EXPECT_TRUE(only_primitive(load(writer)).normals.empty());
}

TEST(GltfGeometry, NormalisedIntegersFollowTheSpecification) {
  core::GlbWriter writer;
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  const int uv0 = writer.add_accessor(bytes(std::vector<std::uint16_t>{0, 65535, 13107, 0, 0, 0}),
                                      kU16, "VEC2", 3, R"({"normalized":true})");
  const int uv1 = writer.add_accessor(
      bytes(std::vector<std::int8_t>{-128, -127, 0, 0, 127, 64, 0, 0, 0, 0, 0, 0}), kI8, "VEC2", 3,
      R"({"normalized":true})");
  add_primitive(writer, attributes(positions, "\"TEXCOORD_0\":" + number(uv0) +
                                                  ",\"TEXCOORD_1\":" + number(uv1)));
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.uv[0].size(), 3U);
  EXPECT_EQ(p.uv[0][0], (Vec2{0, 1}));
  EXPECT_FLOAT_EQ(p.uv[0][1].x, 0.2F);
  ASSERT_EQ(p.uv[1].size(), 3U);
  EXPECT_EQ(p.uv[1][0], (Vec2{-1, -1}));  // max(c / 127, -1)
}

TEST(GltfGeometry, QuantizedPositionsKeepTheirIntegers) {
  core::GlbWriter writer;
  writer.set("extensionsRequired", R"(["KHR_mesh_quantization"])");
  const std::vector<std::int16_t> quantized = {0, 0, 0, 0, 300, -7, 2, 0, 0, 1, 0, 0};
  const int view = writer.add_view(bytes(quantized), R"({"byteStride":8})");
  const int positions =
      writer.add("accessors", R"({"componentType":5122,"type":"VEC3","count":3,"bufferView":)" +
                                  number(view) + "}");
  add_primitive(writer, attributes(positions));
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[1], (Vec3{300, -7, 2}));
}

TEST(GltfGeometry, ReadsInterleavedViews) {
  core::GlbWriter writer;
  // Position and texture coordinate of each vertex in turn: stride 20.
  const std::vector<float> mixed = {0, 0, 0, 0.25F, 0.5F, 1, 0, 0, 0.75F, 1, 0, 1, 0, 0, 1};
  const int view = writer.add_view(bytes(mixed), R"({"byteStride":20})");
  const auto add = [&](int offset, const char* type) {
    return writer.add("accessors",
                      "{\"componentType\":5126,\"count\":3,\"byteOffset\":" + number(offset) +
                          ",\"type\":\"" + type + "\",\"bufferView\":" + number(view) + "}");
  };
  const int positions = add(0, "VEC3");
  const int uv = add(12, "VEC2");
  add_primitive(writer, attributes(positions, "\"TEXCOORD_0\":" + number(uv)));
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[2], (Vec3{0, 1, 0}));
  EXPECT_EQ(p.uv[0][1], (Vec2{0.75F, 1}));
}

TEST(GltfGeometry, SparseValuesReplaceDenseOnes) {
  core::GlbWriter writer;
  const int indices = writer.add_view(bytes(std::vector<std::uint8_t>{2}));
  const int values = writer.add_view(bytes(std::vector<float>{7, 8, 9}));
  const std::string sparse =
      "{\"sparse\":{\"count\":1,\"indices\":{\"componentType\":5121,\"bufferView\":" +
      number(indices) + "},\"values\":{\"bufferView\":" + number(values) + "}}}";
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3, sparse.c_str());
  add_primitive(writer, attributes(positions));
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[1], (Vec3{1, 0, 0}));
  EXPECT_EQ(p.positions[2], (Vec3{7, 8, 9}));
}

TEST(GltfGeometry, ColorsOfThreeValuesAreOpaque) {
  core::GlbWriter writer;
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  const int colors =
      accessor(writer, std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 1}, kF32, "VEC3", 3);
  add_primitive(writer, attributes(positions, "\"COLOR_0\":" + number(colors)));
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.colors.size(), 3U);
  EXPECT_EQ(p.colors[1].y, 1.0F);
  EXPECT_EQ(p.colors[1].w, 1.0F);
}

TEST(GltfGeometry, ColorsOfBytesAreNormalised) {
  core::GlbWriter writer;
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  const int colors =
      writer.add_accessor(bytes(std::vector<std::uint8_t>{255, 51, 0, 102, 0, 0, 0, 0, 0, 0, 0, 0}),
                          kU8, "VEC4", 3, R"({"normalized":true})");
  add_primitive(writer, attributes(positions, "\"COLOR_0\":" + number(colors)));
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.colors.size(), 3U);
  EXPECT_FLOAT_EQ(p.colors[0].y, 0.2F);
  EXPECT_FLOAT_EQ(p.colors[0].w, 0.4F);
}

constexpr Vec3 kUp = {0, 0, 1};
constexpr Vec3 kDown = {0, 0, -1};

/// A square in the plane z = 0 of two triangles that share an edge; they face up if their letter is
/// 'u', else down. A morph target adds +x to the normals.
core::Result<core::SceneDescription> square(const char* faces, const std::vector<Vec3>& normals,
                                            const core::GltfOptions& options = {}, int weight = 0) {
  core::GlbWriter writer;
  const int positions =
      accessor(writer, std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}, kF32, "VEC3", 3);
  std::vector<std::uint16_t> indices = {0, 1, 2, 0, 2, 3};
  for (std::size_t i = 0; i < 2; ++i) {
    if (faces[i] == 'd') {
      std::swap(indices[3 * i + 1], indices[3 * i + 2]);
    }
  }
  const int normal = writer.add_accessor(bytes(normals), kF32, "VEC3", 4);
  const int tangent = accessor(writer,
                               std::vector<float>{1, 0, 0, 1, 1, 0, 0, 1,  //
                                                  1, 0, 0, 1, 1, 0, 0, 1},
                               kF32, "VEC4", 4);
  const int index = accessor(writer, indices, kU16, "SCALAR", 1);
  const int morph = writer.add_accessor(
      bytes(std::vector<Vec3>{{1, 0, 0}, {1, 0, 0}, {1, 0, 0}, {1, 0, 0}}), kF32, "VEC3", 4);
  writer.add("meshes", R"({"name":"tile","primitives":[{)" +
                           attributes(positions, "\"NORMAL\":" + number(normal) +
                                                     ",\"TANGENT\":" + number(tangent)) +
                           ",\"indices\":" + number(index) + ",\"targets\":[{\"NORMAL\":" +
                           number(morph) + "}]}],\"weights\":[" + number(weight) + "]}");
  writer.add("nodes", R"({"mesh":0})");
  return load(writer, options);
}

/// Corners whose normal is not that of their triangle's letter, or whose bitangent is not +y.
int wrong_corners(const core::PrimitiveDescription& p, const char* normals) {
  int wrong = 0;
  for (std::size_t i = 0; i < p.indices.size(); ++i) {
    const std::uint32_t v = p.indices[i];
    const Vec3 n = p.normals.at(v);
    const core::Vec4 t = p.tangents.at(v);
    const Vec3 bitangent = cross(n, {t.x, t.y, t.z}) * t.w;
    const Vec3 expected = normals[i / 3] == 'u' ? kUp : kDown;
    wrong += n == expected && bitangent == Vec3{0, 1, 0} ? 0 : 1;
  }
  return wrong;
}

TEST(GltfGeometry, NormalsThatPointToTheBackAreTurned) {
  const std::vector<Vec3> up = {kUp, kUp, kUp, kUp};
  const auto all = square("dd", up);
  EXPECT_EQ(wrong_corners(only_primitive(all), "dd"), 0);
  EXPECT_EQ(only_primitive(all).positions.size(), 4U);
  ASSERT_EQ(all->warnings.size(), 1U);
  EXPECT_EQ(all->warnings[0].code, "turned");
  EXPECT_EQ(
      all->warnings[0].text(),
      "/meshes/0/primitives/0: the normals of 2 of the 2 triangles of mesh 'tile' point to the "
      "back of their triangle; they are turned");
  EXPECT_TRUE(square("dd", up, strictly()));

  // The shared vertices are split.
  const auto one = square("ud", up);
  EXPECT_EQ(wrong_corners(only_primitive(one), "ud"), 0);
  EXPECT_EQ(only_primitive(one).positions.size(), 6U);
  EXPECT_EQ(one->warnings.size(), 1U);

  const auto none = square("uu", up);
  EXPECT_EQ(wrong_corners(only_primitive(none), "uu"), 0);
  EXPECT_TRUE(none->warnings.empty());
}

TEST(GltfGeometry, MorphedNormalsAreTurnedAsAWhole) {
  const auto p = only_primitive(square("ud", {kUp, kUp, kUp, kUp}, {}, 1));
  ASSERT_EQ(p.indices.size(), 6U);
  for (std::size_t i = 0; i < 6; ++i) {
    const float along = (i < 3 ? 1.0F : -1.0F) * std::sqrt(0.5F);
    EXPECT_NEAR(p.normals.at(p.indices[i]).x, along, 1e-6F) << i;
    EXPECT_NEAR(p.normals.at(p.indices[i]).z, along, 1e-6F) << i;
  }
}

TEST(GltfGeometry, NormalsThatDisagreeAreNotTurned) {
  const auto scene = square("uu", {kDown, kUp, kDown, kDown});
  const core::PrimitiveDescription p = only_primitive(scene);
  EXPECT_EQ(p.positions.size(), 6U);  // the second triangle is turned
  EXPECT_EQ(p.normals.at(p.indices[0]), kDown);
  EXPECT_EQ(p.normals.at(p.indices[1]), kUp);
  EXPECT_EQ(p.normals.at(p.indices[2]), kDown);
  EXPECT_EQ(p.normals.at(p.indices[5]), kUp);
  EXPECT_TRUE(square("uu", {kUp, kDown, kUp, kDown})->warnings.empty());
  const Vec3 level = {1, 0, 0};
  EXPECT_TRUE(square("uu", {level, level, level, level})->warnings.empty());
}

// As at the poles of spheres.
TEST(GltfGeometry, NormalsOfSliversThatFaceAnywhereAreNotTurned) {
  for (const float height : {1e-8F, 1e-4F}) {
    core::GlbWriter writer;
    const int positions =
        accessor(writer, std::vector<float>{1, 0, 0, 2, 0, 0, 1.5F, height, 0}, kF32, "VEC3", 3);
    const int normals =
        accessor(writer, std::vector<float>{0, 0, -1, 0, 0, -1, 0, 0, -1}, kF32, "VEC3", 3);
    add_primitive(writer, attributes(positions, "\"NORMAL\":" + number(normals)));
    const auto scene = load(writer);
    EXPECT_EQ(only_primitive(scene).normals.at(0), height < 1e-6F ? kDown : kUp);
    EXPECT_EQ(scene->warnings.size(), height < 1e-6F ? 0U : 1U);
  }
}

TEST(GltfGeometry, NodesWithOneMeshShareIt) {
  core::GlbWriter writer;
  add_triangle(writer);
  writer.add("nodes", R"({"mesh":0,"translation":[1,2,3]})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->meshes.size(), 1U);
  ASSERT_EQ(scene->instances.size(), 2U);
  EXPECT_EQ(scene->instances[1].to_world.t, (Vec3{1, 2, 3}));
}

TEST(GltfGeometry, ChildrenFollowTheirParents) {
  core::GlbWriter writer;
  add_triangle(writer, "", "\"translation\":[1,0,0]");
  // A quarter turn about z, scaled by two, moved up by 5: (1,0,0) maps to (0,7,0).
  writer.add("nodes",
             R"({"children":[0],"translation":[0,5,0],"rotation":[0,0,0.70710678,0.70710678],)"
             R"("scale":[2,2,2]})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->instances.size(), 1U);
  const Vec3 origin = scene->instances[0].to_world.point({0, 0, 0});
  EXPECT_NEAR(origin.x, 0, 1e-6);
  EXPECT_NEAR(origin.y, 7, 1e-6);
}

TEST(GltfGeometry, MatricesAreColumnMajor) {
  core::GlbWriter writer;
  add_triangle(writer, "", "\"matrix\":[1,2,3,0,4,5,6,0,7,8,10,0,11,12,13,1]");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  const core::Transform m = scene->instances.at(0).to_world;
  EXPECT_EQ(m.x, (Vec3{1, 2, 3}));
  EXPECT_EQ(m.t, (Vec3{11, 12, 13}));
}

TEST(GltfGeometry, SingularNodeIsBakedIntoItsVertices) {
  core::GlbWriter writer;
  add_triangle(writer, "", "\"scale\":[3,1,0]");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->instances.size(), 1U);
  EXPECT_EQ(scene->instances[0].to_world.determinant(), 1.0F);
  EXPECT_EQ(only_primitive(scene).positions.at(1), (Vec3{3, 0, 0}));
}

TEST(GltfGeometry, NodeOfZeroScaleIsHidden) {
  core::GlbWriter writer;
  add_triangle(writer, "", "\"scale\":[0,0,0]");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_TRUE(scene->instances.empty());
}

TEST(GltfGeometry, GpuInstancesMultiplyTheNode) {
  core::GlbWriter writer;
  const int translations = accessor(writer, std::vector<float>{1, 0, 0, 2, 0, 0}, kF32, "VEC3", 3);
  const int scales = accessor(writer, std::vector<float>{1, 1, 1, 3, 3, 3}, kF32, "VEC3", 3);
  add_triangle(writer, "",
               "\"translation\":[0,10,0],\"extensions\":{\"EXT_mesh_gpu_instancing\":{"
               "\"attributes\":{\"TRANSLATION\":" +
                   number(translations) + ",\"SCALE\":" + number(scales) + "}}}");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->instances.size(), 2U);
  EXPECT_EQ(scene->instances[1].to_world.point({1, 0, 0}), (Vec3{5, 10, 0}));
}

// Each has vertices of its own.
TEST(GltfGeometry, FlattenedGpuInstancesAreDrawn) {
  core::GlbWriter writer;
  const int translations = accessor(writer, std::vector<float>{1, 0, 0, 2, 0, 0}, kF32, "VEC3", 3);
  const int scales = accessor(writer, std::vector<float>{1, 1, 0, 3, 3, 0}, kF32, "VEC3", 3);
  add_triangle(writer, "",
               "\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":" +
                   number(translations) + ",\"SCALE\":" + number(scales) + "}}}");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->instances.size(), 2U);
  const auto width = [&](std::size_t i) {
    core::Bounds box;
    const auto mesh = static_cast<std::size_t>(scene->instances[i].mesh);
    for (const Vec3 p : scene->meshes.at(mesh).primitives.at(0).positions) {
      box.add(scene->instances[i].to_world.point(p));
    }
    return box;
  };
  EXPECT_EQ(width(0).min.x, 1);
  EXPECT_EQ(width(1).min.x, 2);
  EXPECT_EQ(width(1).diagonal().x, 3 * width(0).diagonal().x);
  EXPECT_NE(scene->instances[0].instance, scene->instances[1].instance);
}

// KHR_lights_punctual: only the node's rotation turns a light. 90 degrees around x: -z is +y.
TEST(GltfGeometry, ScalesOfZeroDoNotTurnLights) {
  for (const char* scale : {"[1,1,1]", "[1,1,0]", "[0,0,0]", "[-2,0,3]"}) {
    core::GlbWriter writer;
    add_triangle(writer);
    writer.set("extensions", R"({"KHR_lights_punctual":{"lights":[{"type":"directional"}]}})");
    writer.add("nodes", std::string(R"({"rotation":[0.70710678,0,0,0.70710678],"scale":)") + scale +
                            R"(,"extensions":{"KHR_lights_punctual":{"light":0}}})");
    writer.add("scenes", R"({"nodes":[0,1]})");
    const auto scene = load(writer);
    ASSERT_TRUE(scene) << scale;
    ASSERT_EQ(scene->lights.size(), 1U) << scale;
    const Vec3 z = scene->lights[0].to_world.z;
    EXPECT_NEAR(z.y, -1, 1e-6) << scale;
    EXPECT_NEAR(z.z, 0, 1e-6) << scale;
  }
}

/// A triangle twice with the same winding and, between them, its back.
core::SceneDescription both_windings(const std::string& material) {
  core::GlbWriter writer;
  const int indices =
      accessor(writer, std::vector<std::uint8_t>{0, 1, 2, 2, 1, 0, 1, 2, 0}, kU8, "SCALAR", 1);
  writer.add("materials", "{" + material + "}");
  add_triangle(writer, "\"material\":0,\"indices\":" + number(indices));
  auto scene = load(writer);
  EXPECT_TRUE(scene);
  return scene ? *std::move(scene) : core::SceneDescription();
}

TEST(GltfGeometry, BothWindingsOfATriangleAreOneOfASolidAndTwoMeshesOfAnEmitter) {
  using Indices = std::vector<std::uint32_t>;
  const Indices all = {0, 1, 2, 2, 1, 0, 1, 2, 0};
  const Indices fronts = {0, 1, 2, 1, 2, 0};
  const std::string glass =
      R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":1})";
  const auto solid = both_windings(glass + R"(,"KHR_materials_volume":{"thicknessFactor":1}})");
  EXPECT_EQ(solid.meshes.at(0).primitives.at(0).indices, fronts);
  EXPECT_EQ(solid.meshes[0].primitives.size(), 1);
  ASSERT_EQ(solid.warnings.size(), 1);
  EXPECT_NE(solid.warnings[0].detail.find("both windings"), std::string::npos);
  const auto emitter = both_windings(R"("emissiveFactor":[1,1,1])");
  ASSERT_EQ(emitter.meshes.at(0).primitives.size(), 2);
  EXPECT_EQ(emitter.meshes[0].primitives[0].indices, fronts);
  EXPECT_EQ(emitter.meshes[0].primitives[1].indices, (Indices{2, 1, 0}));
  for (const std::string& other : {std::string(), glass + "}",
                                   std::string(R"("emissiveFactor":[1,1,1],"doubleSided":true)")}) {
    const auto scene = both_windings(other);
    ASSERT_EQ(scene.meshes.at(0).primitives.size(), 1) << other;
    EXPECT_EQ(scene.meshes[0].primitives[0].indices, all) << other;
  }
}

/// Triangles over the corners of a tetrahedron, with the warnings of the file.
core::SceneDescription tetrahedron(const std::vector<std::uint8_t>& corners,
                                   const std::string& material) {
  core::GlbWriter writer;
  const int positions =
      accessor(writer, std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1}, kF32, "VEC3", 3);
  const int indices = accessor(writer, corners, kU8, "SCALAR", 1);
  writer.add("materials", "{" + material + "}");
  writer.add("meshes", "{\"primitives\":[{" + attributes(positions) +
                           ",\"material\":0,\"indices\":" + number(indices) + "}]}");
  writer.add("nodes", R"({"mesh":0})");
  writer.add("scenes", R"({"nodes":[0]})");
  auto scene = load(writer);
  EXPECT_TRUE(scene);
  return scene ? *std::move(scene) : core::SceneDescription();
}

TEST(GltfGeometry, TrianglesOfASolidFaceAsTheirNeighbours) {
  const std::string solid =
      R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":1},)"
      R"("KHR_materials_volume":{"thicknessFactor":1}})";
  const std::vector<std::uint8_t> outwards = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};
  const std::vector<std::uint32_t> expected(outwards.begin(), outwards.end());
  EXPECT_EQ(tetrahedron(outwards, solid).meshes.at(0).primitives.at(0).indices, expected);
  for (std::size_t triangle = 0; triangle < 3; ++triangle) {  // smaller than the fourth
    std::vector<std::uint8_t> corners = outwards;
    std::swap(corners[3 * triangle + 1], corners[3 * triangle + 2]);
    const auto mended = tetrahedron(corners, solid);
    EXPECT_EQ(mended.meshes.at(0).primitives.at(0).indices, expected) << triangle;
    ASSERT_EQ(mended.warnings.size(), 1);
    EXPECT_EQ(mended.warnings[0].code, "turned");
    EXPECT_EQ(mended.warnings[0].detail.substr(0, 20), "1 of the 4 triangles");
    const auto opaque = tetrahedron(corners, R"("name":"opaque")");
    EXPECT_NE(opaque.meshes.at(0).primitives.at(0).indices, expected);
    EXPECT_TRUE(opaque.warnings.empty());
  }
  std::vector<std::uint8_t> half = outwards;
  std::swap(half[1], half[2]);
  std::swap(half[10], half[11]);
  const auto inwards = tetrahedron(half, solid).meshes.at(0).primitives.at(0).indices;
  EXPECT_EQ(inwards, (std::vector<std::uint32_t>{0, 1, 2, 0, 3, 1, 0, 2, 3, 1, 3, 2}))
      << "of two halves the smaller is turned; SolidFinder turns the whole";
}

/// Adds the six squares of a cube, which faces inwards if `inwards`.
void add_cube(core::PrimitiveDescription& to, float half, float x, bool inwards) {
  const auto first = static_cast<std::uint32_t>(to.positions.size());
  for (int i = 0; i < 8; ++i) {
    to.positions.push_back({x + ((i & 1) != 0 ? half : -half), (i & 2) != 0 ? half : -half,
                            (i & 4) != 0 ? half : -half});
  }
  constexpr std::uint32_t kFaces[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                          {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (const auto& f : kFaces) {
    for (const auto& [a, b, c] : {std::array{f[0], f[1], f[2]}, std::array{f[0], f[2], f[3]}}) {
      to.indices.insert(to.indices.end(),
                        {first + a, first + (inwards ? c : b), first + (inwards ? b : c)});
    }
  }
}

std::vector<std::size_t> aligned(const std::vector<core::PrimitiveDescription*>& primitives) {
  return core::align_windings(primitives);
}

TEST(GltfGeometry, SolidsOfAPrimitiveFaceOutwardsAndCavitiesInwards) {
  const auto turned = [](std::initializer_list<std::tuple<float, float, bool>> cubes) {
    core::PrimitiveDescription p;
    for (const auto& [half, x, inwards] : cubes) {
      add_cube(p, half, x, inwards);
    }
    return aligned({&p}).at(0);
  };
  EXPECT_EQ(turned({{1, 0, false}, {1, 3, false}}), 0);
  EXPECT_EQ(turned({{1, 0, false}, {1, 3, true}}), 12) << "beside the other";
  EXPECT_EQ(turned({{1, 0, true}, {0.5F, 3, false}}), 12);
  EXPECT_EQ(turned({{1, 0, false}, {0.5F, 0, true}}), 0) << "a cavity";
  EXPECT_EQ(turned({{1, 0, true}, {1, 3, true}}), 0) << "other meshes may surround them";
}

TEST(GltfGeometry, ManySolidsOfAPrimitiveAreTurnedUnlessOneSurroundsThem) {
  core::PrimitiveDescription p;
  add_cube(p, 1, -3, false);
  std::size_t expected = 0;
  for (int i = 0; i < 20000; ++i) {  // more than can be compared with each other
    const float x = 4 * static_cast<float>(i);
    add_cube(p, 1, x, i % 3 == 0);
    add_cube(p, 0.5F, x, true);  // a cavity
    expected += i % 3 == 0 ? 12 : 0;
  }
  EXPECT_EQ(aligned({&p}).at(0), expected);
}

TEST(GltfGeometry, PrimitivesOfASolidFaceAsTheirNeighbours) {
  core::SceneDescription scene;
  scene.materials = {core::glass_material("glass", {1, 1, 1}, 1)};
  scene.instances.push_back({0, {}});
  auto& parts = scene.meshes.emplace_back().primitives;
  parts.resize(2);
  add_cube(parts[0], 1, 0, false);
  add_cube(parts[1], 1, 0, true);
  parts[0].indices.resize(24);                                                    // four squares
  parts[1].indices.erase(parts[1].indices.begin(), parts[1].indices.end() - 12);  // the others
  parts[0].material = parts[1].material = 0;
  const auto mended = load(core::write_glb(scene));
  ASSERT_TRUE(mended);
  ASSERT_EQ(mended->warnings.size(), 1U);
  EXPECT_EQ(mended->warnings[0].code, "turned");
  EXPECT_EQ(mended->warnings[0].pointer, "/meshes/0/primitives/1");
  core::PrimitiveDescription whole;
  add_cube(whole, 1, 0, false);
  for (std::size_t part = 0; part < 2; ++part) {
    const auto& indices = mended->meshes[0].primitives.at(part).indices;
    EXPECT_TRUE(std::equal(indices.begin(), indices.end(), &whole.indices[part * 24])) << part;
  }
}

TEST(GltfGeometry, SolidsThatTouchStay) {
  core::PrimitiveDescription a;
  core::PrimitiveDescription b;
  add_cube(a, 1, 0, false);
  add_cube(b, 1, 2, false);
  EXPECT_EQ(aligned({&a, &b}), (std::vector<std::size_t>{0, 0}));
}

TEST(GltfGeometry, SurfacesWithOneSideStay) {
  // The triangles (i, i + 1, i + 2) modulo 5 are a Moebius strip.
  core::PrimitiveDescription strip;
  for (int i = 0; i < 5; ++i) {
    const float angle = static_cast<float>(i) * 1.2566F;
    strip.positions.push_back({std::cos(angle), std::sin(angle), static_cast<float>(i % 2)});
  }
  for (std::uint32_t i = 0; i < 5; ++i) {
    strip.indices.insert(strip.indices.end(), {i, (i + 1) % 5, (i + 2) % 5});
  }
  const auto before = strip.indices;
  EXPECT_EQ(aligned({&strip}).at(0), 0);
  EXPECT_EQ(strip.indices, before);
}

TEST(GltfGeometry, ReadsOnlyTheSelectedScene) {
  core::GlbWriter writer;
  add_triangle(writer);
  writer.add("nodes", R"({"mesh":0,"translation":[9,0,0]})");
  writer.add("scenes", R"({"nodes":[0]})");
  writer.add("scenes", R"({"nodes":[1]})");
  writer.set("scene", "1");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->instances.size(), 1U);
  EXPECT_EQ(scene->instances[0].to_world.t.x, 9);
  core::GltfOptions options;
  options.scene_index = 0;
  const auto other = load(writer, options);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->instances.at(0).to_world.t.x, 0);
}

TEST(GltfGeometry, ExternalFilesAndDataUrisGiveTheSameScene) {
  core::GlbWriter writer;
  add_triangle(writer);
  const auto separate = writer.finish_separate("tri angle.bin");
  const auto resolve = [&](std::string_view uri) -> core::SharedBytes {
    return uri == "tri angle.bin" ? std::make_shared<const core::Bytes>(separate.bin) : nullptr;
  };
  const auto scene = load_json(separate.json, resolve);
  EXPECT_EQ(only_primitive(scene).positions.size(), 3U);
  std::string data = "data:application/octet-stream,";
  for (const std::byte b : separate.bin) {
    constexpr const char* kHex = "0123456789ABCDEF";
    const int value = std::to_integer<int>(b);
    data += std::string("%") + kHex[value / 16] + kHex[value % 16];
  }
  EXPECT_EQ(only_primitive(load_json(writer.finish_separate(data).json)).positions.size(), 3U);
}

TEST(GltfGeometry, OrthographicCameraKeepsItsMagnifications) {
  core::GlbWriter writer;
  writer.add("cameras",
             R"({"name":"top","type":"orthographic","orthographic":{"xmag":3,"ymag":2,"znear":0,)"
             R"("zfar":9}})");
  writer.add("nodes", R"({"camera":0})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->cameras.size(), 1U);
  EXPECT_TRUE(scene->cameras[0].orthographic);
  EXPECT_EQ(scene->cameras[0].x_magnification, 3);
  EXPECT_EQ(scene->cameras[0].y_magnification, 2);
  EXPECT_EQ(scene->cameras[0].name, "top");
}

TEST(GltfGeometry, LightsMultiplyColorAndIntensity) {
  core::GlbWriter writer;
  writer.use_extension("KHR_lights_punctual");
  writer.set(
      "extensions",
      R"({"KHR_lights_punctual":{"lights":[{"type":"spot","color":[1,0.5,0.25],"intensity":8,)"
      R"("range":7,)"
      R"("spot":{"innerConeAngle":0.1,"outerConeAngle":0.4}}]}})");
  writer.add("nodes", R"({"extensions":{"KHR_lights_punctual":{"light":0}}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->lights.size(), 1U);
  EXPECT_EQ(scene->lights[0].type, core::PunctualType::kSpot);
  EXPECT_EQ(scene->lights[0].intensity, (core::Rgb{8, 4, 2}));
  EXPECT_EQ(scene->lights[0].range_m, 7);
  EXPECT_FLOAT_EQ(scene->lights[0].outer_cone_rad, 0.4F);
}

}  // namespace
