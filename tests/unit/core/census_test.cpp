// Light that was not found is a function of the job, tested over threads, restarts and places.
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/statistics.h"
#include "core/integrators/registry.h"
#include "core/integrators/rules.h"
#include "core/render/picture/light_not_found.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "core/render/units/slice_work.h"
#include "tests/support/caustic.h"
#include "tests/support/tasks.h"

namespace {

using core::Film;
using core::LightNotFound;
using core::RenderTask;
using test_support::renderer_of;

core::TaskOptions options_of(int samples) {
  core::TaskOptions options = test_support::samples(samples);
  options.counts_particles = true;
  return options;
}

void expect_same(const std::optional<LightNotFound>& a, const std::optional<LightNotFound>& b) {
  ASSERT_TRUE(a && b);
  EXPECT_EQ(a->at_most, b->at_most);
  EXPECT_EQ(a->detected, b->detected);
  EXPECT_EQ(a->particles, b->particles);
  EXPECT_EQ(a->tiles, b->tiles);
  EXPECT_EQ(a->reason, b->reason);
  EXPECT_EQ(a->integrators, b->integrators);
}

std::optional<LightNotFound> rendered(const std::shared_ptr<Film>& film, int samples, int threads) {
  core::NullSink sink;
  RenderTask task(renderer_of(test_support::caustic()), film, options_of(samples), sink);
  core::run_to_end(task, threads);
  return task.progress().light_not_found;
}

std::shared_ptr<Film> film_of() { return make_film(test_support::caustic().settings); }

TEST(LightNotFoundBits, AreIndependentOfThreads) {
  expect_same(rendered(film_of(), 6, 1), rendered(film_of(), 6, 3));
}

TEST(LightNotFoundBits, AreIndependentOfRestarts) {
  const auto film = film_of();
  static_cast<void>(rendered(film, 2, 2));
  expect_same(rendered(film, 6, 2), rendered(film_of(), 6, 2));
}

/// All slices are rendered in other processes, which count no particles.
TEST(LightNotFoundBits, AreIndependentOfPlaces) {
  const auto renderer = renderer_of(test_support::caustic());
  core::NullSink sink;
  RenderTask task(renderer, film_of(), options_of(6), sink);
  while (!task.finished()) {
    if (const auto slice = task.take(RenderTask::Process::kOther)) {
      core::SliceWork work = task.prepare(*slice, 1);
      ASSERT_TRUE(core::render_slice(*renderer, work, {}));
      task.accept(std::move(work));
    }
  }
  expect_same(task.progress().light_not_found, rendered(film_of(), 6, 2));
}

TEST(LightNotFound, IsUnknownWithoutParticles) {
  core::NullSink sink;
  core::TaskOptions options = options_of(4);
  options.counts_particles = false;
  RenderTask task(renderer_of(test_support::caustic()), film_of(), std::move(options), sink);
  core::run_to_end(task, 2);
  EXPECT_FALSE(task.progress().light_not_found);
}

TEST(LightNotFound, EndsAJob) {
  core::View view = test_support::caustic();
  view.settings.integrator = "sppm";
  core::NullSink sink;
  core::TaskOptions options = options_of(64);
  options.stop.light_not_found = 0.5;
  RenderTask task(renderer_of(view), make_film(view.settings), std::move(options), sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(task.stop_reason(), core::StopReason::kLightNotFound);
  EXPECT_LE(task.progress().light_not_found->at_most, 0.5);
}

// Paths find the caustic by chance alone, so it may always be missing; the samples end the job.
TEST(LightNotFound, OutlastsAnErrorTarget) {
  core::NullSink sink;
  core::TaskOptions options = options_of(16);
  options.stop.relative_error = 1;
  options.stop.light_not_found = 1e-5;
  RenderTask task(renderer_of(test_support::caustic()), film_of(), std::move(options), sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(task.stop_reason(), core::StopReason::kSamples);
  EXPECT_GT(task.progress().light_not_found->at_most, 1e-5);
}

TEST(LightNotFound, IsNoRuleWithoutParticles) {
  core::StopRules rules;
  rules.light_not_found = 0.1;
  core::View view = test_support::caustic();
  view.settings.fog.emplace();
  const auto refused = core::settled_renderer(view, rules);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().where, "/stop/light_not_found");
  core::SceneTraits scene;
  EXPECT_TRUE(core::broken_stop_rules(rules, core::RenderSettings(), &scene).empty());
  scene.has_scattering = true;
  EXPECT_FALSE(core::broken_stop_rules(rules, core::RenderSettings(), &scene).empty()) << "media";
}

TEST(LightNotFound, DoesNotChangeTheFilm) {
  const auto with = film_of();
  static_cast<void>(rendered(with, 6, 2));
  const auto without = film_of();
  core::NullSink sink;
  core::TaskOptions options = options_of(6);
  options.counts_particles = false;
  RenderTask task(renderer_of(test_support::caustic()), without, std::move(options), sink);
  core::run_to_end(task, 2);
  EXPECT_EQ(with->digest(), without->digest());
}

TEST(CensusParticles, AreAFractionOfTheSamples) {
  core::RenderSettings settings;
  settings.film.width = settings.film.height = 1000;
  EXPECT_EQ(core::census_particles(settings, 64) % core::kCensusPart, 0);
  EXPECT_NEAR(core::census_particles(settings, 64), 64e6 / 60, core::kCensusPart);
}

// -expm1(log(.05) / n): the rule of three. Clopper and Pearson's table (1934): 1 of 10 is .0025 to
// .4450 at 95 %.
TEST(BinomialLimits, AreThoseOfClopperAndPearson) {
  EXPECT_NEAR(core::binomial_upper(0, 1000, 0.05), 1 - std::pow(0.05, 1e-3), 1e-12);
  EXPECT_EQ(core::binomial_lower(0, 10, 0.025), 0);
  EXPECT_EQ(core::binomial_upper(10, 10, 0.025), 1);
  EXPECT_NEAR(core::binomial_lower(1, 10, 0.025), 0.0025, 5e-5);
  EXPECT_NEAR(core::binomial_upper(1, 10, 0.025), 0.4450, 5e-5);
  // P(X >= 2) of 10 at 1/2: 1 - 11 / 1024.
  EXPECT_NEAR(core::binomial_tail(2, 10, 0.5), 1 - 11.0 / 1024, 1e-12);
}

}  // namespace
