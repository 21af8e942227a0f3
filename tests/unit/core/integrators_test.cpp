// The rows of the integrator registry, each rendered at a small size.
#include <cmath>

#include <gtest/gtest.h>

#include "core/film/film.h"
#include "core/integrators/integrator.h"
#include "core/integrators/registry.h"
#include "core/render/task/settle.h"
#include "tests/support/scenes.h"

namespace {

using test_support::Picture;

core::View cornell_view(std::string_view integrator, int max_depth) {
  core::View view = test_support::view_of(test_support::cornell(), 40, 40);
  test_support::look_at(view, {0.5F, 0.5F, 2.4F}, {0.5F, 0.5F, 0}, 30);
  view.environment = test_support::constant_sky({0.2F, 0.3F, 0.4F});
  view.settings.integrator = integrator;
  view.settings.max_depth = max_depth;
  view.settings.estimator.roulette = core::RouletteType::kNone;
  return view;
}

/// Largest difference of a pixel's channel, relative to the larger of 1 and the pixel's value.
float largest_difference(const Picture& a, const Picture& b) {
  float most = 0;
  for (std::size_t p = 0; p < a.snapshot.pixel_count(); ++p) {
    const core::Rgb one = core::pixel_value(a.snapshot, p).mean;
    const core::Rgb other = core::pixel_value(b.snapshot, p).mean;
    for (int c = 0; c < 3; ++c) {
      most = std::max(most, std::fabs(one[c] - other[c]) / std::max(1.0F, std::fabs(other[c])));
    }
  }
  return most;
}

TEST(Integrators, EveryRowHasASummaryAFactoryAndAKnownBias) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    EXPECT_FALSE(row.summary.empty()) << row.name;
    EXPECT_NE(row.make, nullptr) << row.name;
    EXPECT_TRUE(row.bias == "none" || row.bias == "consistent" || row.bias == "biased") << row.name;
    EXPECT_EQ(core::find_integrator(row.name), &row);
  }
  EXPECT_EQ(core::find_integrator("no-such-integrator"), nullptr);
}

TEST(Integrators, FilmsOfEveryRowAreIndependentOfThreads) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    const core::View view = cornell_view(row.name, 16);
    EXPECT_EQ(test_support::render(view, 4, 1).film->digest(),
              test_support::render(view, 4, 3).film->digest())
        << row.name;
  }
}

TEST(Integrators, RefuseDispersionUnlessSupported) {
  core::SceneDescription scene = test_support::cornell();
  scene.materials[0].dispersion = 0.1F;
  core::View view = test_support::view_of(std::move(scene), 40, 40);
  for (const core::IntegratorEntry& row : core::integrators()) {
    view.settings.integrator = row.name;
    const auto renderer = test_support::settled_renderer(view);
    EXPECT_EQ(static_cast<bool>(renderer), row.disperses) << row.name;
    if (!renderer) {
      EXPECT_EQ(renderer.error().where, "/integrator/type");
    }
  }
}

// A job that names `direct` alone.
core::View direct_view() {
  core::View view = cornell_view("direct", 1);
  view.settings.max_depth = core::default_settings("direct").max_depth;
  view.settings.estimator = {};
  return view;
}

TEST(Integrators, DirectEqualsPathAtDepthOne) {
  core::View path = direct_view();
  path.settings.integrator = "path";
  path.settings.max_depth = 1;
  EXPECT_EQ(test_support::render(direct_view(), 16).film->digest(),
            test_support::render(path, 16).film->digest());
}

// The planted fault: one more bounce is detected.
TEST(Integrators, DirectDiffersFromPathAtDepthTwo) {
  const Picture direct = test_support::render(direct_view(), 16);
  EXPECT_GT(largest_difference(direct, test_support::render(cornell_view("path", 2), 16)), 0.05F);
}

}  // namespace
