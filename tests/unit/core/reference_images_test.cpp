// The images that biased ones are compared with: their counts, and errors that are a function of
// the job.
#include "core/render/task/reference_images.h"

#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/render/task/settle.h"
#include "tests/support/scenes.h"
#include "tests/support/tasks.h"

namespace {

using test_support::renderer_of;
using test_support::samples;

core::View small_view(std::string_view integrator) {
  core::View view = test_support::cornell_view(40, 36, 35);
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(integrator);
  view.settings.film = film;
  view.settings.max_depth = 3;
  view.settings.photons.paths = 500;
  view.settings.cache.rays = 16;
  view.settings.cache.records = 256;
  return view;
}

struct Rendered {
  std::shared_ptr<core::Film> film;
  core::ErrorInterval error;
};

/// Continues the film, or begins one.
Rendered rendered(const core::View& view, int n, int threads,
                  std::shared_ptr<core::Film> film = nullptr, bool compares = true) {
  Rendered out;
  out.film = film ? std::move(film) : core::make_film(view.settings);
  core::NullSink sink;
  core::TaskOptions options = samples(n);
  options.compares = compares;
  core::RenderTask task(renderer_of(view), out.film, options, sink);
  core::run_to_end(task, threads);
  EXPECT_EQ(task.stop_reason(), core::StopReason::kSamples);
  out.error = task.progress().error;
  return out;
}

TEST(ReferenceImages, HaveAnEighthOfTheSamplesAndAsManyUpToSixteen) {
  for (const auto& [image, references] :
       {std::pair{1, 2}, {2, 2}, {5, 6}, {16, 16}, {64, 16}, {128, 16}, {160, 20}, {1024, 128}}) {
    EXPECT_EQ(core::reference_samples(image), references) << image;
  }
}

TEST(ReferenceImages, BelongToTheIntegratorsWhoseHalvesShowNoiseAlone) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    core::RenderSettings settings;
    settings.integrator = row.name;
    const auto references = core::reference_settings(settings);
    EXPECT_EQ(references.has_value(), row.error == core::ErrorValidity::kByComparison) << row.name;
    EXPECT_EQ(core::reference_bytes(settings) > 0, references.has_value()) << row.name;
    if (references) {
      EXPECT_EQ(core::find_integrator(references->integrator)->bias, "none") << row.name;
      EXPECT_NE(references->seed, settings.seed) << row.name;
    }
  }
}

TEST(ReferenceImages, ErrorIsTheSameForAnyThreadsAndAfterAResume) {
  for (const std::string_view name : {"sppm", "photon-map", "irradiance-cache"}) {
    const core::View view = small_view(name);
    const Rendered whole = rendered(view, 12, 1);
    EXPECT_GT(whole.error.relative, 0) << name;
    EXPECT_LE(whole.error.low, whole.error.relative) << name;
    EXPECT_GE(whole.error.high, whole.error.relative) << name;
    EXPECT_EQ(whole.error.form, core::ErrorForm::kSquares) << name;
    const Rendered threads = rendered(view, 12, 3);
    const Rendered part = rendered(view, 6, 2);
    const Rendered resumed = rendered(view, 12, 2, part.film);
    for (const Rendered& other : {threads, resumed}) {
      EXPECT_EQ(other.film->digest(), whole.film->digest()) << name;
      EXPECT_EQ(other.error.relative, whole.error.relative) << name;
      EXPECT_EQ(other.error.low, whole.error.low) << name;
      EXPECT_EQ(other.error.high, whole.error.high) << name;
    }
  }
}

TEST(ReferenceImages, LeaveTheImageAsItIsAndCountAsItsTime) {
  const core::View view = small_view("sppm");
  const Rendered with = rendered(view, 8, 1);
  const Rendered without = rendered(view, 8, 1, nullptr, false);
  EXPECT_EQ(with.film->digest(), without.film->digest());
  EXPECT_TRUE(std::isnan(without.error.relative)) << "halves alone do not show the error";
  EXPECT_GT(with.film->cpu_seconds_beside(), without.film->cpu_seconds_beside());
}

TEST(ReferenceImages, LetAnErrorTargetEndTheJob) {
  const core::View view = small_view("sppm");
  core::StopRules stop = samples(512).stop;
  stop.relative_error = 0.3;
  const auto picture = test_support::render(view, stop);
  EXPECT_EQ(picture.reason, core::StopReason::kRelativeError);
  EXPECT_LE(picture.progress.error.high, 0.3);
  EXPECT_LT(picture.progress.samples_max, 512);
}

// Panoramas have no splats, so bdpt cannot render them: path does.
TEST(ReferenceImages, AreMadeByPathWhereBdptCannotRenderTheView) {
  core::View view = small_view("sppm");
  view.camera.type = core::CameraType::kPanorama;
  view.camera.vertical_fov_degrees.reset();
  EXPECT_TRUE(std::isfinite(rendered(view, 4, 2).error.high));
}

TEST(ReferenceImages, AreNotLentToOtherMachines) {
  const core::View view = small_view("sppm");
  core::NullSink sink;
  core::RenderTask task(renderer_of(view), core::make_film(view.settings), samples(2), sink);
  bool was_busy = false;
  while (!task.finished()) {
    const bool lends = task.can_lend();
    was_busy = was_busy || !lends;
    if (const auto slice = task.take()) {
      EXPECT_EQ(slice->kind == core::SliceKind::kReference, !lends);
      EXPECT_FALSE(!lends && task.take(core::RenderTask::Process::kOther));
      task.run(*slice);
    }
  }
  EXPECT_TRUE(was_busy);
}

}  // namespace
