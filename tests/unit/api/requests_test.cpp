#include "api/requests.h"

#include <string>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_checks.h"
#include "api/job/stop_rules.h"
#include "api/json/faults.h"
#include "core/integrators/registry.h"

namespace {

const std::string kHash(64, 'b');
constexpr const char* kUuid = "3f0c9c52-6d0e-4d7b-9a51-0a6f3c1b7e10";

api::JobSpec current_spec() {
  auto parsed = api::parse_job(
      R"({"scene":"x","name":"old","labels":{"a":"1","b":"2"},"priority":3,)"
      R"("stop":{"samples_per_pixel":64,"relative_error":0.05,"scope":"worst_tile"}})");
  EXPECT_TRUE(parsed);
  return parsed->spec;
}

TEST(ErrorTarget, OfDenoisedImagesIsRefusedWhereHalvesShowOnlyNoise) {
  int refused = 0;
  for (const core::IntegratorEntry& row : core::integrators()) {
    const bool has_error = row.error != core::ErrorValidity::kByComparison;
    refused += has_error ? 0 : 1;
    api::JobSpec spec;
    spec.denoise.type = core::DenoiserType::kStatistical;
    spec.render.integrator = row.name;
    for (const bool is_asked : {true, false}) {
      core::StopRules stop;
      stop.samples_per_pixel = 16;
      if (is_asked) {
        stop.denoised_error = 0.1;
      }
      api::Faults faults;
      api::check_error_target(stop, spec, faults);
      EXPECT_EQ(faults.empty(), !is_asked || has_error) << row.name;
    }
  }
  EXPECT_GT(refused, 0);
}

TEST(ErrorTarget, IsAcceptedInRequestsPatchesAndExtensionsByEveryIntegrator) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    const std::string integrator = R"("integrator":{"type":")" + std::string(row.name) + R"("})";
    const char* stop = R"("stop":{"relative_error":0.1})";
    EXPECT_TRUE(api::parse_job(R"({"scene":"x",)" + integrator + "," + stop + "}")) << row.name;
    const auto job = api::parse_job(R"({"scene":"x",)" + integrator + "}");
    ASSERT_TRUE(job) << row.name;
    const std::string body = "{" + std::string(stop) + "}";
    EXPECT_TRUE(api::parse_job_patch(body, job->spec)) << row.name;
    EXPECT_TRUE(api::parse_extend(body, job->spec)) << row.name;
  }
}

TEST(JobPatch, ChangesOnlyTheGivenMembers) {
  const auto patch = api::parse_job_patch(R"({"priority":-5,"name":"new"})", current_spec());
  ASSERT_TRUE(patch);
  api::JobSpec expected = current_spec();
  expected.priority = -5;
  expected.name = "new";
  EXPECT_TRUE(api::same_spec(patch->spec, expected));
  EXPECT_FALSE(patch->paused.has_value());
  EXPECT_FALSE(patch->stop_named);
}

TEST(JobPatch, MergesLabels) {
  const auto patch = api::parse_job_patch(R"({"labels":{"a":null,"c":"3"}})", current_spec());
  ASSERT_TRUE(patch);
  EXPECT_EQ(patch->spec.labels, (std::map<std::string, std::string>{{"b", "2"}, {"c", "3"}}));
}

TEST(JobPatch, MergesStopRules) {
  const auto raised = api::parse_job_patch(R"({"stop":{"samples_per_pixel":128}})", current_spec());
  ASSERT_TRUE(raised);
  EXPECT_TRUE(raised->stop_named);
  EXPECT_EQ(raised->spec.stop.samples_per_pixel, 128);
  EXPECT_EQ(raised->spec.stop.relative_error, 0.05);
  EXPECT_TRUE(raised->spec.stop.worst_tile);
  const auto removed = api::parse_job_patch(R"({"stop":{"relative_error":null}})", current_spec());
  ASSERT_TRUE(removed);
  EXPECT_EQ(api::dump(api::print_stop(removed->spec.stop)), R"({"samples_per_pixel":64})");
}

TEST(JobPatch, RoundsSampleCounts) {
  const auto patch = api::parse_job_patch(R"({"stop":{"samples_per_pixel":63}})", current_spec());
  ASSERT_TRUE(patch);
  EXPECT_EQ(patch->spec.stop.samples_per_pixel, 64);
  EXPECT_EQ(patch->warnings.size(), 1U);
}

TEST(JobPatch, IsJson) {
  EXPECT_EQ(api::parse_job_patch("{", current_spec()).problem().status, 400);
}

TEST(JobPatch, PausesAndResumes) {
  EXPECT_EQ(api::parse_job_patch(R"({"paused":true})", current_spec())->paused, true);
  EXPECT_EQ(api::parse_job_patch(R"({"paused":false})", current_spec())->paused, false);
}

TEST(JobRefusals, SamplesAreNamed) {
  const auto parsed = api::parse_job(R"({"scene": "furnace", "samples": 64})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors[0].pointer, "/samples");
  EXPECT_TRUE(parsed.problem().errors[0].detail.ends_with(
      "; the number of samples is stop.samples_per_pixel"));
}

TEST(Extend, ReplacesTheRules) {
  const auto request = api::parse_extend(R"({"stop":{"samples_per_pixel":127}})", current_spec());
  ASSERT_TRUE(request);
  EXPECT_EQ(request->stop.samples_per_pixel, 128);
  EXPECT_FALSE(request->stop.relative_error.has_value());
  EXPECT_EQ(request->warnings.size(), 1U);
}

TEST(SceneFromAssets, MapsFileNamesToHashes) {
  const auto scene = api::parse_scene_from_assets(R"({"gltf":")" + kHash +
                                                  R"(","files":{"a b.bin":")" + kHash + R"("}})");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->gltf, kHash);
  EXPECT_EQ(scene->files.at("a b.bin"), kHash);
  EXPECT_TRUE(api::parse_scene_from_assets(R"({"gltf":")" + kHash + R"("})"));
}

TEST(Comparison, AcceptsJobsAndAssets) {
  EXPECT_TRUE(
      api::parse_comparison(R"({"a":")" + std::string(kUuid) + R"(","b":")" + kHash + R"("})"));
}

TEST(Merge, AcceptsEachFilmOnce) {
  const std::string id = "\"" + std::string(kUuid) + "\"";
  EXPECT_TRUE(api::parse_merge(R"({"films":[)" + id + ",\"" + kHash + "\"]}"));
}

TEST(Ids, AreDistinguished) {
  EXPECT_TRUE(api::is_uuid(kUuid));
  EXPECT_TRUE(api::is_uuid("3F0C9C52-6D0E-4D7B-9A51-0A6F3C1B7E10"));
  EXPECT_FALSE(api::is_uuid("3f0c9c526d0e4d7b9a510a6f3c1b7e10"));
  EXPECT_FALSE(api::is_uuid("3f0c9c52-6d0e-4d7b-9a51-0a6f3c1b7e1g"));
  EXPECT_TRUE(api::is_sha256(kHash));
  EXPECT_FALSE(api::is_sha256(std::string(64, 'B')));
  EXPECT_FALSE(api::is_sha256(std::string(63, 'b')));
}

}  // namespace
