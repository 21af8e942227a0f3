// Facets from which rays leave as from the smooth surface: a ball, alone and instanced, with
// something against it or not.
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/isolated_instances.h"
#include "tests/support/scenes.h"

namespace {

using core::SceneDescription;
using core::Transform;
using core::Vec3;

/// Balls of radius 1 with averaged normals.
SceneDescription balls(const std::vector<Transform>& places) {
  SceneDescription scene = test_support::scene_of({test_support::lambert(core::Rgb(0.5F))},
                                                  {test_support::sphere({}, 1, 12, false, 0)});
  scene.instances.clear();
  for (const Transform& place : places) {
    scene.instances.push_back({0, place});
  }
  return scene;
}

/// Of the facets of mesh 0 whose middle is within 30 degrees of a direction: how many, and how many
/// are round in front.
struct Count {
  int all = 0;
  int round = 0;
};
Count towards(const core::SceneData& scene, Vec3 direction) {
  Count out;
  const core::MeshData& mesh = scene.meshes[0];
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    Vec3 middle;
    for (std::size_t k = 0; k < 3; ++k) {
      middle = middle + mesh.positions[mesh.indices[3 * std::size_t{t} + k]];
    }
    if (dot(normalize_or(middle, {}), direction) > 0.866F) {
      ++out.all;
      out.round += mesh.is_round(t, true) ? 1 : 0;
    }
  }
  return out;
}

TEST(RoundFacets, AreTheSameForOneBallAndForInstancesApart) {
  const Transform squeezed = core::translation({0, 0, 20}) * core::scaling({1, 0.8F, 1});
  for (const auto& places : {std::vector<Transform>{{}},
                             {{}, core::translation({10, 0, 0}) * core::scaling({2, 2, 2})},
                             {{}, core::translation({10, 0, 0}), squeezed}}) {
    const auto scene = test_support::build(balls(places));
    for (const Vec3 direction : {Vec3{1, 0, 0}, Vec3{0, 0, 1}, Vec3{0, 0.8F, 0.6F}}) {
      const Count count = towards(scene->data(), direction);
      EXPECT_GT(count.all, 4);
      EXPECT_EQ(count.round, count.all) << places.size() << " balls";
    }
  }
}

TEST(RoundFacets, AreNoneWhereOneInstanceTouchesAnother) {
  // The first ball is apart: only its own triangles are near it.
  const auto scene = test_support::build(
      balls({core::translation({-10, 0, 0}), {}, core::translation({1.99F, 0, 0})}));
  for (const float side : {-1.0F, 1.0F}) {
    const Count count = towards(scene->data(), {side, 0, 0});
    EXPECT_LT(count.round, count.all) << side;
  }
  const Count count = towards(scene->data(), {0, 0, 1});
  EXPECT_EQ(count.round, count.all);
}

TEST(RoundFacets, OfMirroredInstancesAreThoseOfTheMesh) {
  const auto scene =
      test_support::build(balls({core::translation({-10, 0, 0}), core::scaling({-1, 1, 1}),
                                 core::translation({1.99F, 0, 0}) * core::scaling({-1, 1, 1})}));
  // The mirrored balls touch at the mesh's -x and +x.
  for (const float side : {-1.0F, 1.0F}) {
    const Count count = towards(scene->data(), {side, 0, 0});
    EXPECT_LT(count.round, count.all) << side;
  }
  const Count count = towards(scene->data(), {0, 0, 1});
  EXPECT_EQ(count.round, count.all);
}

TEST(RoundFacets, OfCopiesDoNotDependOnTheOrderOfInstances) {
  // A shelf 1 mm above the ball belongs to the same instance. Far from the origin it is lost in the
  // rounding of coordinates, and the facets below it look free.
  const auto rounds = [](const std::vector<Transform>& places) {
    SceneDescription scene = balls(places);
    scene.meshes[0].primitives.push_back(
        test_support::quad({-0.2F, 1.001F, 0.2F}, {0.4F, 0, 0}, {0, 0, -0.4F}, 0));
    return towards(test_support::build(std::move(scene))->data(), {0, 1, 0}).round;
  };
  const Transform far = core::translation({12000, 0, 0});
  const int near = rounds({{}, core::translation({0, 50, 0})});
  ASSERT_GT(rounds({far, core::translation({12000, 50, 0})}), near);
  EXPECT_EQ(rounds({{}, far}), near);
  EXPECT_EQ(rounds({far, {}}), near);
}

TEST(RoundFacets, AreNoneWhereAMeshStandsOnAnInstance) {
  SceneDescription scene = balls({{}, core::translation({10, 0, 0})});
  scene.meshes.push_back({"shelf", {test_support::quad({9, 1, 1}, {2, 0, 0}, {0, 0, -2}, 0)}});
  scene.instances.push_back({1, {}});
  const auto built = test_support::build(std::move(scene));
  const core::SceneData& data = built->data();
  std::size_t ball = 0;
  while (data.meshes[ball].in_world_space) {
    ++ball;
  }
  ASSERT_FALSE(data.meshes[ball].round_sides.empty());
  int flat = 0;
  const core::MeshData& mesh = data.meshes[ball];
  for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
    flat += mesh.is_round(t, true) ? 0 : 1;
  }
  EXPECT_GT(flat, 0) << "below the shelf";
  EXPECT_LT(flat, static_cast<int>(mesh.triangle_count()) / 4);
}

TEST(IsolatedInstances, LookAsFarAsAShearStretches) {
  // Rotated by 45 degrees, then stretched tenfold along x: edges of .26 m become 2.6 m, although no
  // axis is longer than 7.1 m.
  const float c = std::sqrt(0.5F);
  Transform sheared;
  sheared.x = {10 * c, c, 0};
  sheared.y = {-10 * c, c, 0};
  Transform beside;
  beside.t = {10 + 1 + 2.2F, 0, 0};
  const auto scene = test_support::build(balls({sheared, beside}));
  EXPECT_EQ(core::find_isolated_instances(scene->data(), 1, {}), (std::vector<bool>{false, false}));
}

TEST(IsolatedInstances, HaveNothingWithinTheirLongestEdges) {
  // The longest edge of the ball is at its equator: 2 sin(7.5 degrees) = .26 or more.
  const auto scene = test_support::build(
      balls({{},
             core::translation({2.2F, 0, 0}),
             core::translation({0, 0, 4}),
             core::translation({0, 5, 0}) * core::scaling({0.5F, 0.5F, 0.5F})}));
  EXPECT_EQ(core::find_isolated_instances(scene->data(), 1, {}),
            (std::vector<bool>{false, false, true, true}));
  EXPECT_EQ(core::find_isolated_instances(scene->data(), 0, {}),
            (std::vector<bool>{true, true, true, true}));
  EXPECT_EQ(core::find_isolated_instances(scene->data(), 20, {}),
            (std::vector<bool>{false, false, false, false}));
}

}  // namespace
