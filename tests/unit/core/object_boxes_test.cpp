// Bounding boxes of objects in an equirectangular image, against a dense grid of their points.
#include "core/aovs/object_boxes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "core/camera/camera.h"
#include "tests/support/scenes.h"

namespace {

using core::Vec3;

/// Bounding box of a dense grid of points of the triangle, by the longitudes and latitudes of an
/// equirectangular image whose centre looks along -z.
core::PixelBox panorama_of_points(const std::array<Vec3, 3>& corners, int width, int height) {
  constexpr int kPoints = 700;
  core::PixelBox out = {{1e30F, 1e30F}, {-1e30F, -1e30F}};
  for (int i = 0; i <= kPoints; ++i) {
    for (int j = 0; i + j <= kPoints; ++j) {
      const float u = static_cast<float>(i) / kPoints;
      const float v = static_cast<float>(j) / kPoints;
      const Vec3 p = corners[0] * (1 - u - v) + corners[1] * u + corners[2] * v;
      const float x = (std::atan2(p.x, -p.z) / 6.2831853F + 0.5F) * static_cast<float>(width);
      const float y = std::acos(p.y / length(p)) / 3.14159265F * static_cast<float>(height);
      out.min = {std::min(out.min.x, x), std::min(out.min.y, y)};
      out.max = {std::max(out.max.x, x), std::max(out.max.y, y)};
    }
  }
  return out;
}

TEST(ObjectBoxes, OfAPanoramaContainObjectsInEveryDirection) {
  constexpr int kAround = 200;
  constexpr int kDown = 100;
  const std::array<std::array<Vec3, 3>, 6> triangles = {{
      {{{-2, -1, -3}, {2, -1, -3}, {0, 1, -3}}},  // ahead
      {{{3, 1, 1}, {3, 1, -1}, {3, 2, 0}}},       // to the right: its edge is higher in the middle
      {{{-1, -2, 3}, {1.5F, -1, 3}, {0, 1, 4}}},  // behind
      {{{-3, 2, -2}, {3, 2, -2}, {0.5F, 2, 4}}},  // above
      {{{-3, -2, -2}, {0.5F, -2, 4}, {3, -2, -2}}},  // below
      {{{-4, -3, 2}, {4, 3, 2}, {5, 3, 2}}},         // a long one behind
  }};
  for (const auto& corners : triangles) {
    core::PrimitiveDescription only;
    only.positions = {corners.begin(), corners.end()};
    only.indices = {0, 1, 2};
    core::View view;
    view.scene = test_support::build(
        test_support::scene_of({test_support::lambert({1, 1, 1})}, {std::move(only)}));
    view.camera.type = core::CameraType::kPanorama;
    view.camera.position = Vec3{0, 0, 0};
    view.camera.target = Vec3{0, 0, -1};
    const core::SceneSummary& summary = view.scene->summary();
    const auto camera =
        core::Camera::create(view.camera, summary.cameras, summary.bounds, kAround, kDown);
    ASSERT_TRUE(camera);
    const auto box =
        core::object_boxes(*view.scene, *camera, kAround, kDown, {}).objects.begin()->second;
    const core::PixelBox truth = panorama_of_points(corners, kAround, kDown);
    ASSERT_TRUE(box.in_view);
    // The grid may miss the extremes by its spacing.
    EXPECT_NEAR(box.in_view->min.x, truth.min.x, 0.5F);
    EXPECT_NEAR(box.in_view->min.y, truth.min.y, 0.5F);
    EXPECT_NEAR(box.in_view->max.x, truth.max.x, 0.5F);
    EXPECT_NEAR(box.in_view->max.y, truth.max.y, 0.5F);
  }
}

}  // namespace
