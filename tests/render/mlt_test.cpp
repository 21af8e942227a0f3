// Metropolis light transport beyond its agreement with path tracing (agreement_test.cpp): closed
// forms, and films that are independent of the scheduling of chains.
#include <cmath>

#include "core/integrators/registry.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "tests/render/truth.h"
#include "tests/support/caustic.h"
#include "tests/support/tasks.h"

namespace {

using core::Rgb;
using test_support::expect_truth;

// Truth 1: L = L_e / (1 - rho) = 1, and 1 - rho^(k + 1) at depth k. Directly visible emission needs
// no chains: depth 0 is exact.
TEST(Metropolis, ClosedSphereHasRadianceOne) {
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(0.5F);
  core::View view = test_support::view_of(
      test_support::scene_of({lamp}, {test_support::sphere({0, 0, 0}, 1, 8, true, 0)}), 24, 24);
  test_support::look_at(view, {0.1F, 0.2F, 0.3F}, {1, 0.1F, -0.4F}, 70);
  view.settings.integrator = "mlt";
  for (const int depth : {0, 1, 2, 32}) {
    view.settings.max_depth = depth;
    expect_truth(test_support::render(view, 64), 1 - std::pow(0.5, depth + 1), 4e-3,
                 "depth " + std::to_string(depth));
  }
}

core::View caustic_view() {
  core::View view = test_support::caustic();
  view.settings.film.width = 72;
  view.settings.film.height = 40;
  view.settings.integrator = "mlt";
  return view;
}

TEST(Metropolis, CropEqualsTheCropOfTheFullImage) {
  core::View view = caustic_view();
  view.settings.film.filter = {core::FilterType::kMitchell, 2};
  const auto full = test_support::render(view, 2).film;
  view.settings.film.crop = core::PixelRect{40, 10, 20, 25};
  const auto crop = test_support::render(view, 2).film;
  const core::FilmSnapshot a = full->snapshot(*view.settings.film.crop);
  const core::FilmSnapshot b = crop->snapshot();
  double light = 0;
  for (std::size_t i = 0; i < b.pixels.size(); ++i) {
    ASSERT_EQ(a.pixels[i].mean_r, b.pixels[i].mean_r) << i;
    light += static_cast<double>(b.pixels[i].mean_r);
  }
  EXPECT_GT(light, 0);
}

TEST(Metropolis, FilmsAreIndependentOfRestartsAndThreads) {
  core::View view = caustic_view();
  const std::string calm = test_support::render(view, 4, 1).film->digest();
  EXPECT_EQ(test_support::render(view, 4, 3).film->digest(), calm);
  const auto renderer = test_support::renderer_of(view);
  const core::TaskOptions options = test_support::samples(4, 1e-4);
  for (int taken = 3; taken < 30; taken += 9) {
    const auto film = core::make_film(view.settings);
    core::NullSink sink;
    core::RenderTask task(renderer, film, options, sink);
    test_support::run_slices(task, taken);
    const auto again = test_support::restored(*film);
    core::RenderTask rest(renderer, again, options, sink);
    core::run_to_end(rest, 3);
    EXPECT_EQ(again->digest(), calm) << taken;
  }
  // The planted fault: another seed gives another film.
  view.settings.seed = 1;
  EXPECT_NE(test_support::render(view, 4, 1).film->digest(), calm);
}

}  // namespace
