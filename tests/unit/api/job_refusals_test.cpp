// Every refusal of the job request: exact status, pointers and messages.
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"
#include "tests/unit/api/refusals.h"

namespace {

TEST(JobRefusals, HaveTheStatusThePointersAndTheReasons) {
  const auto all = test_support::refusals_in(TESSERA_SOURCE_DIR "/tests/unit/api/job_refusals.txt");
  ASSERT_GT(all.size(), 150U);
  for (const auto& [request, errors] : all) {
    SCOPED_TRACE(request.substr(0, 200));
    const bool is_body = request[0] != '"';
    const auto parsed =
        api::parse_job(is_body ? request.substr(4) : R"({"scene":"cornell-box",)" + request + "}");
    ASSERT_FALSE(parsed);
    EXPECT_EQ(parsed.problem().status, is_body ? std::stoi(request) : 422);
    EXPECT_EQ(parsed.problem().errors, errors) << parsed.problem().detail;
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

TEST(ParseJob, LimitsTheAnswerForManyFaults) {
  std::string body = "{";
  for (int i = 0; i < 50000; ++i) {
    body += (i == 0 ? "\"x" : ",\"x") + std::to_string(i) + "\":1";
  }
  const auto parsed = api::parse_job(body + "}");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors.size(), 32U);
}

}  // namespace
