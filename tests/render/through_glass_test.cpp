// Clear surfaces in front of a background: composites of transparent images equal renders before
// the same colours, for every integrator that supports it.
#include <cmath>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/render/task/settle.h"
#include "core/transport/vertex.h"
#include "tests/support/scenes.h"

namespace {

using core::BackgroundType;
using core::Rgb;
using test_support::lambert;
using test_support::Picture;
using test_support::quad;
using test_support::scene_of;
using test_support::sphere;

constexpr int kSide = 24;

core::MaterialDescription glass(float roughness, float thickness) {
  core::MaterialDescription out;
  out.base_color = {0.8F, 0.8F, 0.8F};
  out.metallic = 0;
  out.roughness = roughness;
  out.transmission = 1;
  out.thickness = thickness;
  return out;
}

/// A pane and a ball of glass, with opaque things behind, below and beside them.
core::SceneDescription shop(float roughness) {
  return scene_of(
      {glass(roughness, 0), glass(roughness, 1), lambert({0.2F, 0.5F, 0.7F})},
      {quad({-1.6F, -1, 0.2F}, {1.4F, 0, 0}, {0, 2, 0}, 0),
       sphere({0.8F, 0, 0}, 0.7F, 16, false, 1), sphere({0.9F, 0.4F, -2}, 0.3F, 8, false, 2),
       quad({-2, -1, -1.5F}, {4, 0, 0}, {0, 0.6F, 0}, 2)});
}

core::View view_of(core::SceneDescription scene, std::string_view integrator) {
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  core::RenderSettings settings = core::default_settings(integrator);
  settings.film = view.settings.film;
  settings.photons.paths = 2000;
  settings.max_depth = integrator == "direct" ? 1 : 8;
  view.settings = settings;
  test_support::look_at(view, {0, 0.3F, 4}, {0, 0, 0}, 40);
  view.environment = test_support::sky_map(
      16, 8, [](int x, int y) { return Rgb(0.3F + (x == 5 && y == 2 ? 20.0F : 0.0F)); });
  return view;
}

Picture before(core::View view, BackgroundType type, Rgb color, bool through = true) {
  view.settings.background = {type, color, through};
  return test_support::render(view, 16);
}

std::vector<std::string_view> supporting() {
  std::vector<std::string_view> names;
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (core::accepts(row, core::kThroughGlass) && row.name != core::kAutomaticIntegrator) {
      names.push_back(row.name);
    }
  }
  return names;
}

/// The paths are the same, so the images are, up to rounding.
double farthest(const Picture& transparent, const Picture& colored, Rgb color) {
  double most = 0;
  for (std::size_t i = 0; i < colored.snapshot.pixel_count(); ++i) {
    const core::HalfValue v = core::pixel_value(transparent.snapshot, i);
    const Rgb composite = v.mean + color * (1 - v.alpha);
    const Rgb seen = core::pixel_value(colored.snapshot, i).mean;
    for (int c = 0; c < 3; ++c) {
      most = std::max(
          most, static_cast<double>(std::fabs(composite[c] - seen[c]) / std::max(1.0F, seen[c])));
    }
  }
  return most;
}

TEST(ThroughGlass, CompositesEqualRendersBeforeTheColor) {
  constexpr double kRounding = 1e-4;  // of sums of float alphas
  for (const std::string_view integrator : supporting()) {
    for (const float roughness : {0.0F, core::kClearRoughness, 0.3F}) {
      if (roughness > core::kClearRoughness && integrator != "path") {
        continue;  // opaque for all alike
      }
      const core::View view = view_of(shop(roughness), integrator);
      const Picture clear = before(view, BackgroundType::kTransparent, {});
      for (const Rgb color : {Rgb(1), Rgb{0.1F, 0.3F, 0.6F}}) {
        const Picture colored = before(view, BackgroundType::kColor, color);
        EXPECT_LT(farthest(clear, colored, color), kRounding) << integrator << " " << roughness;
      }
      const Picture opaque = before(view, BackgroundType::kTransparent, {}, false);
      const Picture white = before(view, BackgroundType::kColor, Rgb(1));
      if (roughness <= core::kClearRoughness && integrator != "direct") {
        EXPECT_GT(farthest(opaque, white, Rgb(1)), 0.1) << integrator << ": the planted fault";
      }
    }
  }
}

/// Before a colour that equals the environment everywhere, clear glass shows the same with and
/// without: no light is lost or counted twice.
TEST(ThroughGlass, ABackgroundLikeTheEnvironmentChangesNothing) {
  for (const std::string_view integrator : supporting()) {
    for (const float roughness : {0.0F, 0.05F, core::kClearRoughness}) {
      core::View view = view_of(shop(roughness), integrator);
      view.environment = test_support::constant_sky(Rgb(1));
      view.settings.seed = 1;
      const Picture with = before(view, BackgroundType::kColor, Rgb(1));
      view.settings.seed = 2;
      const Picture without = before(view, BackgroundType::kEnvironment, {}, false);
      const auto mean = static_cast<double>(with.mean().g);
      const double apart = mean - static_cast<double>(without.mean().g);
      // Images that are consistent only have noise in common with their halves.
      const double error = std::hypot(static_cast<double>(with.standard_error().g),
                                      static_cast<double>(without.standard_error().g)) +
                           2e-4;
      EXPECT_LT(std::fabs(apart), 5 * error) << integrator << " " << roughness << " " << mean;
      EXPECT_GT(0.02 * mean, 5 * error) << integrator << ": two percent would be seen";
    }
  }
}

/// Seen from the front, each face of a wall of index 1.5 reflects 4%, both 2 F / (1 + F).
TEST(ThroughGlass, AlphaOfAClearPaneIsWhatItReflects) {
  core::MaterialDescription pane = glass(0, 0);
  pane.base_color = {1, 1, 1};
  core::View view = view_of(scene_of({pane}, {quad({-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 0)}), "path");
  test_support::look_at(view, {0, 0, 4}, {0, 0, 0}, 1);
  const Picture picture = before(view, BackgroundType::kTransparent, {});
  double alpha = 0;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    alpha += static_cast<double>(core::pixel_value(picture.snapshot, i).alpha);
  }
  alpha /= static_cast<double>(picture.snapshot.pixel_count());
  // 9216 paths, of which 8% reflect: a standard deviation of 0.003 without stratification.
  EXPECT_NEAR(alpha, 0.08 / 1.04, 0.01);
}

TEST(ThroughGlass, IsRefusedByIntegratorsThatCannot) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    core::View view = view_of(shop(0), row.name);
    view.settings.background = {BackgroundType::kTransparent, {}, true};
    const auto renderer = test_support::settled_renderer(std::move(view));
    EXPECT_EQ(static_cast<bool>(renderer), core::accepts(row, core::kThroughGlass)) << row.name;
    if (!renderer) {
      EXPECT_EQ(renderer.error().where, core::kThroughGlass);
    }
  }
}

}  // namespace
