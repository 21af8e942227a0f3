// Every refusal of the job request: exact pointer and message.
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_checks.h"
#include "api/job/job_spec.h"
#include "tests/unit/api/refusals.h"

namespace {

TEST(JobRefusals, HaveThePointerAndTheReason) {
  const auto all = test_support::refusals_in(TESSERA_SOURCE_DIR "/tests/unit/api/job_refusals.txt");
  ASSERT_GT(all.size(), 150U);
  for (const test_support::Refusal& refusal : all) {
    SCOPED_TRACE(refusal.request);
    ASSERT_EQ(refusal.errors.size(), 1U);
    const auto parsed = api::parse_job(R"({"scene":"cornell-box",)" + refusal.request + "}");
    ASSERT_FALSE(parsed);
    EXPECT_EQ(parsed.problem().status, 422);
    EXPECT_EQ(parsed.problem().errors, refusal.errors) << parsed.problem().detail;
  }
}

TEST(ParseJob, AllowsSixteenLabels) {
  nlohmann::json job = {{"scene", "cornell-box"}};
  for (char key = 'a'; key < 'a' + 16; ++key) {
    job["labels"][std::string(1, key)] = "";
  }
  EXPECT_TRUE(api::parse_job(job.dump()));
  job["labels"]["z"] = "";
  const auto parsed = api::parse_job(job.dump());
  ASSERT_FALSE(parsed);
  ASSERT_EQ(parsed.problem().errors.size(), 1U);
  EXPECT_EQ(parsed.problem().errors[0].pointer, "/labels");
}

TEST(ParseJob, RequiresAScene) {
  const auto parsed = api::parse_job("{}");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 422);
  EXPECT_EQ(parsed.problem().errors, (std::vector<api::FieldError>{{"/scene", "is required"}}));
}

TEST(ParseJob, RequiresAnObject) {
  const auto parsed = api::parse_job("[]");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors,
            (std::vector<api::FieldError>{{"", "expected an object, got an array"}}));
}

TEST(ParseJob, ReportsAllFaultsAtOnce) {
  const auto parsed =
      api::parse_job(R"({"scene":"","seed":-1,"film":{"width":0,"colour":1},"stop":{"seconds":-1,)"
                     R"("confidence":2}})");
  ASSERT_FALSE(parsed);
  std::vector<std::string> pointers;
  for (const auto& error : parsed.problem().errors) {
    pointers.push_back(error.pointer);
  }
  EXPECT_EQ(pointers, (std::vector<std::string>{"/scene", "/seed", "/film/colour", "/film/width",
                                                "/stop/confidence", "/stop/seconds"}));
}

TEST(ParseJob, AnswersATooLargeFilmWith413) {
  const auto parsed = api::parse_job(R"({"scene":"x","film":{"width":16384,"height":4096}})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 413);
  EXPECT_EQ(parsed.problem().errors,
            (std::vector<api::FieldError>{
                {"/film", "16384 x 4096 is 67108864 pixels; at most 64000000 are allowed"}}));
  EXPECT_TRUE(api::parse_job(R"({"scene":"x","film":{"width":8000,"height":8000}})"));
}

TEST(ParseJob, AnswersATooLargeFilmWithOtherFaultsWith422) {
  const auto parsed = api::parse_job(
      R"({"scene":"x","camera":{"target":[0,0,0]},"film":{"width":16384,"height":16384}})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 422);
  EXPECT_EQ(parsed.problem().errors.size(), 2U);
}

TEST(ParseJob, AnswersATooLargeBodyWith413) {
  EXPECT_EQ(api::parse_job(std::string((1U << 20U) + 1, ' ')).problem().status, 413);
}

TEST(ParseJob, LimitsTheAnswerForManyFaults) {
  std::string body = "{";
  for (int i = 0; i < 50000; ++i) {
    body += (i == 0 ? "\"x" : ",\"x") + std::to_string(i) + "\":1";
  }
  const auto parsed = api::parse_job(body + "}");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors.size(), 32U);
}

TEST(CheckOptions, RefusesOptionsThatTheIntegratorDoesNotUse) {
  const auto parsed = api::parse_job(R"({"scene":"x","estimator":{"strategy":"bsdf"},)"
                                     R"("integrator":{"type":"direct","max_depth":3}})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(
      parsed.problem().errors,
      (std::vector<api::FieldError>{
          {"/integrator/max_depth",
           "is not supported by integrator 'direct', but by 'path', 'path-caustics', "
           "'light-trace', "
           "'bdpt', 'mlt', 'photon-map', 'sppm', 'vcm', 'irradiance-cache', 'auto'"},
          {"/estimator/strategy", "is not supported by integrator 'direct', but by 'path'"}}));
}

TEST(CheckOptions, AcceptsTheOnlyValueOfAnOptionThatTheIntegratorDoesNotUse) {
  EXPECT_TRUE(api::parse_job(R"({"scene":"x","integrator":{"type":"direct","max_depth":1}})"));
}

}  // namespace
