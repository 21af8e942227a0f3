// Random requests are read, printed and read again.
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"
#include "core/settings/choices.h"

namespace {

using api::Json;

/// Requests from a seeded generator; every member has some probability.
class RandomRequests {
 public:
  explicit RandomRequests(std::uint32_t seed) : random_(seed) {}

  Json request() {
    Json job = {{"scene", text()}};
    maybe([&] { job["name"] = text(); });
    maybe([&] { job["labels"][text()] = text(); });
    maybe([&] { job["priority"] = integer(-100, 100); });
    maybe([&] { job["seed"] = integer(0, (std::int64_t{1} << 53) - 1); });
    maybe([&] { job["camera"] = camera(); });
    maybe([&] { job["variant"] = text(); });
    maybe([&] { job["time_seconds"] = real(-1e6, 1e6); });
    maybe([&] {
      job["class"] = "preview";
      job["preview_key"] = text();
    });
    maybe([&] { job["environment"] = environment(); });
    maybe([&] { job["film"] = film(); });
    maybe([&] { job["integrator"] = {{"type", "path"}, {"max_depth", integer(0, 1024)}}; });
    maybe([&] { job["estimator"] = estimator(); });
    maybe([&] {
      job["sampler"] = {{"type", name(core::samplers())},
                        {"replicates", 2 * integer(1, 32)},
                        {"first_replicate", 2 * integer(0, 3)}};
    });
    maybe([&] { job["light_sampler"] = {{"type", name(core::light_samplers())}}; });
    maybe([&] { job["light_sampler"] = {{"type", "ris"}, {"candidates", integer(1, 64)}}; });
    maybe([&] {
      job["light_sampler"] = {
          {"type", "restir"}, {"candidates_per_pixel", integer(1, 64)}, {"block", integer(1, 8)}};
    });
    maybe([&] {
      job["light_sampler"] = {
          {"type", "restir"}, {"block", integer(1, 2)}, {"history", integer(1, 16)}};
    });
    maybe([&] { job["stop"] = stop(); });
    if (job.contains("light_sampler") && job["light_sampler"]["type"] == "restir") {
      job.erase("estimator");  // not all members can be combined
    }
    return job;
  }

 private:
  template <typename Do>
  void maybe(const Do& act) {
    if (integer(0, 1) == 1) {
      act();
    }
  }
  std::int64_t integer(std::int64_t min, std::int64_t max) {
    return std::uniform_int_distribution<std::int64_t>(min, max)(random_);
  }
  double real(double min, double max) {
    return std::uniform_real_distribution<double>(min, max)(random_);
  }
  std::string text() {
    static const std::vector<std::string> kPieces = {"a", "Z9", " ", "ß", "日本", "/~\"\\", "😀"};
    std::string out = "t";
    for (std::int64_t i = integer(0, 5); i > 0; --i) {
      out += kPieces[static_cast<std::size_t>(integer(0, 6))];
    }
    return out;
  }
  template <typename Entries>
  std::string name(const Entries& entries) {
    const auto last = static_cast<std::int64_t>(entries.size()) - 1;
    return std::string(entries[static_cast<std::size_t>(integer(0, last))].name);
  }
  Json point() { return Json::array({real(-1e9, 1e9), real(-1, 1), real(-1e-3, 1e-3)}); }
  void calibrate(Json& camera) {
    camera["type"] = "pinhole";
    camera["fx"] = real(1e4, 1e6);
    maybe([&] { camera["fy"] = real(1e4, 1e6); });
    maybe([&] { camera["cx"] = real(-10, 1e3); });
    maybe([&] { camera["cy"] = real(-10, 1e3); });
    maybe([&] {
      camera["distortion"] = {{"model", "opencv"}, {"k", {real(-0.1, 0.1), 0, 0, 0, 0.25}}};
    });
    if (!camera.contains("position")) {
      camera["pose"] = {{"convention", name(core::pose_conventions())},
                        {"matrix", {0, -1, 0, real(-9, 9), 1, 0, 0, 0, 0, 0, 1, 2, 0, 0, 0, 1}}};
    }
  }
  Json camera() {
    Json camera = Json::object();
    maybe([&] { camera["position"] = point(); });
    if (camera.contains("position")) {
      camera["target"] = point();
      camera["up"] = Json::array({0.1, 0.9, 0.3});
    } else {
      maybe([&] { camera["index"] = integer(0, 65535); });
    }
    maybe([&] { camera["vertical_fov_degrees"] = real(0.1, 179); });
    maybe([&] { camera["shift"] = Json::array({real(-1, 1), real(-1, 1)}); });
    if (!camera.contains("vertical_fov_degrees") && !camera.contains("shift")) {
      maybe([&] { calibrate(camera); });
    }
    maybe([&] { camera["aperture_radius"] = real(0, 1); });
    maybe([&] { camera["focus_distance"] = real(0.001, 1e4); });
    return camera;
  }
  Json environment() {
    Json environment = Json::object();
    maybe([&] { environment = nullptr; });
    if (environment.is_object()) {
      maybe([&] { environment["color"] = Json::array({real(0, 1), real(0, 1e3), 0}); });
      maybe([&] { environment["intensity"] = real(0, 1e6); });
      maybe([&] { environment["rotation_degrees"] = real(-720, 720); });
      maybe([&] { environment["visible"] = integer(0, 1) == 1; });
      maybe([&] { environment["asset"] = std::string(64, 'a'); });
      if (!environment.contains("asset")) {
        maybe([&] { environment["preset"] = name(core::environment_presets()); });
      }
      if (!environment.contains("asset") && !environment.contains("preset")) {
        maybe([&] {
          environment["sun"] = {{"latitude", real(-60, 60)},
                                {"longitude", real(-5, 5)},
                                {"time", "2026-03-20T12:00:00.125+00:30"}};
        });
      }
    }
    return environment;
  }
  Json film() {
    Json film = {{"width", integer(10, 8000)}, {"height", integer(10, 8000)}};
    maybe([&] {
      film["crop"] = {{"x", integer(0, 5)}, {"y", integer(0, 5)}, {"width", 5}, {"height", 4}};
    });
    maybe([&] { film["filter"] = {{"type", name(core::filters())}, {"radius", real(0.01, 8)}}; });
    maybe([&] { film["layers"] = Json::array({"normal", "error", "albedo"}); });
    return film;
  }
  Json estimator() {
    Json estimator = Json::object();
    maybe([&] { estimator["strategy"] = name(core::strategies()); });
    if (estimator.value("strategy", "mis") == "mis") {
      maybe([&] { estimator["mis"] = {{"type", "maximum"}}; });
      maybe([&] { estimator["mis"] = {{"type", "power"}, {"exponent", real(1, 16)}}; });
    }
    maybe([&] { estimator["roulette"] = {{"type", name(core::roulette_types())}}; });
    maybe([&] { estimator["roulette"] = {{"type", "threshold"}, {"delta", real(0, 10)}}; });
    maybe([&] { estimator["splitting"] = {{"type", "fixed"}, {"count", integer(1, 64)}}; });
    maybe([&] { estimator["expected_values"] = integer(0, 1) == 1; });
    return estimator;
  }
  Json stop() {
    Json stop = {{"seconds", real(0.001, 604800)}};
    maybe([&] { stop["samples_per_pixel"] = integer(1, 65000); });
    maybe([&] {
      stop["relative_error"] = real(1e-5, 1);
      stop["confidence"] = real(0.5, 0.9999);
      stop["scope"] = integer(0, 1) == 1 ? "image" : "worst_tile";
    });
    maybe([&] {
      stop["deadline"] = "2026-03-04T05:06:07." + std::to_string(integer(0, 999999)) + "+09:30";
    });
    return stop;
  }

  std::mt19937 random_;
};

TEST(JobSpecProperty, RoundTrips) {
  RandomRequests requests(/*seed=*/1);
  for (int i = 0; i < 2000; ++i) {
    const std::string body = api::dump(requests.request());
    const auto once = api::parse_job(body);
    ASSERT_TRUE(once) << body << "\n" << once.problem().detail;
    const std::string printed = api::spec_json(once->spec);
    const auto twice = api::parse_job(printed);
    ASSERT_TRUE(twice) << printed << "\n" << twice.problem().detail;
    EXPECT_EQ(twice->warnings, api::idle_warnings(twice->spec)) << printed;
    EXPECT_TRUE(api::same_spec(once->spec, twice->spec)) << body;
    EXPECT_EQ(api::spec_json(twice->spec), printed);
    // Values without a comparison operator, bit for bit.
    EXPECT_EQ(once->spec.render.film.filter.radius_px, twice->spec.render.film.filter.radius_px);
    EXPECT_EQ(once->spec.camera.position, twice->spec.camera.position);
    EXPECT_EQ(once->spec.environment.color, twice->spec.environment.color);
    EXPECT_EQ(once->spec.stop.deadline_unix_seconds, twice->spec.stop.deadline_unix_seconds);
    EXPECT_EQ(once->spec.stop.relative_error, twice->spec.stop.relative_error);
    EXPECT_EQ(once->spec.time_seconds, twice->spec.time_seconds);
  }
}

}  // namespace
