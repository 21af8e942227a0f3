#include <cmath>
#include <optional>

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::Vec3;

// A triangle whose only morph target moves it by 2 along z.
void add_morphing_triangle(core::GlbWriter& writer, const std::string& mesh_weights) {
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  const int lift = accessor(writer, std::vector<float>{0, 0, 2, 0, 0, 2, 0, 0, 2}, kF32, "VEC3", 3);
  writer.add("meshes", "{\"primitives\":[{\"attributes\":{\"POSITION\":" + number(positions) +
                           "},\"targets\":[{\"POSITION\":" + number(lift) + "}]}]" +
                           (mesh_weights.empty() ? "" : ",\"weights\":" + mesh_weights) + "}");
}

TEST(GltfMorph, UsesMeshWeights) {
  core::GlbWriter writer;
  add_morphing_triangle(writer, "[0.5]");
  writer.add("nodes", R"({"mesh":0})");
  EXPECT_EQ(only_primitive(load(writer)).positions.at(0).z, 1);
}

TEST(GltfMorph, NodeWeightsReplaceThoseOfTheMesh) {
  core::GlbWriter writer;
  add_morphing_triangle(writer, "[0.5]");
  writer.add("nodes", R"({"mesh":0,"weights":[1]})");
  EXPECT_EQ(only_primitive(load(writer)).positions.at(0).z, 2);
}

TEST(GltfMorph, EqualWeightsShareAMesh) {
  core::GlbWriter writer;
  add_morphing_triangle(writer, "");
  writer.add("nodes", R"({"mesh":0,"weights":[1]})");
  writer.add("nodes", R"({"mesh":0,"weights":[1]})");
  writer.add("nodes", R"({"mesh":0,"weights":[0.25]})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->meshes.size(), 2U);
  EXPECT_EQ(scene->instances.size(), 3U);
}

/// Adds the triangle, skinned by skin 0. joints: an accessor; weights: four of each vertex.
void add_skinned_triangle(core::GlbWriter& writer, int joints, const std::vector<float>& weights,
                          const std::string& node = "") {
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(writer,
                "\"attributes\":{\"POSITION\":" + number(positions) +
                    ",\"JOINTS_0\":" + number(joints) +
                    ",\"WEIGHTS_0\":" + number(accessor(writer, weights, kF32, "VEC4", 4)) + "}",
                "\"skin\":0" + node);
}

TEST(GltfSkin, VerticesFollowTheirJoints) {
  core::GlbWriter writer;
  const int joints = accessor(writer, std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0},
                              kU8, "VEC4", 4);
  std::vector<float> matrices(32, 0.0F);
  for (const std::size_t m : {0U, 16U}) {
    matrices[m] = matrices[m + 5] = matrices[m + 10] = matrices[m + 15] = 1;
  }
  matrices[16 + 12] = -1;  // the second joint is at x = 1 at rest
  const int bind = accessor(writer, matrices, kF32, "MAT4", 16);
  // Node 0 has the mesh and is far away, which a skin ignores; the joints are nodes 1 and 2.
  add_skinned_triangle(writer, joints, {1, 0, 0, 0, 1, 0, 0, 0, 0.5F, 0.5F, 0, 0},
                       ",\"translation\":[100,0,0]");
  writer.add("nodes", R"({"translation":[0,0,10]})");
  writer.add("nodes", R"({"translation":[1,0,20]})");
  writer.add("skins", "{\"joints\":[1,2],\"inverseBindMatrices\":" + number(bind) + "}");
  const auto p = only_primitive(load(writer));
  ASSERT_EQ(p.positions.size(), 3U);
  EXPECT_EQ(p.positions[0], (Vec3{0, 0, 10}));
  EXPECT_EQ(p.positions[1], (Vec3{1, 0, 20}));
  EXPECT_EQ(p.positions[2], (Vec3{0, 1, 15}));
}

TEST(GltfSkin, VerticesWithoutWeightFollowTheFirstJointWithAWarning) {
  core::GlbWriter writer;
  const int joints = accessor(writer, std::vector<std::uint8_t>{1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0},
                              kU8, "VEC4", 4);
  add_skinned_triangle(writer, joints, {0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0});
  writer.add("nodes", R"({"translation":[0,0,10]})");
  writer.add("nodes", R"({"translation":[0,0,20]})");
  writer.add("skins", R"({"joints":[1,2]})");
  const auto scene = load(writer);
  const auto p = only_primitive(scene);
  EXPECT_EQ(p.positions.at(0).z, 10);
  EXPECT_EQ(p.positions.at(1).z, 20);
  ASSERT_EQ(scene->warnings.size(), 1U);
  EXPECT_EQ(scene->warnings[0].text(),
            "/meshes/0/primitives/0/attributes/WEIGHTS_0: 2 vertices have only weights of 0; they "
            "follow the skin's first joint");
}

// Two keys, at 1 s and 3 s, on the translation of the triangle's node.
core::Bytes animated(const char* interpolation, const std::vector<float>& values) {
  core::GlbWriter writer;
  add_triangle(writer);
  const int times = accessor(writer, std::vector<float>{1, 3}, kF32, "SCALAR", 1);
  const int output = accessor(writer, values, kF32, "VEC3", 3);
  writer.add(
      "animations",
      "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" + number(output) +
          ",\"interpolation\":\"" + interpolation +
          "\"}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"translation\"}}]}");
  return writer.finish();
}

float x_at(const core::Bytes& file, std::optional<double> time) {
  core::GltfOptions options;
  options.time_seconds = time;
  const auto scene = load(file, options);
  return scene && !scene->instances.empty() ? scene->instances[0].to_world.t.x : NAN;
}

TEST(GltfAnimation, InterpolatesLinearly) {
  const core::Bytes file = animated("LINEAR", {10, 0, 0, 20, 0, 0});
  EXPECT_FLOAT_EQ(x_at(file, 1.5), 12.5F);
}

TEST(GltfAnimation, HoldsTheEndValues) {
  const core::Bytes file = animated("LINEAR", {10, 0, 0, 20, 0, 0});
  EXPECT_EQ(x_at(file, 0), 10);
  EXPECT_EQ(x_at(file, 99), 20);
}

TEST(GltfAnimation, KeepsThePoseOfTheFileWithoutATime) {
  EXPECT_EQ(x_at(animated("LINEAR", {10, 0, 0, 20, 0, 0}), std::nullopt), 0);
}

TEST(GltfAnimation, StepJumpsAtTheKey) {
  const core::Bytes file = animated("STEP", {10, 0, 0, 20, 0, 0});
  EXPECT_EQ(x_at(file, 2.999), 10);
  EXPECT_EQ(x_at(file, 3), 20);
}

TEST(GltfAnimation, CubicSplineFollowsTheFormulaOfTheSpecification) {
  // In-tangent, value, out-tangent. v0 = 10, b0 = 4, v1 = 20, a1 = -2, td = 2, t = 1/4:
  // (2t^3 - 3t^2 + 1) 10 + 2 (t^3 - 2t^2 + t) 4 + (-2t^3 + 3t^2) 20 + 2 (t^3 - t^2) (-2)
  // = .84375 * 10 + .140625 * 8 + .15625 * 20 + (-.046875) * (-4) = 12.875.
  const core::Bytes file =
      animated("CUBICSPLINE", {0, 0, 0, 10, 0, 0, 4, 0, 0, -2, 0, 0, 20, 0, 0, 0, 0, 0});
  EXPECT_FLOAT_EQ(x_at(file, 1.5), 12.875F);
}

TEST(GltfAnimation, RotationsTakeTheShorterArc) {
  core::GlbWriter writer;
  add_triangle(writer);
  const int times = accessor(writer, std::vector<float>{0, 1}, kF32, "SCALAR", 1);
  // From no rotation to a quarter turn about z, written with the opposite sign.
  const float s = std::sqrt(0.5F);
  const int output =
      accessor(writer, std::vector<float>{0, 0, 0, 1, 0, 0, -s, -s}, kF32, "VEC4", 4);
  writer.add(
      "animations",
      "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" + number(output) +
          "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"rotation\"}}]}");
  core::GltfOptions options;
  options.time_seconds = 0.5;
  const auto scene = load(writer, options);
  ASSERT_TRUE(scene);
  const Vec3 x_axis = scene->instances.at(0).to_world.x;  // an eighth of a turn
  EXPECT_NEAR(x_axis.x, s, 1e-6);
  EXPECT_NEAR(x_axis.y, s, 1e-6);
}

TEST(GltfAnimation, AnimatesMorphWeights) {
  core::GlbWriter writer;
  add_morphing_triangle(writer, "[0]");
  writer.add("nodes", R"({"mesh":0})");
  const int times = accessor(writer, std::vector<float>{0, 1}, kF32, "SCALAR", 1);
  const int output = accessor(writer, std::vector<float>{0, 1}, kF32, "SCALAR", 1);
  writer.add("animations",
             "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" + number(output) +
                 "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"weights\"}}]}");
  core::GltfOptions options;
  options.time_seconds = 0.5;
  EXPECT_FLOAT_EQ(only_primitive(load(writer, options)).positions.at(0).z, 1);
}

TEST(GltfAnimation, IgnoresASecondAnimationOfTheSameNode) {
  core::GlbWriter writer;
  add_triangle(writer);
  const int times = accessor(writer, std::vector<float>{0}, kF32, "SCALAR", 1);
  for (const float x : {5.0F, 6.0F}) {
    const int output = accessor(writer, std::vector<float>{x, 0, 0}, kF32, "VEC3", 3);
    writer.add(
        "animations",
        "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" + number(output) +
            "}],\"channels\":[{\"sampler\":0,\"target\":{\"node\":0,\"path\":\"translation\"}}]}");
  }
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->instances.at(0).to_world.t.x, 5);
  EXPECT_EQ(scene->warnings.size(), 1U);
}

}  // namespace
