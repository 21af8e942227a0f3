// Solids of a scene: which triangles bound them, their order, the points within, warnings.
#include "core/scene/solids.h"

#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/closed_surface.h"
#include "core/scene/scene_data.h"
#include "tests/support/scenes.h"

namespace {

using core::MaterialDescription;
using core::MediumStack;
using core::Rgb;
using core::Solid;
using core::SolidFace;
using core::SolidKind;
using core::Vec3;

MaterialDescription glass(int priority = 0) {
  MaterialDescription m;
  m.name = "glass";
  m.transmission = 1;
  m.thickness = 1;
  m.priority = priority;
  return m;
}

std::shared_ptr<const core::Scene> balls(std::vector<MaterialDescription> materials,
                                         const std::vector<float>& radii) {
  std::vector<core::PrimitiveDescription> parts;
  for (std::size_t i = 0; i < radii.size(); ++i) {
    parts.push_back(test_support::sphere({0, 0, 0}, radii[i], 8, false, static_cast<int>(i)));
  }
  return test_support::build(test_support::scene_of(std::move(materials), std::move(parts)));
}

TEST(MediumStack, TheHighestRankOwnsTheSpaceInWhateverOrderItIsEntered) {
  Solid low;
  Solid high;
  high.rank = 1;
  for (const bool turned : {false, true}) {
    MediumStack media;
    media.enter(turned ? low : high);
    media.enter(turned ? high : low);
    EXPECT_EQ(media.top(), &high);
    media.leave(high);
    EXPECT_EQ(media.top(), &low);
    media.leave(low);
    EXPECT_TRUE(media.empty());
  }
}

TEST(MediumStack, AnExitWithoutAnEntryEndsOnlyWhatItCanEnd) {
  Solid closed;
  Solid open_front;
  Solid open_back;
  Solid cavity;
  open_front.kind = open_back.kind = SolidKind::kOpen;
  cavity.kind = SolidKind::kCavity;
  MediumStack media;
  media.enter(closed);
  media.enter(open_front);
  media.leave(open_back);
  EXPECT_FALSE(media.holds(open_front)) << "two sides of one solid";
  media.leave(open_back);
  EXPECT_TRUE(media.holds(closed)) << "a sheet ends no closed solid";
  media.leave(cavity);
  EXPECT_TRUE(media.empty()) << "into the cavity";
  media.enter(cavity);
  media.leave(closed);
  EXPECT_TRUE(media.empty()) << "out of the hollow solid";
}

TEST(MediumStack, KeepsTheInnermostWhenItIsFull) {
  std::vector<Solid> solids(MediumStack::kMax + 1);
  MediumStack media;
  for (std::size_t i = 0; i < solids.size(); ++i) {
    solids[i].rank = static_cast<std::uint32_t>(i);
    media.enter(solids[i]);
  }
  EXPECT_EQ(media.top(), &solids.back());
  EXPECT_FALSE(media.holds(solids.front()));
}

TEST(MediumStack, ASegmentBetweenAHoleAndNoSurfaceIsFreeOfTheMedium) {
  core::Material material;
  Solid solid;
  solid.material = &material;
  MediumStack media;
  media.enter(solid);
  media.begin_segment({&solid, true});
  EXPECT_EQ(media.medium_to({}), nullptr);
  EXPECT_EQ(media.medium_to({&solid, true}), nullptr);
  EXPECT_EQ(media.medium_to({&solid, false}), &material);
  media.begin_segment({&solid, false});
  EXPECT_EQ(media.medium_to({&solid, true}), &material);
  media.begin_segment();
  EXPECT_EQ(media.medium_to({&solid, true}), nullptr);
  EXPECT_EQ(media.medium_to({}), &material);
  solid.scatters = true;
  for (const SolidFace start : {SolidFace(), SolidFace{&solid, true}}) {
    media.begin_segment(start);
    EXPECT_EQ(media.medium_to({&solid, true}), &material);
  }
}

TEST(Solids, ContainThePointsInsideTheirSurface) {
  const auto scene = balls({glass(), glass()}, {1, 0.5F});
  const core::SceneData& data = scene->data();
  ASSERT_EQ(data.solids.size(), 2U);
  EXPECT_TRUE(scene->summary().warnings.empty()) << scene->summary().warnings.front().detail;
  EXPECT_TRUE(core::solids_around(data, {0, 0, 1.5F}).empty());
  EXPECT_TRUE(core::solids_around(data, {0.9F, 0.9F, 0}).empty()) << "in the box alone";
  const MediumStack outer = core::solids_around(data, {0, 0, 0.75F});
  EXPECT_TRUE(outer.holds(data.solids[0]));
  EXPECT_FALSE(outer.holds(data.solids[1]));
  const MediumStack inner = core::solids_around(data, {0, 0, 0.25F});
  EXPECT_TRUE(inner.holds(data.solids[0]));
  EXPECT_EQ(inner.top(), &data.solids[1]) << "the smaller one";
}

TEST(Solids, PriorityGoesBeforeSize) {
  const auto scene = balls({glass(1), glass()}, {1, 0.5F});
  EXPECT_EQ(core::solids_around(scene->data(), {0, 0, 0.25F}).top(), &scene->data().solids[0]);
}

TEST(Solids, AnOpenSurfaceContainsWhatSeesItsBackFirst) {
  MaterialDescription floor = test_support::lambert(Rgb(1));
  const auto scene = test_support::build(test_support::scene_of(
      {glass(), floor}, {test_support::quad({-9, 0, 9}, {18, 0, 0}, {0, 0, -18}, 0),
                         test_support::quad({-9, -2, 9}, {18, 0, 0}, {0, 0, -18}, 1)}));
  const core::SceneData& data = scene->data();
  EXPECT_FALSE(core::solids_around(data, {0, -1, 0}).empty()) << "under water";
  EXPECT_TRUE(core::solids_around(data, {0, 1, 0}).empty()) << "above";
  EXPECT_TRUE(core::solids_around(data, {0, -3, 0}).empty()) << "below the floor";
}

// Water as one quad between walls; from the deepest point it fills 1.6 % of the sphere.
TEST(Solids, AnOpenSurfaceContainsWhatOpaqueWallsShutInBelowIt) {
  const auto wall = [](Vec3 at, Vec3 u, Vec3 v) { return test_support::quad(at, u, v, 1); };
  const Vec3 x = {1, 0, 0};
  const Vec3 y = {0, 9, 0};
  const Vec3 z = {0, 0, 1};
  const auto scene = test_support::build(test_support::scene_of(
      {glass(), test_support::lambert(Rgb(1))},
      {test_support::quad({-0.5F, -0.2F, 0.5F}, x, -z, 0), wall({-0.5F, -9, -0.5F}, x, z),
       wall({-0.5F, -9, -0.5F}, x, y), wall({-0.5F, -9, 0.5F}, x, y),
       wall({-0.5F, -9, -0.5F}, z, y), wall({0.5F, -9, -0.5F}, z, y)}));
  const core::SceneData& data = scene->data();
  for (const float depth : {0.3F, 0.6F, 1.0F, 1.5F, 2.4F}) {
    for (const Vec3 aside : {Vec3{0, 0, 0}, Vec3{0.1F, 0, 0.1F}, Vec3{-0.3F, 0, 0.2F}}) {
      EXPECT_FALSE(core::solids_around(data, aside + Vec3{0, -depth, 0}).empty()) << depth;
    }
  }
  EXPECT_TRUE(core::solids_around(data, {0, -0.1F, 0}).empty()) << "between water and rim";
  EXPECT_TRUE(core::solids_around(data, {3, -1, 0}).empty()) << "beside the walls";
}

TEST(Solids, ASurfaceModelledTwiceContainsAPointOnce) {
  core::PrimitiveDescription ball = test_support::sphere({0, 0, 0}, 1, 8, false, 0);
  const std::vector<std::uint32_t> once = ball.indices;
  ball.indices.insert(ball.indices.end(), once.begin(), once.end());
  const auto scene = test_support::build(test_support::scene_of({glass()}, {ball}));
  MediumStack media = core::solids_around(scene->data(), {0, 0, 0.25F});
  ASSERT_FALSE(media.empty());
  media.leave(scene->data().solids[0]);
  EXPECT_TRUE(media.empty());
}

TEST(Solids, WarnOfSurfacesThatAreNotClosedOrFaceInwards) {
  const auto warnings = [](const core::PrimitiveDescription& part) {
    core::SceneDescription scene = test_support::scene_of({glass()}, {part});
    scene.meshes.front().name = "vase";
    return test_support::build(std::move(scene))->summary().warnings;
  };
  core::PrimitiveDescription ball = test_support::sphere({0, 0, 0}, 1, 8, false, 0);
  EXPECT_TRUE(warnings(ball).empty());
  const auto inward = warnings(test_support::sphere({0, 0, 0}, 1, 8, true, 0));
  ASSERT_EQ(inward.size(), 1U);
  EXPECT_NE(inward.front().detail.find("mesh 'vase'"), std::string::npos);
  EXPECT_NE(inward.front().detail.find("faces inwards"), std::string::npos);
  ball.indices.resize(ball.indices.size() / 2);
  const auto open = warnings(ball);
  ASSERT_EQ(open.size(), 1U);
  EXPECT_NE(open.front().detail.find("mesh 'vase'"), std::string::npos);
  EXPECT_NE(open.front().detail.find("is not closed"), std::string::npos);
  EXPECT_NE(open.front().detail.find("what lies behind is seen 0.444 times as bright"),
            std::string::npos)
      << open.front().detail;

  // Two halves of a ball, one wound the other way.
  core::PrimitiveDescription upper = test_support::sphere({0, 0, 0}, 1, 8, false, 0);
  core::PrimitiveDescription lower = upper;
  const auto half = static_cast<std::ptrdiff_t>(upper.indices.size() / 2);
  upper.indices.erase(upper.indices.begin(), upper.indices.begin() + half);
  lower.indices.erase(lower.indices.begin() + half, lower.indices.end());
  for (std::size_t i = 0; i < lower.indices.size(); i += 3) {
    std::swap(lower.indices[i], lower.indices[i + 1]);
  }
  const auto both =
      test_support::build(test_support::scene_of({glass()}, {upper, lower}))->summary().warnings;
  ASSERT_EQ(both.size(), 1U);
  EXPECT_NE(both.front().detail.find("faces both ways (both triangles at 16 edges are"),
            std::string::npos)
      << both.front().detail;
}

/// The lower or the upper half of a ball.
core::PrimitiveDescription half_ball(bool upper, float radius_m, bool inward) {
  core::PrimitiveDescription out = test_support::sphere({0, 0, 0}, radius_m, 8, inward, 0);
  const auto half = static_cast<std::ptrdiff_t>(out.indices.size() / 2);
  const auto begin = out.indices.begin() + (upper ? half : 0);
  out.indices = {begin, begin + half};
  return out;
}

/// Nodes with a mesh each, moved to `away`.
core::SceneDescription nodes_of(std::vector<core::PrimitiveDescription> parts, Vec3 away) {
  core::SceneDescription out;
  out.materials = {glass()};
  for (core::PrimitiveDescription& part : parts) {
    const float lift = 0.1F * static_cast<float>(out.meshes.size());  // of the node's own origin
    for (Vec3& p : part.positions) {
      p.y -= lift;
    }
    out.instances.push_back(
        {static_cast<int>(out.meshes.size()), core::translation(away + Vec3{0, lift, 0})});
    const std::string name = "part " + std::to_string(out.meshes.size());
    out.meshes.push_back({name, {std::move(part)}});
  }
  return out;
}

/// Expects that triangles and normals face away from a point, or to it.
void expect_facing(const core::MeshData& mesh, Vec3 center, bool inward) {
  for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
    const auto at = [&](std::size_t k) { return mesh.positions[mesh.indices[i + k]] - center; };
    const Vec3 n = cross(at(1) - at(0), at(2) - at(0));
    if (length(n) > 1e-6F) {
      EXPECT_EQ(dot(n, at(0) + at(1) + at(2)) < 0, inward) << i;
    }
    EXPECT_EQ(dot(mesh.normals[mesh.indices[i]], at(0)) < 0, inward) << i;
  }
}

TEST(Solids, PiecesInSeveralNodesAreOneAndFaceOneWay) {
  const Vec3 away = {1.3F, -0.7F, 3.1F};
  for (const bool upper_inward : {false, true}) {
    for (const bool lower_inward : {false, true}) {
      const auto scene = test_support::build(
          nodes_of({half_ball(false, 1, lower_inward), half_ball(true, 1, upper_inward)}, away));
      const core::SceneData& data = scene->data();
      ASSERT_EQ(data.solids.size(), 1U);
      EXPECT_EQ(data.solids[0].kind, SolidKind::kClosed);
      EXPECT_EQ(data.solids[0].is_inside_out, lower_inward);
      for (const core::MeshData& mesh : data.meshes) {
        expect_facing(mesh, away, lower_inward);
      }
      EXPECT_TRUE(core::solids_around(data, away + Vec3{0, 1.1F, 0}).empty());
      EXPECT_EQ(core::solids_around(data, away).size(), 1U);
      const auto& warnings = scene->summary().warnings;
      const bool turned = upper_inward != lower_inward;
      ASSERT_EQ(warnings.size(), (turned ? 1U : 0U) + (lower_inward ? 1U : 0U));
      if (turned) {
        EXPECT_EQ(warnings[0].code, "turned");
        EXPECT_NE(warnings[0].detail.find("mesh 'part 1'"), std::string::npos);
      }
    }
  }
}

TEST(Solids, PiecesOfACavityStay) {
  const auto scene =
      test_support::build(nodes_of({half_ball(false, 1, false), half_ball(true, 1, false),
                                    half_ball(false, 0.5F, true), half_ball(true, 0.5F, true)},
                                   {0, 0, 0}));
  ASSERT_EQ(scene->data().solids.size(), 2U);
  EXPECT_EQ(scene->data().solids[1].kind, SolidKind::kCavity);
  EXPECT_TRUE(scene->summary().warnings.empty());
}

TEST(Solids, PiecesThatNodesDoNotCloseStay) {
  core::PrimitiveDescription bowl = half_ball(true, 1, true);
  bowl.indices.resize(bowl.indices.size() - 6);  // a hole
  const auto scene = test_support::build(nodes_of({half_ball(false, 1, false), bowl}, {0, 0, 0}));
  ASSERT_EQ(scene->data().solids.size(), 2U);
  expect_facing(scene->data().meshes[1], {0, 0, 0}, true);
  for (const core::Warning& warning : scene->summary().warnings) {
    EXPECT_NE(warning.detail.find("is not closed"), std::string::npos) << warning.detail;
  }
}

TEST(ClosedSurface, SeamsAreClosedUpToRounding) {
  core::MeshData mesh;
  core::PrimitiveDescription ball = test_support::sphere({5, 5, 5}, 1, 8, false, 0);
  mesh.positions = ball.positions;
  mesh.indices = ball.indices;
  for (std::size_t i = 0; i < mesh.indices.size(); i += 7) {  // vertices of their own, moved a bit
    mesh.positions.push_back(mesh.positions[mesh.indices[i]] + Vec3{5e-7F, 0, -5e-7F});
    mesh.indices[i] = static_cast<std::uint32_t>(mesh.positions.size() - 1);
  }
  const core::MeshData* const meshes[] = {&mesh};
  const auto closed = core::join_surfaces(meshes);
  ASSERT_EQ(closed.size(), 1U);
  EXPECT_EQ(closed[0].border_edges, 0U);
  EXPECT_GT(closed[0].volume_m3, 0);
  const auto middle =
      mesh.indices.begin() + static_cast<std::ptrdiff_t>(mesh.indices.size() / 6 * 3);
  mesh.indices.erase(middle, middle + 3);
  EXPECT_EQ(core::join_surfaces(meshes)[0].border_edges, 3U) << "a missing triangle is seen";
}

// Of a bowl of glass, an inner and an outer side that share the edge.
TEST(ClosedSurface, TheVolumeOfJoinedMeshesIsThatBetweenThem) {
  const auto side = [](bool inner) {
    const core::PrimitiveDescription half = half_ball(false, 1, inner);
    core::MeshData mesh;
    mesh.positions = half.positions;
    for (Vec3& p : mesh.positions) {
      p.y *= inner ? 0.9F : 1;
    }
    // The first vertex of the inner side is on the edge, that of the outer one its deepest.
    mesh.positions.insert(mesh.positions.begin(),
                          inner ? Vec3{1, 0, 0} : half.positions[half.indices.front()]);
    for (const std::uint32_t i : half.indices) {
      mesh.indices.push_back(i + 1);
    }
    return mesh;
  };
  const core::MeshData outer = side(false);
  const core::MeshData inner = side(true);
  EXPECT_NEAR(std::fabs(outer.positions.front().y), 1, 1e-6F);
  const core::MeshData* const meshes[] = {&outer, &inner};
  const auto bowl = core::join_surfaces(meshes);
  ASSERT_EQ(bowl.size(), 1U);
  EXPECT_EQ(bowl[0].border_edges, 0U);
  EXPECT_NEAR(bowl[0].volume_m3, 0.1 * 2.0944, 0.02) << "a tenth of a half of a ball";
}

}  // namespace
