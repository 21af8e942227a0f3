#include "api/answers/job_view.h"

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/answers/job_text.h"
#include "api/answers/views.h"
#include "api/job/examples.h"
#include "api/json/errors.h"
#include "core/base/statistics.h"
#include "tests/support/enumerators.h"

namespace {

using api::Json;
using test_support::enumerators;

Json parsed(const std::string& text) { return Json::parse(text); }

std::vector<std::string> keys(const Json& object) {
  std::vector<std::string> names;
  for (const auto& member : object.items()) {
    names.push_back(member.key());
  }
  return names;
}

TEST(JobView, HasTheDocumentedMembers) {
  const Json job = parsed(api::job_json(api::example_job()));
  EXPECT_EQ(keys(job), (std::vector<std::string>{"id",
                                                 "state",
                                                 "pause_reason",
                                                 "stop_reason",
                                                 "created_at",
                                                 "started_at",
                                                 "finished_at",
                                                 "spec",
                                                 "progress",
                                                 "error",
                                                 "light_not_found",
                                                 "failure",
                                                 "queue_position",
                                                 "statistics",
                                                 "revision",
                                                 "available",
                                                 "film_digest",
                                                 "denoised",
                                                 "denoising",
                                                 "doubted",
                                                 "merged",
                                                 "warnings",
                                                 "warning_details",
                                                 "links"}));
  EXPECT_EQ(keys(job["progress"]),
            (std::vector<std::string>{"fraction", "samples_per_pixel", "elapsed_seconds",
                                      "cpu_seconds", "eta_seconds", "eta_interval_seconds"}));
  EXPECT_EQ(keys(job["statistics"]),
            (std::vector<std::string>{"rays", "rays_per_second", "efficiency", "efficiency_low",
                                      "efficiency_high", "rejected_samples", "peak_bytes",
                                      "split_count", "radius_ratio"}));
  EXPECT_EQ(job["created_at"], "2026-01-01T00:00:00.000Z");
  EXPECT_EQ(job["started_at"], "2026-01-01T00:00:00.250Z");
  EXPECT_EQ(job["state"], "rendering");
  EXPECT_EQ(job["links"]["image"], "/v1/jobs/3f0c9c52-6d0e-4d7b-9a51-0a6f3c1b7e10/image");
}

TEST(JobView, HasTheSameTextWithAGivenSpec) {
  const api::JobView job = api::example_job();
  const std::string text = api::dump(api::job_view().print(job));
  EXPECT_EQ(api::job_json(job), text);
  EXPECT_EQ(api::job_json(job, api::spec_json(job.spec)), text);
}

TEST(JobView, WritesNullForUnknownValues) {
  api::JobView job;
  job.spec.scene = "x";
  const Json body = parsed(api::job_json(job));
  for (const char* pointer :
       {"/pause_reason", "/stop_reason", "/started_at", "/finished_at", "/failure",
        "/queue_position", "/film_digest", "/error/relative", "/error/low", "/error/high",
        "/statistics/efficiency", "/statistics/efficiency_low", "/statistics/efficiency_high",
        "/statistics/peak_bytes", "/progress/eta_seconds", "/progress/eta_interval_seconds"}) {
    EXPECT_TRUE(body.at(Json::json_pointer(pointer)).is_null()) << pointer;
  }
}

TEST(JobView, ShowsTheReasonOfAPause) {
  api::JobView job;
  job.spec.scene = "x";
  job.state = api::JobState::kPaused;
  job.pause_reason = api::PauseReason::kRequested;
  const std::string asked = api::job_etag(job);
  EXPECT_EQ(parsed(api::job_json(job))["pause_reason"], "requested");
  job.pause_reason = api::PauseReason::kStorageFull;
  EXPECT_EQ(parsed(api::job_json(job))["pause_reason"], "storage_full");
  EXPECT_NE(api::job_etag(job), asked);
  EXPECT_EQ(api::etag_spec_version(api::job_etag(job)), 1U);
}

// The halves of a biased image do not show its error; comparison with unbiased images does.
TEST(JobView, SharesOfTheLightHaveNoExponent) {
  EXPECT_EQ(api::share_words(1), "100%");
  EXPECT_EQ(api::share_words(0.996), "100%");
  EXPECT_EQ(api::share_words(0.125), "12%");
  EXPECT_EQ(api::share_words(0.0996), "10%");
  EXPECT_EQ(api::share_words(0.00213), "0.21%");
  EXPECT_EQ(api::share_words(2e-6), "0.0002%");
  EXPECT_EQ(api::share_words(1e-9), "less than 0.0001%");
}

TEST(JobView, InvalidErrorHasNoInterval) {
  for (const bool valid : {true, false}) {
    api::JobView job = api::example_job();
    job.spec.render.integrator = valid ? "path" : "sppm";
    EXPECT_EQ(parsed(api::job_json(job))["error"]["valid"], valid);
    job.spec.render.integrator = "sppm";
    job.progress.error = core::error_interval(
        0.08, 0.01, 0.005, valid ? core::ErrorForm::kSquares : core::ErrorForm::kHalves);
    const Json error = parsed(api::job_json(job))["error"];
    EXPECT_EQ(error["valid"], valid);
    EXPECT_EQ(error["low"].is_null(), !valid);
    EXPECT_EQ(error["high"].is_null(), !valid);
    EXPECT_FALSE(error["relative"].is_null());
    EXPECT_EQ(error["relative_rmse"], error["relative"]) << "the name of version 1.0";
    for (const char* name : {"grain", "doubt", "unreliable", "confidence", "bias"}) {
      EXPECT_TRUE(error.contains(name)) << name;
    }
  }
}

TEST(JobView, ShowsTheShrunkRadiusOfSppmAlone) {
  api::JobView job = api::example_job();
  const auto ratio = [&job] { return parsed(api::job_json(job))["statistics"]["radius_ratio"]; };
  job.spec.render.replicates = 2;
  job.spec.render.photons.alpha = 0.5F;
  job.progress.samples_max = 5;
  for (const char* other : {"path", "photon-map"}) {
    job.spec.render.integrator = other;
    EXPECT_TRUE(ratio().is_null()) << other;
  }
  job.spec.render.integrator = "sppm";
  // Knaus and Zwicker 2011, eq. 15, at the third sample of a replicate.
  EXPECT_DOUBLE_EQ(ratio().get<double>(), std::sqrt(1.5 / 2 * 2.5 / 3));
  job.progress.samples_max = 0;
  EXPECT_TRUE(ratio().is_null());
}

TEST(JobView, LinksTheMeterOfAJobThatHasOne) {
  api::JobView job = api::example_job();
  EXPECT_FALSE(parsed(api::job_json(job))["links"].contains("meter"));
  job.spec.render.meter.points.push_back({{0, 0, 0}, {0, 1, 0}});
  EXPECT_EQ(parsed(api::job_json(job))["links"]["meter"],
            "/v1/jobs/3f0c9c52-6d0e-4d7b-9a51-0a6f3c1b7e10/meter");
}

TEST(JobView, FractionIsOneOnlyAtTheEnd) {
  api::JobView job = api::example_job();
  job.progress.fraction = 1;
  EXPECT_LT(parsed(api::job_json(job))["progress"]["fraction"].get<double>(), 1);
  job.state = api::JobState::kFinished;
  job.progress.fraction = 0.4;  // the error target was met early
  EXPECT_EQ(parsed(api::job_json(job))["progress"]["fraction"], 1);
}

TEST(JobView, JobEndedByItsErrorReportsAConsistentOne) {
  api::JobView job = api::example_job();
  EXPECT_EQ(parsed(api::job_json(job))["error"]["bias"], "none");
  job.stop_reason = core::StopReason::kRelativeError;
  EXPECT_EQ(parsed(api::job_json(job))["error"]["bias"], "consistent");
}

TEST(JobView, ShowsTheProblemOfAFailure) {
  api::JobView job = api::example_job();
  job.state = api::JobState::kFailed;
  job.failure =
      api::from_error({core::ErrorCode::kInvalidArgument, "no such camera", "/camera/name"});
  const Json failure = parsed(api::job_json(job))["failure"];
  EXPECT_EQ(failure["status"], 422);
  EXPECT_EQ(failure["errors"][0]["pointer"], "/camera/name");
}

TEST(JobEtag, CoversStateSpecAndRevision) {
  const api::JobView job = api::example_job();
  EXPECT_EQ(api::job_etag(job), "\"s1-r2040-rendering-w1\"") << "it has a warning";
  api::JobView other = job;
  other.state = api::JobState::kPaused;
  EXPECT_NE(api::job_etag(other), api::job_etag(job));
  other = job;
  other.warnings.emplace_back("It may be wrong.");
  EXPECT_NE(api::job_etag(other), api::job_etag(job)) << "after the end too";
  other = job;
  other.denoised = api::DenoisedView{};
  EXPECT_NE(api::job_etag(other), api::job_etag(job));
  EXPECT_TRUE(api::etag_spec_version(api::job_etag(other)));
}

TEST(JobEtag, ReturnsTheSpecVersion) {
  EXPECT_EQ(api::etag_spec_version("\"s12-r2040-rendering\""), 12U);
  EXPECT_EQ(api::etag_spec_version("W/\"s12-r2040-rendering\""), 12U);
  for (const char* text :
       {"", "*", "\"abc\"", "\"s-r1-x\"", "\"s1\"", "s1-r1-x", "\"s99999999999-r1-x\""}) {
    EXPECT_FALSE(api::etag_spec_version(text).has_value()) << text;
  }
}

TEST(JobList, ContainsTheCursor) {
  const std::vector<api::JobView> jobs = {api::example_job()};
  const Json list = parsed(api::job_list_json(jobs, {}, "abc"));
  EXPECT_EQ(list["jobs"].size(), 1U);
  EXPECT_EQ(list["next"], "abc");
  EXPECT_TRUE(parsed(api::job_list_json({}, {}, std::nullopt))["next"].is_null());
}

TEST(StateNames, RoundTrip) {
  for (const auto state : enumerators<api::JobState>()) {
    EXPECT_EQ(api::job_state_from_text(api::to_text(state)), state);
    EXPECT_FALSE(api::to_text(state).empty());
  }
  for (const auto reason : enumerators<core::StopReason>()) {
    EXPECT_EQ(api::stop_reason_from_text(api::to_text(reason)), reason);
    EXPECT_EQ(api::to_text(reason).empty(), reason == core::StopReason::kNone);
  }
  for (const auto reason : enumerators<api::PauseReason>()) {
    EXPECT_EQ(api::pause_reason_from_text(api::to_text(reason)), reason);
    EXPECT_EQ(api::to_text(reason).empty(), reason == api::PauseReason::kNone);
  }
  EXPECT_EQ(api::to_text(core::StopReason::kSamples), "samples_per_pixel");
  EXPECT_EQ(api::to_text(core::StopReason::kRelativeError), "relative_error");
  EXPECT_EQ(api::to_text(core::StopReason::kDenoisedError), "denoised_error");
  EXPECT_EQ(api::to_text(core::StopReason::kFailed), "failed");
  EXPECT_EQ(api::to_text(core::StopReason::kLimit), "limit");
  EXPECT_FALSE(api::job_state_from_text("done").has_value());
}

std::vector<core::ConvergencePoint> points_of(const std::vector<std::pair<int, double>>& values) {
  std::vector<core::ConvergencePoint> points;
  for (const auto& [samples, error] : values) {
    core::ConvergencePoint point;
    point.samples_per_pixel = samples;
    point.error.relative = error;
    points.push_back(point);
  }
  return points;
}

TEST(Slope, OfAPowerLawIsItsExponent) {
  std::vector<std::pair<int, double>> values;
  for (int n = 1; n <= 1024; n *= 2) {
    values.emplace_back(n, 3 * std::pow(n, -0.5));
  }
  const api::Slope slope = api::fit_slope(points_of(values));
  EXPECT_NEAR(slope.value, -0.5, 1e-12);
  EXPECT_NEAR(slope.low, -0.5, 1e-6);
  EXPECT_NEAR(slope.high, -0.5, 1e-6);
}

TEST(Slope, HasStudentsInterval) {
  // x = 0, 1, 2 (in log 2), y = 0, 0, 3: slope 1.5, residuals 0.5, -1, 0.5, so its standard error
  // is sqrt(1.5 / 1 / 2) = 0.8660, times t(1, 0.975) = 12.7062: 11.0039. In natural logs y is in
  // units of log 2.
  const double ln2 = std::log(2.0);
  const api::Slope slope = api::fit_slope(points_of({{1, 1.0}, {2, 1.0}, {4, std::exp(3 * ln2)}}));
  EXPECT_NEAR(slope.value, 1.5, 1e-12);
  EXPECT_NEAR(slope.high - slope.value, 11.0039, 1e-3);
  EXPECT_NEAR(slope.value - slope.low, 11.0039, 1e-3);
}

// The quantile has another implementation in core, which has its own closed forms. Here: a table of
// four decimals up to 10 degrees of freedom, an expansion beyond.
TEST(Slope, HasStudentsIntervalForEveryNumberOfPoints) {
  for (int points = 3; points <= 64; ++points) {
    std::vector<std::pair<int, double>> values;
    double mean_x = 0;
    double mean_y = 0;
    for (int i = 0; i < points; ++i) {
      values.emplace_back(i + 1, std::exp(i % 4 == 1 || i % 4 == 2 ? -0.1 : 0.1));
      mean_x += std::log(values.back().first) / points;
      mean_y += std::log(values.back().second) / points;
    }
    double xx = 0;
    double xy = 0;
    double yy = 0;
    for (const auto& [n, error] : values) {
      const double x = std::log(n) - mean_x;
      const double y = std::log(error) - mean_y;
      xx += x * x;
      xy += x * y;
      yy += y * y;
    }
    const double standard_error = std::sqrt((yy - xy * xy / xx) / (points - 2) / xx);
    const api::Slope slope = api::fit_slope(points_of(values));
    EXPECT_NEAR((slope.high - slope.value) / standard_error,
                core::student_t_quantile(0.975, points - 2), 2e-4)
        << points;
  }
}

TEST(Slope, IgnoresUnknownErrorsAndReportsTooFewPoints) {
  const double nan = std::nan("");
  const api::Slope two = api::fit_slope(points_of({{1, nan}, {2, 1.0}, {8, 0.5}, {16, 0.0}}));
  EXPECT_NEAR(two.value, -0.5, 1e-12);
  EXPECT_TRUE(std::isnan(two.low));
  EXPECT_TRUE(std::isnan(api::fit_slope(points_of({{1, 1.0}})).value));
  EXPECT_TRUE(std::isnan(api::fit_slope({}).value));
  const Json body = parsed(api::convergence_json(points_of({{1, nan}})));
  EXPECT_TRUE(body["points"][0]["relative"].is_null());
  EXPECT_TRUE(body["slope"]["value"].is_null());
}

TEST(SceneView, ShowsBoundsCamerasAndLights) {
  core::SceneSummary summary;
  summary.name = "s";
  summary.bounds.add(core::Vec3{-1, 0, 0.1F});
  summary.bounds.add(core::Vec3{1, 2, 3});
  core::CameraDescription& camera = summary.cameras.emplace_back();
  camera.name = "front";
  // A quarter turn around y, looking along +x, in a node scaled by 2.
  camera.to_world = {{0, 0, 2}, {0, 2, 0}, {-2, 0, 0}, {-3, 1, 0.5F}};
  summary.lights.emplace_back().type = core::PunctualType::kSpot;
  const Json scene = parsed(api::scene_json("id", summary));
  EXPECT_EQ(api::dump(scene["bounds"]), R"({"min":[-1,0,0.1],"max":[1,2,3]})");
  EXPECT_EQ(scene["cameras"][0]["name"], "front");
  EXPECT_NEAR(scene["cameras"][0]["vertical_fov_degrees"].get<double>(), 45, 1e-4);
  EXPECT_EQ(api::dump(scene["cameras"][0]["position"]), "[-3,1,0.5]");
  EXPECT_EQ(scene["cameras"][0]["direction"][0], 1);
  EXPECT_EQ(scene["cameras"][0]["up"][1], 1);
  EXPECT_EQ(scene["lights"][0]["type"], "spot");
  EXPECT_TRUE(parsed(api::scene_json("id", core::SceneSummary{}))["bounds"].is_null());
}

TEST(SceneView, OfAKnownFileSaysThatItKeepsItsName) {
  core::SceneSummary summary;
  summary.name = "red chair";
  const std::string scene = api::scene_json("id", summary);
  EXPECT_EQ(api::known_scene_json(scene, "red chair"), scene);
  const Json other = parsed(api::known_scene_json(scene, "chair"));
  EXPECT_EQ(other["name"], "red chair");
  const std::string kept = "the file is known as \"red chair\", and keeps this name";
  EXPECT_EQ(other["warnings"], Json({kept}));
  EXPECT_EQ(other["warning_details"],
            Json::array({{{"code", "name"}, {"pointer", ""}, {"detail", kept}}}));
}

TEST(SceneList, ConcatenatesTexts) {
  const std::vector<std::string> scenes = {R"({"id":"a"})", R"({"id":"b"})"};
  EXPECT_EQ(api::scene_list_json(scenes, "n\"x"),
            R"({"scenes":[{"id":"a"},{"id":"b"}],"next":"n\"x"})");
  EXPECT_EQ(api::scene_list_json({}, std::nullopt), R"({"scenes":[],"next":null})");
}

TEST(PixelView, WritesNullForUnknownIntervals) {
  const double nan = std::nan("");
  api::PixelView pixel;
  pixel.layers.push_back({"depth", {2.5}, {nan}, {nan}, {nan}, {}});
  EXPECT_EQ(api::pixel_json(pixel),
            R"({"x":0,"y":0,"samples":0,"layers":{"depth":{"mean":[2.5],"standard_error":[null],)"
            R"("low":[null],"high":[null],"halves":null}}})");
}

TEST(ComparisonView, HasTheDocumentedMembers) {
  api::ComparisonView comparison;
  comparison.id = "c";
  comparison.a = "01234567-89ab-cdef-0123-456789abcdef";
  comparison.b = std::string(64, '0');
  EXPECT_EQ(
      api::comparison_json(comparison),
      R"({"id":"c","mse":0,"relmse":0,"flip":0,"bias":{"value":0,"low":0,"high":0},)"
      R"("z":{"mean":0,"variance":0,"share_above_3":0},"links":{"self":"/v1/comparisons/c",)"
      R"("difference":"/v1/comparisons/c/difference.png","z":"/v1/comparisons/c/z.png",)"
      R"("flip":"/v1/comparisons/c/flip.png","a":"/v1/jobs/01234567-89ab-cdef-0123-456789abcdef",)"
      R"("b":"/v1/assets/0000000000000000000000000000000000000000000000000000000000000000"}})");
}

}  // namespace
