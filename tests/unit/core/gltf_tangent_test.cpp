#include <cmath>

#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/tangent_space.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using core::PrimitiveDescription;
using core::Vec3;
using core::Vec4;

Vec3 xyz(Vec4 v) { return {v.x, v.y, v.z}; }

// A square in the plane z = 0 with an upright texture.
PrimitiveDescription square() { return core::quad({0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}); }

TEST(TangentSpace, UprightTextureHasItsTangentToTheRightAndItsBitangentUp) {
  PrimitiveDescription p = square();
  core::make_tangents(p, 0);
  ASSERT_EQ(p.tangents.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(p.tangents[i].x, 1, 1e-6);
    const Vec3 bitangent = core::cross(p.normals[i], xyz(p.tangents[i])) * p.tangents[i].w;
    EXPECT_NEAR(bitangent.y, 1, 1e-6);  // v decreases upwards
  }
}

TEST(TangentSpace, MirroredTextureReversesTheTangentAndTheSign) {
  PrimitiveDescription p = square();
  p.uv[0] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};
  core::make_tangents(p, 0);
  EXPECT_NEAR(p.tangents.at(0).x, -1, 1e-6);
  EXPECT_EQ(p.tangents.at(0).w, -1);
}

TEST(TangentSpace, SeamOfAMirrorSplitsItsVertices) {
  // Two adjacent squares that show a texture and its mirror image: the shared edge agrees in
  // position, normal and uv, but not in handedness.
  PrimitiveDescription p;
  p.positions = {{-1, 0, 0}, {0, 0, 0}, {0, 1, 0}, {-1, 1, 0}, {1, 0, 0}, {1, 1, 0}};
  p.normals.assign(6, {0, 0, 1});
  p.uv[0] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}, {0, 1}, {0, 0}};
  p.indices = {0, 1, 2, 0, 2, 3, 1, 4, 5, 1, 5, 2};
  core::make_tangents(p, 0);
  EXPECT_EQ(p.positions.size(), 8U);
  for (std::size_t c = 0; c < p.indices.size(); ++c) {
    EXPECT_EQ(p.tangents[p.indices[c]].w, c < 6 ? 1 : -1) << c;
  }
}

TEST(TangentSpace, TangentsOfASphereFollowItsParallels) {
  PrimitiveDescription p = core::sphere(1, 64);
  core::make_tangents(p, 0);
  for (std::size_t i = 0; i < p.positions.size(); ++i) {
    const Vec3 n = p.normals[i];
    if (std::abs(n.y) > 0.9F) {
      continue;
    }
    const Vec3 east = core::normalize(Vec3{-n.z, 0, n.x});
    EXPECT_GT(core::dot(east, xyz(p.tangents[i])), 0.999F);
    EXPECT_NEAR(core::dot(n, xyz(p.tangents[i])), 0, 1e-5);
    EXPECT_NEAR(core::length(xyz(p.tangents[i])), 1, 1e-5);
  }
}

TEST(TangentSpace, AverageIsWeightedByTheAngle) {
  // Around the origin: a face of 90 degrees whose u increases along x, and one of 45 degrees whose
  // u increases along (1, 1): their texture coordinates agree on the common edge.
  PrimitiveDescription p;
  p.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {-1, 1, 0}};
  p.normals.assign(4, {0, 0, 1});
  p.uv[0] = {{0, 0}, {1, 0}, {0, -1}, {0, 0}};
  p.uv[0][3] = {-1, -2};
  p.indices = {0, 1, 2, 0, 2, 3};
  core::make_tangents(p, 0);
  // dP/du = (d1 * -2 + d2) / (t1.u t2.v - t1.v t2.u) = (-1, -1) / -1 = (1, 1).
  const float wide = 1.5707963F;
  const float narrow = 0.78539816F;
  const float half = std::sqrt(0.5F);
  const Vec3 expected = core::normalize(Vec3{wide + narrow * half, narrow * half, 0});
  EXPECT_NEAR(p.tangents.at(p.indices[0]).x, expected.x, 1e-5);
  EXPECT_NEAR(p.tangents.at(p.indices[0]).y, expected.y, 1e-5);
}

TEST(TangentSpace, FlatPrimitiveGetsNormalsAndSeparateVertices) {
  PrimitiveDescription p = square();
  p.normals.clear();
  core::make_tangents(p, 0);
  ASSERT_EQ(p.normals.size(), p.positions.size());
  EXPECT_EQ(p.normals[0], (Vec3{0, 0, 1}));
}

TEST(TangentSpace, TriangleWithoutTextureAreaGetsAValidTangent) {
  PrimitiveDescription p = square();
  p.uv[0].assign(4, {0.5F, 0.5F});
  core::make_tangents(p, 0);
  ASSERT_EQ(p.tangents.size(), p.positions.size());
  for (const Vec4& t : p.tangents) {
    EXPECT_NEAR(core::length(xyz(t)), 1, 1e-5);
    EXPECT_EQ(std::abs(t.w), 1);
  }
}

TEST(TangentSpace, DegenerateTriangleUsesTheTangentOfItsNeighbour) {
  PrimitiveDescription p = square();
  p.indices.insert(p.indices.end(), {0, 1, 1});
  core::make_tangents(p, 0);
  EXPECT_EQ(p.positions.size(), 4U);
}

TEST(TangentSpace, HasNoEffectWithoutTextureCoordinates) {
  PrimitiveDescription p = square();
  p.uv[0].clear();
  core::make_tangents(p, 0);
  EXPECT_TRUE(p.tangents.empty());
}

}  // namespace
