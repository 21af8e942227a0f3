// The intersection kernel for scenes of a few dozen triangles, against Embree.
#include "core/accel/few_triangles.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/bsdf_cases.h"
#include "tests/support/statistics.h"

namespace {

using core::Ray;
using core::Vec3;

/// Triangles in two meshes, with padding after the vertices as Embree requires.
struct Meshes {
  std::array<std::vector<Vec3>, 2> positions;
  std::array<std::vector<std::uint32_t>, 2> indices;

  std::vector<core::AccelGeometry> geometries() const {
    std::vector<core::AccelGeometry> out;
    for (std::size_t m = 0; m < 2; ++m) {
      out.push_back({std::span(positions[m]).first(positions[m].size() - 2), indices[m]});
    }
    return out;
  }
  void close() {
    for (auto& p : positions) {
      p.resize(p.size() + 2);
    }
  }
};

/// A cube around `at` whose faces are two triangles each; a face may be omitted.
Meshes cube(Vec3 at, int missing = -1) {
  Meshes out;
  for (int i = 0; i < 8; ++i) {
    out.positions[0].push_back(at + Vec3{static_cast<float>(i & 1) - 0.3F,
                                         static_cast<float>(i >> 1 & 1) - 0.7F,
                                         static_cast<float>(i >> 2) - 0.4F});
  }
  constexpr std::array<std::array<std::uint32_t, 4>, 6> kFaces = {
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}};
  for (int f = 0; f < 6; ++f) {
    if (f != missing) {
      const auto& c = kFaces[static_cast<std::size_t>(f)];
      out.indices[0].insert(out.indices[0].end(), {c[0], c[1], c[2], c[0], c[2], c[3]});
    }
  }
  out.positions[1] = {at, at, at};
  out.close();
  return out;
}

/// None is a sliver: each is at least .05 high.
Meshes random_triangles(std::size_t count, test_support::Random& random) {
  Meshes out;
  for (std::size_t t = 0; t < count;) {
    const auto point = [&random] {
      return Vec3{random.uniform(), random.uniform(), random.uniform()};
    };
    const std::array<Vec3, 3> at = {point(), point(), point()};
    const float longest =
        std::max({length(at[1] - at[0]), length(at[2] - at[1]), length(at[0] - at[2])});
    if (length(cross(at[1] - at[0], at[2] - at[0])) < 0.05F * longest) {
      continue;
    }
    auto& mesh = out.positions[t % 2];
    for (const Vec3& corner : at) {
      out.indices[t % 2].push_back(static_cast<std::uint32_t>(mesh.size()));
      mesh.push_back(corner);
    }
    ++t;
  }
  out.close();
  return out;
}

/// A square of this side in the plane z = 0 around the origin, of two triangles.
Meshes square(float side) {
  Meshes out;
  const float half = 0.5F * side;
  out.positions[0] = {{-half, -half, 0}, {half, -half, 0}, {half, half, 0}, {-half, half, 0}};
  out.indices[0] = {0, 1, 2, 0, 2, 3};
  out.positions[1] = {{0, 0, 0}};
  out.close();
  return out;
}

/// A ray in the fourth of eight lanes, others in the rest.
core::RayPacket packet_of(const Ray& ray) {
  core::RayPacket out{};
  for (int k = 0; k < 8; ++k) {
    const Vec3 d = k == 3 ? ray.direction : Vec3{1, static_cast<float>(k), 2};
    out.origin_x[k] = ray.origin.x;
    out.origin_y[k] = ray.origin.y;
    out.origin_z[k] = ray.origin.z;
    out.direction_x[k] = d.x;
    out.direction_y[k] = d.y;
    out.direction_z[k] = d.z;
    out.t_max[k] = ray.t_max;
  }
  return out;
}
bool intersect(const core::FewTriangles& few, const Ray& ray, core::HitPacket& hits) {
  return few.intersect8(packet_of(ray), 1U << 3, hits).value() != 0;
}
bool occluded(const core::FewTriangles& few, const Ray& ray) {
  return few.occluded8(packet_of(ray), 1U << 3).value() != 0;
}

TEST(FewTriangles, FindsTheHitsOfEmbree) {
  test_support::Random random(1);
  int different = 0;
  for (const std::size_t count : {2U, 9U, 33U, 64U}) {
    const Meshes meshes = random_triangles(count, random);
    const auto geometries = meshes.geometries();
    const core::FewTriangles few(geometries);
    ASSERT_FALSE(few.empty());
    const auto embree = core::Accel::build(geometries, {}, {}, 1);
    ASSERT_TRUE(embree);
    for (int i = 0; i < 5000; ++i) {
      Ray ray;
      ray.origin = {random.uniform(), random.uniform(), 2 * random.uniform() - 0.5F};
      ray.direction =
          test_support::random_hemisphere(random) * (random.uniform() < 0.5F ? -1.0F : 1.0F);
      ray.t_max = i % 3 == 0 ? 0.4F : 3.4e38F;
      core::HitPacket a{};
      core::RawHit b;
      const bool met = intersect(few, ray, a);
      if (met != (*embree)->intersect(ray, b) ||
          (met && (a.instance[3] != core::kNoInstance || a.geometry[3] != b.geometry ||
                   a.primitive[3] != b.primitive)) ||
          met != occluded(few, ray)) {
        ++different;
      }
    }
  }
  EXPECT_LE(different, 2);  // rays through an edge, up to rounding
}

/// Compares hits with Embree for rays from the centre of the cube to each point of its faces.
TEST(FewTriangles, HalvesOfParallelogramsKeepTheirIds) {
  test_support::Random random(7);
  Meshes meshes = cube({0, 0, 0});
  meshes.positions[0][7].x += 0.01F;  // three faces are not parallelograms
  const auto geometries = meshes.geometries();
  const core::FewTriangles few(geometries);
  const auto embree = core::Accel::build(geometries, {}, {}, 1);
  ASSERT_TRUE(embree);
  int different = 0;
  for (int i = 0; i < 20'000; ++i) {
    Ray ray;
    ray.direction =
        test_support::random_hemisphere(random) * (random.uniform() < 0.5F ? -1.0F : 1.0F);
    core::HitPacket a{};
    core::RawHit b;
    different += intersect(few, ray, a) && (*embree)->intersect(ray, b) &&
                         a.geometry[3] == b.geometry && a.primitive[3] == b.primitive
                     ? 0
                     : 1;
  }
  EXPECT_LE(different, 2);  // rays through an edge, up to rounding
}

/// Number of rays from inside that leave through an edge or a corner; half of them are parallel to
/// a face.
int escapes(const Meshes& meshes, Vec3 at) {
  test_support::Random random(4);
  const auto geometries = meshes.geometries();
  const core::FewTriangles few(geometries);
  const auto& corners = meshes.positions[0];
  int count = 0;
  for (int i = 0; i < 1'000'000; ++i) {
    const Vec3 a = corners[random.bits() % 8];
    const Vec3 b = corners[random.bits() % 8];
    Ray ray;
    ray.origin = at + Vec3{0.4F * random.uniform() - 0.1F, -0.4F * random.uniform(),
                           0.4F * random.uniform()};
    if (i % 2 == 0) {
      ray.origin.y = at.y + 0.3F - 1e-3F * random.uniform();
    }
    ray.direction = a + (b - a) * random.uniform() - ray.origin;
    core::HitPacket hits;
    count += intersect(few, ray, hits) ? 0 : 1;
    count += occluded(few, ray) ? 0 : 1;
  }
  return count;
}

TEST(FewTriangles, IsWatertightAtEdgesAndCorners) {
  EXPECT_EQ(escapes(cube({0, 0, 0}), {0, 0, 0}), 0);
  EXPECT_EQ(escapes(cube({30, -20, 100}), {30, -20, 100}), 0);
}

// The planted fault.
TEST(FewTriangles, DetectsAMissingFace) { EXPECT_GT(escapes(cube({0, 0, 0}, 2), {0, 0, 0}), 1000); }

TEST(FewTriangles, RefusesMoreThanAFewDozenTriangles) {
  test_support::Random random(2);
  EXPECT_TRUE(core::FewTriangles({}).empty());
  EXPECT_TRUE(core::FewTriangles(random_triangles(65, random).geometries()).empty());
}

TEST(FewTriangles, ShapesKeepTheirSizeFromAnyDistance) {
  // Rays along -z keep their x exactly: within a thousandth of the side, each hits or misses.
  const Meshes meshes = square(0.2F);
  const auto geometries = meshes.geometries();
  const auto accel = core::Accel::build(geometries, {}, {}, 1);
  ASSERT_TRUE(accel);
  for (const float distance : {1.0F, 20.0F, 1e3F, 1e4F, 1e6F}) {
    for (const float x : {0.0998F, 0.1002F}) {
      Ray ray;
      ray.origin = {x, 0.01F, distance};
      ray.direction = {0, 0, -1};
      core::HitPacket hits;
      const bool is_inside = x < 0.1F;
      EXPECT_EQ((*accel)->intersect8(packet_of(ray), 1U << 3, hits) != 0, is_inside) << distance;
      EXPECT_EQ((*accel)->occluded8(packet_of(ray), 1U << 3) != 0, is_inside) << distance;
    }
  }
}

TEST(FewTriangles, LeavesSliversToTheTree) {
  Meshes strip = square(1);
  for (const std::size_t corner : {2U, 3U}) {
    strip.positions[0][corner].y = -0.495F;
  }
  EXPECT_FALSE(core::FewTriangles(square(1).geometries()).empty());
  EXPECT_TRUE(core::FewTriangles(strip.geometries()).empty());
}

TEST(FewTriangles, NonFiniteRaysHitNothing) {
  const Meshes meshes = cube({0, 0, 0});
  const core::FewTriangles few(meshes.geometries());
  Ray ray;
  ray.direction = {0, __builtin_nanf(""), 1};
  core::HitPacket hits;
  EXPECT_FALSE(intersect(few, ray, hits));
  EXPECT_FALSE(occluded(few, ray));
}

}  // namespace
