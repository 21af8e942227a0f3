// Jobs that stop at an error target: the true error is at most the target in `confidence` of the
// runs that are not flagged as unreliable.
#include <algorithm>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/task/render_task.h"
#include "tests/support/caustic.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;

core::View room() {
  core::View view = test_support::cornell_view(48, 48, 40);
  view.settings.max_depth = 4;
  return view;
}

core::View sky_and_ball() {
  core::MaterialDescription metal;
  metal.metallic = 1;
  metal.roughness = 0.3F;
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(0.6F)), metal},
                             {test_support::quad({-4, 0, 4}, {8, 0, 0}, {0, 0, -8}, 0),
                              test_support::sphere({0, 0.6F, 0}, 0.6F, 16, false, 1)}),
      48, 48);
  test_support::look_at(view, {0, 1, 3}, {0, 0.5F, 0}, 45);
  view.environment = test_support::sky_map(
      32, 16, [](int x, int y) { return x == 5 && y == 4 ? Rgb(60) : Rgb(0.4F); });
  view.settings.max_depth = 4;
  return view;
}

/// Emitters of about a pixel in front of a wall: samples at the tail of the reconstruction filter
/// hit them once in thousands.
core::View small_lamps() {
  std::vector<core::PrimitiveDescription> parts = {
      test_support::quad({-2, -2, -1}, {4, 0, 0}, {0, 4, 0}, 0)};
  for (int i = 0; i < 9; ++i) {
    const float x = -0.6F + 0.61F * static_cast<float>(i % 3);
    const float y = -0.6F + 0.57F * static_cast<float>(i / 3);
    parts.push_back(test_support::quad({x, y, 0}, {0.05F, 0, 0}, {0, 0.05F, 0}, 1));
  }
  core::View view = test_support::view_of(
      test_support::scene_of({test_support::lambert(Rgb(0.5F)), test_support::emitter(Rgb(300))},
                             std::move(parts)),
      48, 48);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 40);
  view.settings.max_depth = 2;
  return view;
}

constexpr int kSeeds = 19;

struct Targets {
  int runs = 0;       ///< not flagged as unreliable
  int met = 0;        ///< number of these that meet the target
  int met_twice = 0;  ///< the planted fault: the same if the true errors are twice as large
  double most = 0;    ///< ratio of true error to target
  double samples = 0;
};

/// A view with its expected values.
struct Scene {
  core::View view;
  double error = 0;  ///< at 32 samples
  test_support::Truth truth;

  explicit Scene(core::View seen) : view(std::move(seen)) {
    view.settings.seed = 999;
    error = test_support::render(view, 32).progress.error.relative;
    core::View plain = view;
    plain.settings.adaptive.type = core::AdaptiveType::kNone;
    truth = test_support::truth_of(test_support::render(plain, 2048).snapshot);
  }
};

/// share: ratio of the target to the error at 32 samples.
Targets run(const Scene& scene, double share) {
  core::View view = scene.view;
  const double target = share * scene.error;
  std::vector<double> ratios;
  Targets out;
  for (int i = 0; i < kSeeds; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    core::StopRules stop;
    stop.relative_error = target;
    const auto picture = test_support::render(view, stop);
    EXPECT_EQ(picture.reason, core::StopReason::kRelativeError);
    const double off = test_support::defined_error(picture.snapshot, scene.truth);
    ratios.push_back(off / target);
    out.runs += picture.progress.error.unreliable ? 0 : 1;
    out.met += !picture.progress.error.unreliable && off <= target ? 1 : 0;
    out.met_twice += !picture.progress.error.unreliable && 2 * off <= target ? 1 : 0;
    out.samples += picture.progress.samples_mean / kSeeds;
  }
  std::sort(ratios.begin(), ratios.end());
  out.most = ratios.back();
  std::printf(
      "    target %.3f: met by %d of %d runs, %d unreliable; true error over target: median %.2f, "
      "most %.2f; %.0f samples\n",
      target, out.met, out.runs, kSeeds - out.runs, ratios[ratios.size() / 2], out.most,
      out.samples);
  return out;
}

// Of 19 runs that meet the target with probability 0.95, more than 3 miss it in 1.3% of cases
// (binomial); the seeds are fixed. The end of a bracket is met more often; that tasks stop by the
// end of their confidence is tested in closed form (tests/unit/core/render_task_target_test.cpp).
bool is_kept(int runs, int met) { return runs == kSeeds && met >= kSeeds - 3; }
bool is_kept(const Targets& t) { return is_kept(t.runs, t.met); }

TEST(ErrorTarget, IsMetInARoom) {
  const Scene scene(room());
  const Targets t = run(scene, 0.7);
  EXPECT_TRUE(is_kept(t));
  EXPECT_FALSE(is_kept(t.runs, t.met_twice)) << "the planted fault: an underestimated error";
  EXPECT_TRUE(is_kept(run(scene, 2))) << "with few samples";
}
TEST(ErrorTarget, IsMetInARoomWithAdaptiveSampling) {
  core::View view = room();
  view.settings.adaptive.type = core::AdaptiveType::kPilot;
  view.settings.adaptive.min_samples = 24;
  const Targets t = run(Scene(view), 0.7);
  EXPECT_TRUE(is_kept(t));
  EXPECT_GT(t.samples, 26) << "sampling was not adaptive";
}
TEST(ErrorTarget, IsMetUnderASky) {
  const Scene scene(sky_and_ball());
  EXPECT_TRUE(is_kept(run(scene, 0.7)));
  EXPECT_TRUE(is_kept(run(scene, 2))) << "with few samples";
}
// About 36 pixels carry the whole error: every run is flagged, and meets the target all the same.
TEST(ErrorTarget, IsMetForSmallEmittersAndFlagged) {
  const Targets t = run(Scene(small_lamps()), 0.7);
  EXPECT_EQ(t.runs, 0);
  EXPECT_LE(t.most, 1);
}
TEST(ErrorTarget, IsMetForCaustics) {
  const Scene scene(test_support::caustic());
  EXPECT_TRUE(is_kept(run(scene, 0.7)));
  EXPECT_TRUE(is_kept(run(scene, 2))) << "with few samples";
}

}  // namespace
