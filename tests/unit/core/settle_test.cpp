// Settling a view, loading a scene, and crowded geometry.
#include "core/render/task/settle.h"

#include <stop_token>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene/crowding.h"
#include "core/scene/scene_data.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_load.h"
#include "tests/support/scenes.h"

namespace {

std::stop_token stopped() {
  std::stop_source source;
  source.request_stop();
  return source.get_token();
}

core::View cornell_view() { return test_support::cornell_view(16, 16, 40); }

TEST(Settle, StopsWithoutAResult) {
  core::View measured = cornell_view();
  measured.settings.estimator.splitting = core::SplittingType::kMeasured;
  core::View automatic = cornell_view();
  automatic.settings.integrator = "auto";
  for (core::View& view : std::vector{measured, automatic}) {
    const auto settled = core::settle(view, {}, stopped());
    ASSERT_FALSE(settled);
    EXPECT_EQ(settled.error().code, core::ErrorCode::kCancelled);
    EXPECT_FALSE(view.measured);
  }
}

TEST(Settle, MeasuresOnce) {
  core::View view = cornell_view();
  view.settings.estimator.splitting = core::SplittingType::kMeasured;
  ASSERT_TRUE(core::settle(view, {}));
  ASSERT_TRUE(view.measured);
  EXPECT_GE(view.measured->split_count, 1);
  const auto renderer = core::Renderer::create(view);
  ASSERT_TRUE(renderer);
  EXPECT_EQ((*renderer)->measured_split_count(), view.measured->split_count);
}

TEST(LoadScene, StopsWhileReadingAndBuilding) {
  core::GltfOptions options;
  options.limits.admit = core::until_stopped(stopped());
  const core::Bytes file = core::find_builtin_scene("cornell-box")->make_glb();
  const auto read = core::load_gltf(file, nullptr, options);
  ASSERT_FALSE(read);
  EXPECT_EQ(read.error().code, core::ErrorCode::kCancelled);
  const auto built = core::Scene::build(test_support::cornell(), 1, {}, stopped());
  ASSERT_FALSE(built);
  EXPECT_EQ(built.error().code, core::ErrorCode::kCancelled);
}

/// side x side quads of a grid of 1 m, `layers` times in the same place.
core::SceneDescription grids(int side, int layers) {
  std::vector<core::PrimitiveDescription> quads;
  const float step = 1.0F / static_cast<float>(side);
  for (int layer = 0; layer < layers; ++layer) {
    for (int i = 0; i < side * side; ++i) {
      const core::Vec3 corner = {static_cast<float>(i % side) * step,
                                 static_cast<float>(i / side) * step, 0};
      quads.push_back(test_support::quad(corner, {step, 0, 0}, {0, step, 0}, 0));
    }
  }
  return test_support::scene_of({test_support::lambert(core::Rgb(0.5F))}, std::move(quads));
}

// The two triangles of a quad have the quad's box, so a line through the grid's plane meets two
// boxes in each layer.
TEST(Crowding, CountsTheBoxesThatALineMeets) {
  for (const auto& [side, layers] : {std::pair{1, 1}, std::pair{16, 1}, std::pair{4, 10}}) {
    const auto scene = core::Scene::build(grids(side, layers), 1);
    ASSERT_TRUE(scene);
    EXPECT_NEAR(core::boxes_met((*scene)->data()), 2.0 * layers, 1e-3 * layers) << side;
  }
}

// An instance has a box of its own; the quad's two triangles fill it.
TEST(Crowding, CountsInstancesWithTheirTriangles) {
  core::SceneDescription scene = grids(1, 1);
  scene.instances.resize(300, scene.instances.front());
  const auto built = core::Scene::build(std::move(scene), 1);
  ASSERT_TRUE(built);
  EXPECT_NEAR(core::boxes_met((*built)->data()), 600, 1e-3);
}

TEST(Crowding, IsAWarningOfTheScene) {
  const auto warns = [](core::SceneDescription description) {
    const auto scene = core::Scene::build(std::move(description), 1);
    for (const core::Warning& warning : (*scene)->summary().warnings) {
      if (warning.detail.find("in the same place") != std::string::npos) {
        return true;
      }
    }
    return false;
  };
  EXPECT_TRUE(warns(grids(1, 600)));
  EXPECT_FALSE(warns(grids(24, 1)));  // As many quads, next to each other.
}

TEST(EmptyScene, IsAWarningOfTheScene) {
  core::SceneDescription scene = grids(1, 1);
  core::SceneDescription empty = scene;
  empty.instances.clear();
  const auto filled = core::Scene::build(std::move(scene), 1);
  const auto built = core::Scene::build(std::move(empty), 1);
  ASSERT_TRUE(filled && built);
  EXPECT_TRUE((*filled)->summary().warnings.empty());
  ASSERT_EQ((*built)->summary().warnings.size(), 1U);
  EXPECT_EQ((*built)->summary().warnings[0].code, "empty");
}

}  // namespace
