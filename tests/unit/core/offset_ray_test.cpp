// Steps off surfaces (core/math/offset_ray.h): long enough for the intersectors at any size and
// place, and no longer than rounding demands.
#include "core/math/offset_ray.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/scene/scene_data.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Ray;
using core::Vec3;
using test_support::Random;

constexpr int kTriangles = 400;
constexpr int kRays = 20;

Vec3 random_direction(Random& random) {
  return test_support::random_hemisphere(random) * (random.uniform() < 0.5F ? -1.0F : 1.0F);
}

core::PrimitiveDescription triangle(Vec3 a, Vec3 b, Vec3 c) {
  core::PrimitiveDescription p;
  p.positions = {a, b, c};
  p.indices = {0, 1, 2};
  return p;
}

/// A triangle of about the given size, up to 30 or 1000 sizes from the origin; every other one is
/// a sliver of a twentieth of its length.
core::PrimitiveDescription random_triangle(Random& random, float size, float away) {
  const Vec3 at = random_direction(random) * (away * random.uniform());
  const Vec3 a = at + random_direction(random);
  const Vec3 b = at + random_direction(random);
  Vec3 c = at + random_direction(random);
  if (random.uniform() < 0.5F) {
    c = (a + b) * 0.5F + random_direction(random) * 0.05F;
  }
  return triangle(a * size, b * size, c * size);
}

core::Transform random_transform(Random& random, float away) {
  const auto stretched = [&] { return std::exp(static_cast<float>(random.normal())); };
  const Vec3 x = random_direction(random);
  const Vec3 y = core::normalize(core::cross(x, random_direction(random)));
  return {x * stretched(), y * stretched(), core::cross(x, y) * stretched(),
          random_direction(random) * away};
}

struct Seen {
  int rays = 0;
  int self_hits = 0;   ///< of rays that leave the triangle
  int light_hits = 0;  ///< of rays that end off it
  double longest = 0;  ///< step over the point's largest coordinate plus the longest edge
};

/// step: factor of the offsets, 1 as in the renderer.
void add(Seen& seen, const core::Scene& scene, Random& random, float step) {
  const core::SceneData& data = scene.data();
  const core::Bounds box = scene.summary().bounds;
  for (int i = 0; i < kRays; ++i) {
    Ray ray;
    const core::PlacedMesh& placed = data.placed.front();
    const core::MeshData& mesh = data.meshes[placed.mesh];
    const auto corner = [&](std::size_t k) {
      const Vec3 p = mesh.positions[mesh.indices[k]];
      return data.instances.empty() ? p : data.instances.front().to_world.point(p);
    };
    float b1 = random.uniform();
    float b2 = random.uniform();
    if (b1 + b2 > 1) {
      b1 = 1 - b1;
      b2 = 1 - b2;
    }
    const Vec3 target = corner(0) * (1 - b1 - b2) + corner(1) * b1 + corner(2) * b2;
    ray.direction = random_direction(random);
    ray.origin = target - ray.direction * core::length(box.diagonal());
    core::RawHit hit;
    hit.instance = data.instances.empty() ? core::kNoInstance : 0;
    const core::SurfacePoint point = data.surface_point(hit, ray);
    Vec3 out = random_direction(random);
    // Down to a ten-thousandth above the horizon.
    const Vec3 n = point.normal_geometric;
    const float cosine = std::pow(10.0F, -4 * random.uniform());
    out = core::normalize(out - n * core::dot(out, n));
    const float side = random.uniform() < 0.5F ? -1.0F : 1.0F;
    out = out * std::sqrt(1 - cosine * cosine) + n * (side * cosine);
    Ray away;
    away.origin = core::offset_ray(point.position, n * side, step * point.error_m);
    away.direction = out;
    core::RawHit met;
    const auto hits = [&](const Ray& r) {
      core::RayPacket packet{};
      for (int k = 0; k < 8; ++k) {
        packet.origin_x[k] = r.origin.x;
        packet.origin_y[k] = r.origin.y;
        packet.origin_z[k] = r.origin.z;
        packet.direction_x[k] = r.direction.x;
        packet.direction_y[k] = r.direction.y;
        packet.direction_z[k] = r.direction.z;
        packet.t_max[k] = r.t_max;
      }
      return data.accel->occluded(r) || data.accel->occluded8(packet, 0xff) != 0;
    };
    const float far = core::length(box.diagonal()) * std::pow(10.0F, 3 * random.uniform() - 1);
    Ray light;
    light.origin = away.origin + out * far;
    light.direction =
        core::offset_ray(point.position, n * side, step * core::plane_error_m(point.error_m, far)) -
        light.origin;
    light.t_max = 1;
    ++seen.rays;
    seen.self_hits += hits(away) ? 1 : 0;
    seen.light_hits += hits(light) ? 1 : 0;
    const float coordinate = std::max(
        {std::fabs(point.position.x), std::fabs(point.position.y), std::fabs(point.position.z)});
    seen.longest =
        std::max(seen.longest,
                 static_cast<double>(point.error_m / (coordinate + core::length(box.diagonal()))));
  }
}

Seen alone(float size, float away, float step) {
  Random random(3);
  Seen seen;
  for (int i = 0; i < kTriangles; ++i) {
    const auto scene = test_support::build(test_support::scene_of(
        {test_support::lambert({1, 1, 1})}, {random_triangle(random, size, away)}));
    add(seen, *scene, random, step);
  }
  return seen;
}

/// Twice in the scene, so that both are instances; rays start at the first.
Seen instanced(float size, float away, float step) {
  Random random(4);
  Seen seen;
  for (int i = 0; i < kTriangles; ++i) {
    core::SceneDescription scene = test_support::scene_of({test_support::lambert({1, 1, 1})},
                                                          {random_triangle(random, size, 2)});
    scene.instances[0].to_world = random_transform(random, away * size);
    scene.instances.push_back(scene.instances[0]);
    scene.instances[1].to_world.t = scene.instances[0].to_world.t + Vec3{1e4F, 0, 0} * size;
    add(seen, *test_support::build(std::move(scene)), random, step);
  }
  return seen;
}

constexpr float kSizes[] = {1e-6F, 1e-3F, 1, 555, 1e6F};

TEST(OffsetRay, RaysDoNotHitTheTriangleThatTheyLeaveOrEndAt) {
  for (const float size : kSizes) {
    for (const float away : {0.0F, 30.0F, 1000.0F}) {
      const Seen seen = alone(size, away, 1);
      EXPECT_EQ(seen.self_hits, 0) << size << " " << away;
      // The end of a ray is as inexact as its length: few of those that graze from afar.
      EXPECT_LE(seen.light_hits, seen.rays / 1000) << size << " " << away;
    }
  }
}

TEST(OffsetRay, NorThatOfAnInstance) {
  for (const float size : kSizes) {
    for (const float away : {0.0F, 100.0F}) {
      const Seen seen = instanced(size, away, 1);
      EXPECT_EQ(seen.self_hits, 0) << size << " " << away;
      // The end of a ray is as inexact as its length: few of those that graze from afar.
      EXPECT_LE(seen.light_hits, seen.rays / 1000) << size << " " << away;
    }
  }
}

// The planted fault.
TEST(OffsetRay, ASixteenthOfTheStepIsTooShort) {
  for (const float size : kSizes) {
    EXPECT_GT(alone(size, 30, 0.0625F).self_hits, 100) << size;
    EXPECT_GT(alone(size, 30, 0.0625F).light_hits, 100) << size;
  }
}

TEST(OffsetRay, TheStepIsAFewRoundings) {
  // 6 roundings of 2^-24 of the taxicab lengths of point (3 coordinates) and two edges (sqrt(3)
  // times their lengths each), which thin triangles lengthen at most 9 times.
  constexpr double kMost = 6 * 0x1p-24 * (3 + 2 * 1.7321 * 9);
  for (const float size : kSizes) {
    EXPECT_LT(alone(size, 30, 1).longest, kMost) << size;
  }
}

}  // namespace
