#include "api/lab.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/openapi.h"
#include "tests/unit/api/schema_check.h"

namespace {

using api::Json;
using test_api::schema_fault;

TEST(LabRequest, UsesTheDefaultsOfItsExperiment) {
  const auto parsed = api::parse_lab_request(R"({"experiment":"strategies"})");
  ASSERT_TRUE(parsed);
  EXPECT_EQ(parsed->setup.estimator_name(), "area");
  EXPECT_EQ(parsed->setup.sampler_name, "independent");
  EXPECT_EQ(parsed->options.n.size(), 6U);
  EXPECT_EQ(parsed->options.replicates, 64);
  EXPECT_EQ(parsed->setup.parameters, std::vector<double>{1});
}

TEST(LabRequest, ReportsEveryFaultAtOnce) {
  const auto parsed =
      api::parse_lab_request(R"({"experiment":"pi","estimator":"x","n":[0],"replicates":1})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().status, 422);
  ASSERT_EQ(parsed.problem().errors.size(), 3U);
  EXPECT_EQ(parsed.problem().errors[0],
            (api::FieldError{"/estimator", "Unknown value 'x'; expected one of: hit, height"}));
  EXPECT_EQ(parsed.problem().errors[1], (api::FieldError{"/n/0", "0 is outside [1, 100000000]"}));
  EXPECT_EQ(parsed.problem().errors[2], (api::FieldError{"/replicates", "1 is outside [2, 4096]"}));
}

TEST(LabRequest, LimitsTheWholeRun) {
  EXPECT_TRUE(api::parse_lab_request(R"({"experiment":"pi","n":[10000000],"replicates":100})"));
  const auto parsed =
      api::parse_lab_request(R"({"experiment":"pi","n":[10000000,1],"replicates":100})");
  ASSERT_FALSE(parsed);
  EXPECT_EQ(parsed.problem().errors[0],
            (api::FieldError{"/n",
                             "with these replicates the run needs 1000000100 evaluations, at most "
                             "1000000000 are allowed"}));
}

TEST(LabAnswer, LinesAreValidAgainstTheirSchemas) {
  const Json document = api::openapi_document({}, "1");
  const auto request =
      api::parse_lab_request(R"({"experiment":"samplers-4d","n":[16,64],"replicates":4})");
  ASSERT_TRUE(request);
  const Json schemas = document["components"]["schemas"];
  const auto outcome =
      core::lab::run(request->setup, request->options, {}, [&](const core::lab::Point& point) {
        EXPECT_EQ(
            schema_fault(Json::parse(api::lab_point_json(point)), schemas["LabPoint"], document),
            "");
        return true;
      });
  ASSERT_TRUE(outcome);
  EXPECT_EQ(schema_fault(Json::parse(api::lab_outcome_json(*request, *outcome)),
                         schemas["LabOutcome"], document),
            "");
  EXPECT_EQ(Json::parse(api::lab_outcome_json(*request, *outcome))["pattern"][0].size(), 4U);
}

TEST(LabAnswer, UnknownValuesAreNull) {
  const auto request = api::parse_lab_request(R"({"experiment":"pi"})");
  const Json line = Json::parse(api::lab_outcome_json(*request, core::lab::Outcome{}));
  for (const char* member :
       {"slope", "slope_interval", "expected_slope", "intercept", "efficiency"}) {
    EXPECT_TRUE(line[member].is_null()) << member;
  }
  EXPECT_EQ(line["verdict"], "undecided");
}

TEST(LabExperiments, DefaultsOfAllAreAccepted) {
  for (const Json& e : api::experiments_json()) {
    Json params = Json::object();
    for (const Json& p : e["params"]) {
      params[p["name"].get<std::string>()] = p["default"];
    }
    const Json body = {{"experiment", e["name"]},       {"estimator", e["estimator"]},
                       {"sampler", e["sampler"]},       {"n", e["n"]},
                       {"replicates", e["replicates"]}, {"params", params}};
    const auto parsed = api::parse_lab_request(api::dump(body));
    EXPECT_TRUE(parsed) << e["name"];
  }
}

}  // namespace
