// Triangles divided near small meshes: the surface, its attributes and its neighbourhoods stay.
#include "core/scene/divide_triangles.h"

#include <array>
#include <cmath>
#include <map>
#include <set>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/offset_ray.h"
#include "tests/support/statistics.h"

namespace {

using core::MeshData;
using core::SceneData;
using core::Vec2;
using core::Vec3;

constexpr float kHalf_m = 5000;

/// A level square of 4x4 cells with uv = (x, z), each cell with vertices of its own if `apart`.
MeshData ground(bool apart) {
  MeshData mesh;
  const auto add = [&](int x, int z) {
    const float step = kHalf_m / 2;
    const Vec3 p = {static_cast<float>(x) * step - kHalf_m, 0,
                    static_cast<float>(z) * step - kHalf_m};
    mesh.positions.push_back(p);
    mesh.normals.push_back({0, 1, 0});
    mesh.tangents.push_back({1, 0, 0, -1});
    mesh.uv[0].push_back({p.x, p.z});
    mesh.colors.push_back({p.x, p.z, 1, 1});
    return static_cast<std::uint32_t>(mesh.positions.size() - 1);
  };
  for (int x = 0; x < 5 && !apart; ++x) {
    for (int z = 0; z < 5; ++z) {
      add(x, z);
    }
  }
  for (int x = 0; x < 4; ++x) {
    for (int z = 0; z < 4; ++z) {
      std::array<std::uint32_t, 4> v = {};  // of the corners (x, z), (x, z + 1), ...
      for (int k = 0; k < 4; ++k) {
        const int cx = x + k / 2;
        const int cz = z + k % 2;
        v[static_cast<std::size_t>(k)] =
            apart ? add(cx, cz) : static_cast<std::uint32_t>(5 * cx + cz);
      }
      mesh.indices.insert(mesh.indices.end(), {v[0], v[1], v[2], v[2], v[1], v[3]});
    }
  }
  mesh.positions.push_back({});
  mesh.normals.push_back({});
  mesh.in_world_space = true;
  return mesh;
}

MeshData small_triangle(Vec3 at, float size_m) {
  MeshData mesh;
  mesh.positions = {at, at + Vec3{size_m, 0, 0}, at + Vec3{0, size_m, 0}, {}};
  mesh.indices = {0, 1, 2};
  mesh.in_world_space = true;
  return mesh;
}

/// A ground with small triangles, the first level of the scene.
SceneData scene_with(bool apart, const std::vector<Vec3>& places, float size_m) {
  SceneData scene;
  scene.meshes.push_back(ground(apart));
  for (const Vec3 at : places) {
    scene.meshes.push_back(small_triangle(at, size_m));
  }
  for (std::uint32_t i = 0; i < scene.meshes.size(); ++i) {
    scene.placed.push_back({.mesh = i});
  }
  return scene;
}

using Key = std::array<float, 3>;
Key key(Vec3 p) { return {p.x, p.y, p.z}; }

/// Expects that each edge belongs to two triangles, or lies on the square's outline; returns the
/// area.
double area_of_a_closed_net(const MeshData& mesh) {
  std::map<std::set<Key>, int> uses;
  double area_m2 = 0;
  for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
    std::array<Vec3, 3> p;
    for (std::size_t k = 0; k < 3; ++k) {
      p[k] = mesh.positions[mesh.indices[3 * t + k]];
    }
    const double twice = static_cast<double>(cross(p[1] - p[0], p[2] - p[0]).y);
    EXPECT_GT(twice, 0) << "turned over";
    area_m2 += 0.5 * twice;
    for (std::size_t k = 0; k < 3; ++k) {
      ++uses[{key(p[k]), key(p[(k + 1) % 3])}];
    }
  }
  for (const auto& [edge, count] : uses) {
    const auto on_outline = [&](std::size_t axis) {
      const float a = (*edge.begin())[axis];
      return std::fabs(a) == kHalf_m && a == (*edge.rbegin())[axis];
    };
    EXPECT_EQ(count, on_outline(0) || on_outline(2) ? 1 : 2);
  }
  return area_m2;
}

TEST(DivideTriangles, KeepsSurfaceAttributesAndNeighbours) {
  test_support::Random random(7);
  for (const bool apart : {false, true}) {
    std::vector<Vec3> places = {{0, 0, 0}, {kHalf_m / 2, 0, 0}, {-kHalf_m, 0, 17}};
    for (int i = 0; i < 20; ++i) {
      places.push_back(
          {kHalf_m * (2 * random.uniform() - 1), 0, kHalf_m * (2 * random.uniform() - 1)});
    }
    SceneData scene = scene_with(apart, places, 0.05F);
    const std::size_t given = scene.meshes[0].positions.size() - 1;
    const std::size_t added = divide_triangles(scene);
    const MeshData& mesh = scene.meshes[0];
    EXPECT_EQ(mesh.triangle_count(), 32 + added);
    EXPECT_LT(added, 100 * places.size());
    EXPECT_NEAR(area_of_a_closed_net(mesh), 1e8, 1);
    ASSERT_EQ(mesh.added.size(), mesh.positions.size() - 1 - given);
    ASSERT_EQ(mesh.tangents.size(), mesh.positions.size() - 1);
    for (std::size_t v = 0; v + 1 < mesh.positions.size(); ++v) {
      const Vec3 p = mesh.positions[v];
      EXPECT_EQ(p.y, 0);
      EXPECT_EQ(mesh.uv[0][v].x, p.x);
      EXPECT_EQ(mesh.uv[0][v].y, p.z);
      EXPECT_EQ(mesh.colors[v].x, p.x);
      EXPECT_EQ(mesh.normals[v].y, 1);
      EXPECT_EQ(mesh.tangents[v].w, -1);
      if (v >= given) {
        double sum = 0;
        for (std::size_t k = 0; k < 3; ++k) {
          const auto& of = mesh.added[v - given];
          sum += static_cast<double>(of.weights[k]) *
                 static_cast<double>(mesh.positions[of.vertices[k]].x);
          EXPECT_LT(of.vertices[k], given);
        }
        EXPECT_NEAR(sum, p.x, 1e-3);
      }
    }
  }
}

TEST(DivideTriangles, TrianglesNearSmallMeshesAreSmall) {
  constexpr float kSize_m = 0.05F;
  for (const Vec3 at : {Vec3{0, 0, 0}, Vec3{123, 0, -77}, Vec3{kHalf_m - 1, 0, 3}}) {
    SceneData scene = scene_with(false, {at}, kSize_m);
    EXPECT_GT(divide_triangles(scene), 10);
    const MeshData& mesh = scene.meshes[0];
    for (std::size_t t = 0; t < mesh.triangle_count(); ++t) {
      core::Bounds box;
      float edges_m = 0;
      for (std::size_t k = 0; k < 3; ++k) {
        const Vec3 p = mesh.positions[mesh.indices[3 * t + k]];
        box.add(p);
        edges_m += core::taxicab(p - mesh.positions[mesh.indices[3 * t]]);
      }
      if (box.min.x <= at.x + kSize_m && at.x <= box.max.x && box.min.z <= at.z &&
          at.z <= box.max.z) {
        EXPECT_LT(core::kPlaneError * edges_m, 1e-3F * kSize_m);
      }
    }
  }
}

/// Moves all of a mesh up by `height_m` until the shutter closes.
void lift(MeshData& mesh, float height_m) {
  core::MovedVertices moved = {mesh.positions, mesh.normals};
  moved.normals.pop_back();
  for (std::size_t v = 0; v + 1 < moved.positions.size(); ++v) {
    moved.positions[v].y += height_m;
  }
  mesh.later.push_back(moved);
}

TEST(DivideTriangles, MovingMeshesAndInstancesToo) {
  SceneData moving = scene_with(false, {{0, 7, 0}}, 0.05F);
  lift(moving.meshes[0], 7);
  EXPECT_GT(divide_triangles(moving), 10);
  const MeshData& mesh = moving.meshes[0];
  ASSERT_EQ(mesh.later[0].positions.size(), mesh.positions.size());
  ASSERT_EQ(mesh.later[0].normals.size(), mesh.positions.size() - 1);
  for (std::size_t v = 0; v + 1 < mesh.positions.size(); ++v) {
    EXPECT_EQ(mesh.later[0].positions[v].y, 7);
  }

  SceneData twice = scene_with(false, {{0, 0, 0}}, 0.05F);
  twice.placed = {{.mesh = 1}, {.mesh = 0}, {.mesh = 0}};
  const core::Transform half = core::scaling({0.5F, 0.5F, 0.5F});
  twice.instances.push_back({half, 1, core::instance_error(half)});
  const core::Transform away = core::translation({0, 100, 0});
  twice.instances.push_back({away, 2, core::instance_error(away)});
  const std::size_t added = divide_triangles(twice);
  EXPECT_EQ(twice.meshes[0].triangle_count(), 32 + added / 2);
  EXPECT_GT(added, 20);
}

TEST(DivideTriangles, LeavesWhatIsLargeOrFarAway) {
  SceneData large = scene_with(false, {{0, 0, 0}}, 100);
  EXPECT_EQ(divide_triangles(large), 0);
  SceneData above = scene_with(false, {{0, 1, 0}}, 0.05F);
  EXPECT_EQ(divide_triangles(above), 0);
  SceneData beside = scene_with(false, {{kHalf_m + 1, 0, 0}}, 0.05F);
  EXPECT_EQ(divide_triangles(beside), 0);
  SceneData huge = scene_with(false, {{0, 0, 0}}, 1e-4F);
  for (Vec3& p : huge.meshes[0].positions) {
    p = p * 1e34F;
  }
  EXPECT_EQ(divide_triangles(huge), 0) << "whose edges have no squares";
  SceneData empty;
  EXPECT_EQ(divide_triangles(empty), 0);
}

// Edges of a step between two floats would be bisected again and again.
TEST(DivideTriangles, EndsWhereHalvesAreNoSmaller) {
  const Vec3 at = {0.7e18F, 0, 0.3e18F};
  SceneData far = scene_with(false, {at}, 1e8F);
  for (Vec3& p : far.meshes[0].positions) {
    p = p * 2e14F;
  }
  EXPECT_LT(divide_triangles(far), 1000);
}

}  // namespace
