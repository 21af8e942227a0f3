// Depths and materials at pixel centres against planes in closed form.
#include "core/aovs/first_surfaces.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace {

constexpr int kWidth = 40;
constexpr int kHeight = 30;

core::Camera camera() {
  core::CameraSettings settings;
  settings.type = core::CameraType::kPinhole;
  settings.position = core::Place{0, 0, 5};
  settings.target = core::Place{0, 0, 0};
  settings.fx_px = 50;
  settings.fy_px = 45;
  settings.cx_px = 18.25;
  settings.cy_px = 16.5;
  return core::Camera::create(settings, {}, {}, kWidth, kHeight).value();
}

core::Result<std::shared_ptr<const core::MeshTree>> build(const core::PrimitiveDescription& mesh) {
  return core::MeshTree::build(mesh, 1, "", {});
}

core::SceneDescription quad_at(core::Transform to_world, int material) {
  core::SceneDescription scene;
  scene.meshes.emplace_back();
  scene.meshes[0].primitives.push_back(
      test_support::quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, material));
  scene.instances.push_back({.mesh = 0, .to_world = to_world});
  return scene;
}

/// The x and y of a pixel's ray at depth 1.
core::Vec2 slope(int x, int y) {
  return {static_cast<float>((x + 0.5 - 18.25) / 50), static_cast<float>((16.5 - y - 0.5) / 45)};
}

TEST(FirstSurfaces, DepthIsThatOfASlantedPlane) {
  // z = 0.5 x for the points of the quad, so that 5 - depth = 0.5 * depth * slope.x.
  core::Transform slanted;
  slanted.x = {1, 0, 0.5F};
  const auto seen =
      core::first_surfaces(quad_at(slanted, 3), camera(), kWidth, kHeight, &build, {});
  ASSERT_TRUE(seen);
  int inside = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const core::FirstSurface& at = (*seen)[static_cast<std::size_t>(y * kWidth + x)];
      const core::Vec2 s = slope(x, y);
      const double depth = 5 / (1 + 0.5 * static_cast<double>(s.x));
      const double u = std::fabs(depth * static_cast<double>(s.x));
      const double v = std::fabs(depth * static_cast<double>(s.y));
      if (u < 0.999 && v < 0.999) {
        EXPECT_NEAR(at.depth_m, depth, 1e-6) << x << " " << y;
        EXPECT_EQ(at.material, 3);
        ++inside;
      } else if (u > 1.001 || v > 1.001) {
        EXPECT_TRUE(std::isinf(at.depth_m)) << x << " " << y;
        EXPECT_EQ(at.material, -1);
      }
    }
  }
  EXPECT_GT(inside, 100);
}

TEST(FirstSurfaces, NearestOfSeveralInstancesIsSeen) {
  core::SceneDescription scene = quad_at(core::translation({0, 0, 1}), 1);
  scene.instances.push_back({.mesh = 0, .to_world = core::translation({0, 0, 2})});
  scene.instances.push_back({.mesh = 0, .to_world = core::translation({0, 0, 40})});  // behind
  scene.instances.push_back({.mesh = 0, .to_world = core::translation({90, 0, 1})});  // beside
  int asked = 0;
  const auto find = [&](const core::PrimitiveDescription& mesh) {
    ++asked;
    return build(mesh);
  };
  const auto seen = core::first_surfaces(scene, camera(), kWidth, kHeight, find, {});
  ASSERT_TRUE(seen);
  EXPECT_NEAR((*seen)[std::size_t{16} * kWidth + 18].depth_m, 3, 1e-6);
  EXPECT_EQ(asked, 4);
}

TEST(FirstSurfaces, StopEndsIt) {
  std::stop_source source;
  source.request_stop();
  const auto seen =
      core::first_surfaces(quad_at({}, 0), camera(), kWidth, kHeight, &build, source.get_token());
  ASSERT_FALSE(seen);
  EXPECT_EQ(seen.error().code, core::ErrorCode::kCancelled);
}

}  // namespace
