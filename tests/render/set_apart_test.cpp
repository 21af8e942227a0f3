// Surfaces that lie on others: no ray passes both, whichever is listed first, and lamps in one
// place shine once (emitters_test.cpp has their closed form).
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/support/scenes.h"

namespace {

using core::AlphaMode;
using core::MaterialDescription;
using core::PrimitiveDescription;
using core::Rgb;

MaterialDescription unlit(Rgb color) {
  MaterialDescription m = test_support::lambert(color);
  m.unlit = true;
  return m;
}

MaterialDescription decal() {
  MaterialDescription m = unlit(Rgb(0));
  m.alpha_mode = AlphaMode::kBlend;
  m.base_alpha = 0.5F;
  return m;
}

PrimitiveDescription square(float half_m, float z, int material) {
  return test_support::quad({-half_m, -half_m, z}, {2 * half_m, 0, 0}, {0, 2 * half_m, 0},
                            material);
}

/// The same with the opposite winding.
PrimitiveDescription back_of(PrimitiveDescription front) {
  for (std::size_t i = 0; i < front.indices.size(); i += 3) {
    std::swap(front.indices[i], front.indices[i + 1]);
  }
  return front;
}

/// Seen along -z under a red sky, from three times the size.
core::View under_red(std::vector<PrimitiveDescription> things, MaterialDescription upper,
                     float size_m) {
  core::View view = test_support::view_of(
      test_support::scene_of({unlit({0, 1, 0}), std::move(upper)}, std::move(things)), 4, 4);
  test_support::look_at(view, {0, 0, 3 * size_m}, {0, 0, 0}, 5);
  view.environment = test_support::constant_sky({1, 0, 0});
  return view;
}

struct Case {
  const char* name;
  PrimitiveDescription wall;
  PrimitiveDescription upper;
  float size_m;
};

std::vector<Case> cases() {
  return {
      {"in one plane", square(1, 0, 0), square(1, 0, 1), 1},
      {"a part of the wall", square(1, 0, 0), square(0.5F, 0, 1), 1},
      {"larger than the wall", square(0.5F, 0, 0), square(0.7F, 0, 1), 0.5F},
      {"large, on a small wall", square(0.05F, 0, 0), square(1, 0, 1), 0.05F},
      {"over a quarter of the wall", test_support::quad({-0.5F, -0.5F, 0}, {2, 0, 0}, {0, 2, 0}, 0),
       test_support::quad({-1.5F, -1.5F, 0}, {2, 0, 0}, {0, 2, 0}, 1), 1},
      {"1 mm above 2 km", square(1000, 0, 0), square(1000, 1e-3F, 1), 1000},
      {"of a ball", test_support::sphere({0, 0, 0}, 1, 16, false, 0),
       test_support::sphere({0, 0, 0}, 1, 16, false, 1), 1},
  };
}

// The planted fault is the image without the wall: a red channel of 1/2, or of the glass nearly 1.
TEST(SetApart, NothingIsSeenThroughAWallThatSomethingLiesOn) {
  for (const Case& c : cases()) {
    for (const bool upper_first : {false, true}) {
      std::vector<PrimitiveDescription> things = {c.wall, c.upper};
      if (upper_first) {
        std::swap(things[0], things[1]);
      }
      core::View decals = under_red(things, decal(), c.size_m);
      core::View panes = under_red(things, test_support::glass(1.5F, 0), c.size_m);
      for (const core::IntegratorEntry& row : core::integrators()) {
        if (row.name == core::kAutomaticIntegrator) {
          continue;
        }
        SCOPED_TRACE(std::string(c.name) + (upper_first ? ", listed first, " : ", ") +
                     std::string(row.name));
        for (core::View* view : {&decals, &panes}) {
          const core::FilmSettings film = view->settings.film;
          view->settings = core::default_settings(row.name);
          view->settings.film = film;
          view->settings.photons.paths = 100;
        }
        const Rgb of_decal = test_support::render(decals, 64).mean();
        EXPECT_EQ(of_decal.r, 0);
        const Rgb of_pane = test_support::render(panes, 64).mean();
        EXPECT_LT(of_pane.r, 0.2F) << "a pane reflects a twelfth";
        if (!row.splats) {  // particles find little of the image
          EXPECT_NEAR(of_decal.g, 0.5, 0.05);
          EXPECT_NEAR(of_pane.g, 0.92, 0.05);
        }
      }
    }
  }
}

// Black at 1/2 over black at 1/2 over green.
TEST(SetApart, EachOfTwoDecalsInOnePlaceCounts) {
  core::View view = under_red({square(1, 0, 1), square(1, 0, 0), square(1, 0, 1)}, decal(), 1);
  EXPECT_NEAR(test_support::render(view, 256).mean().g, 0.25, 0.02);
}

// A decal of one sheet, and its back as another, above a wall.
TEST(SetApart, SheetsBackToBackAreOne) {
  const PrimitiveDescription back = back_of(square(1, 0, 1));
  core::View view = under_red({square(1, 0, 1), back, square(1, -1, 0)}, decal(), 1);
  EXPECT_NEAR(test_support::render(view, 256).mean().g, 0.5, 0.02);
}

// The second instance of the decal lies on the wall.
TEST(SetApart, LooksAtEachInstance) {
  core::SceneDescription scene =
      test_support::scene_of({unlit({0, 1, 0}), decal()}, {square(1, 0, 0)});
  scene.meshes.push_back({"", {square(0.5F, 0, 1)}});
  for (const float x : {9.0F, 0.0F}) {
    core::InstanceDescription instance;
    instance.mesh = 1;
    instance.to_world = core::translation({x, 0, 0});
    scene.instances.push_back(instance);
  }
  core::View view = test_support::view_of(std::move(scene), 4, 4);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 5);
  view.environment = test_support::constant_sky({1, 0, 0});
  const Rgb seen = test_support::render(view, 256).mean();
  EXPECT_EQ(seen.r, 0);
  EXPECT_NEAR(seen.g, 0.5, 0.03);
}

// Both faces of a lamp as two meshes, the back first.
TEST(SetApart, FacesOfALampInOnePlaceEmitToTheirSides) {
  const PrimitiveDescription back = back_of(square(1, 0, 0));
  for (const float side : {-1.0F, 1.0F}) {
    core::View view = test_support::view_of(
        test_support::scene_of({test_support::emitter(Rgb(1))}, {back, square(1, 0, 0)}), 4, 4);
    test_support::look_at(view, {0, 0, 3 * side}, {0, 0, 0}, 5);
    EXPECT_EQ(test_support::render(view, 4).mean().g, 1) << side;
  }
}

// What lies on nothing stays where it is.
TEST(SetApart, SurfacesAtADistanceStay) {
  const auto built = test_support::build(test_support::scene_of(
      {unlit({0, 1, 0}), decal()}, {square(1, 0, 0), square(1, 1e-5F, 1),
                                    test_support::quad({0, 0, 0}, {1, 0, 0}, {0, 0, 1}, 1)}));
  EXPECT_EQ(built->data().meshes[1].positions[0].z, 1e-5F);
  EXPECT_EQ(built->data().meshes[2].positions[0].z, 0);
}

}  // namespace
