// Triangles of solids with which no other surface coincides: paths do not look for others there.
#include "core/scene/single_faces.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/offset_ray.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Vec3;
using test_support::box;

core::MaterialDescription glass() {
  core::MaterialDescription m;
  m.transmission = 1;
  m.thickness = 1;
  return m;
}

std::shared_ptr<const core::Scene> scene_of(std::vector<core::PrimitiveDescription> solids) {
  core::SceneDescription scene;
  scene.materials = {test_support::lambert({0.5F, 0.5F, 0.5F}), glass()};
  solids.push_back(test_support::quad({-3, 0, -3}, {0, 0, 6}, {6, 0, 0}, 0));
  for (std::size_t i = 0; i < solids.size(); ++i) {
    solids[i].material = i + 1 < solids.size() ? 1 : 0;
    scene.meshes.emplace_back();
    scene.meshes.back().primitives = {solids[i]};
    scene.instances.push_back({static_cast<int>(i), {}});
  }
  return test_support::build(std::move(scene));
}

struct Counts {
  int hits = 0;
  int single = 0;
  int wrong = 0;  ///< single, but another surface is within the reach of rounding
};

/// Random rays in a scene of solids.
Counts count(const core::SceneData& scene) {
  Counts out;
  test_support::Random random(1);
  const auto anywhere = [&] {
    return Vec3{3 * random.uniform() - 1.5F, 1.5F * random.uniform(), 3 * random.uniform() - 1.5F};
  };
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 from = anywhere();
    const core::Ray ray = {from, core::normalize_or(anywhere() - from, {0, 1, 0})};
    core::RawHit hit;
    if (!scene.accel->intersect(ray, hit) || scene.solid_of(hit) == nullptr) {
      continue;
    }
    ++out.hits;
    const core::SurfacePoint point = scene.surface_point(hit, ray);
    if (!scene.is_single_face(hit, point.position)) {
      continue;
    }
    ++out.single;
    const float reach_m =
        point.error_m + core::kPlaneError * (taxicab(point.position) + 4 * scene.radius_m);
    const Vec3 step = point.normal_geometric * reach_m;
    const core::Ray probe = {.origin = point.position - step, .direction = step * 2, .t_max = 1};
    struct Seen {
      const core::RawHit& own;
      int others = 0;
    } seen{hit};
    scene.accel->each_hit(
        probe,
        [](void* to, const core::RawHit& at) {
          auto& self = *static_cast<Seen*>(to);
          self.others +=
              at.geometry == self.own.geometry && at.primitive == self.own.primitive ? 0 : 1;
        },
        &seen);
    out.wrong += seen.others > 0 ? 1 : 0;
  }
  return out;
}

TEST(SingleFaces, HaveNoOtherSurfaceWithinReach) {
  const auto scene = scene_of({test_support::sphere({-0.7F, 0.4F, 0}, 0.4F, 8, false, 1),
                               test_support::sphere({-0.5F, 0.5F, 0}, 0.3F, 8, false, 1),
                               box({0.6F, 0.3F, 0}, {0.2F, 0.3F, 0.2F}, 0),
                               box({1, 0.3F, 0}, {0.2F, 0.2F, 0.2F}, 0),
                               box({0, 0.7F, 0.8F}, {0.3F, 0.4F, 0.2F}, 0.4F)});
  const Counts counts = count(scene->data());
  EXPECT_GT(counts.single, counts.hits / 2);
  EXPECT_EQ(counts.wrong, 0);
}

TEST(SingleFaces, AreAllOfABallAndABoxThatStandAlone) {
  const auto scene = scene_of({test_support::sphere({-0.7F, 0.6F, 0}, 0.4F, 8, false, 1),
                               box({0.6F, 0.6F, 0}, {0.2F, 0.3F, 0.2F}, 0.4F)});
  for (const core::NearPlanes& near : scene->data().near_planes) {
    EXPECT_TRUE(near.planes.empty());
  }
}

/// Two boxes that share a face, on the floor.
TEST(SingleFaces, AreNotThoseThatTouchOthers) {
  const auto scene = scene_of(
      {box({-0.2F, 0.2F, 0}, {0.2F, 0.2F, 0.2F}, 0), box({0.2F, 0.2F, 0}, {0.2F, 0.2F, 0.2F}, 0)});
  const core::SceneData& data = scene->data();
  for (std::uint32_t solid = 0; solid < 2; ++solid) {
    for (std::uint32_t i = 0; i < 12; ++i) {
      const auto p = data.corners({0, core::kNoInstance, solid, i});
      const auto all_at = [&](float Vec3::*axis) {
        return p[0].*axis == 0 && p[1].*axis == 0 && p[2].*axis == 0;
      };
      const auto& first = data.near_planes[solid].first;
      EXPECT_EQ(first[i] == first[i + 1], !all_at(&Vec3::x) && !all_at(&Vec3::y)) << i;
    }
  }
}

}  // namespace
