#include "api/answers/server_view.h"

#include <algorithm>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/job/job_spec.h"
#include "core/integrators/registry.h"
#include "core/settings/choices.h"

namespace {

using api::Json;

Json server() {
  api::ServerView view;
  view.version = "1.2.3";
  view.capabilities.scenes = {{"cornell-box", "The measured one."}};
  view.capabilities.image_formats = {{"png", "image/png"}};
  view.capabilities.tone_maps = {"srgb"};
  view.capabilities.extensions = {"KHR_lights_punctual"};
  view.limits = {{"streams", 2048}};
  return Json::parse(api::server_json(view));
}

Json default_spec() { return api::to_json(api::parse_job(R"({"scene":"x"})")->spec); }

TEST(ServerView, HasTheDocumentedMembers) {
  std::vector<std::string> keys;
  const Json body = server();
  for (const auto& member : body.items()) {
    keys.push_back(member.key());
  }
  EXPECT_EQ(keys, (std::vector<std::string>{"version", "build", "limits", "defaults", "integrators",
                                            "samplers", "light_samplers", "adaptive", "options",
                                            "layers", "optional_layers", "layer_patterns",
                                            "image_formats", "tone_maps", "filters", "scenes",
                                            "experiments", "extensions"}));
}

TEST(ServerView, ShowsEveryLimit) {
  EXPECT_EQ(server()["limits"]["samples_per_pixel"], 65536);
  EXPECT_EQ(server()["limits"]["film_pixels"], 64000000);
  EXPECT_EQ(server()["limits"]["streams"], 2048);
}

TEST(ServerView, EveryListedNameOfAJobCanBeSubmitted) {
  const Json body = server();
  const auto accepts = [](const Json& patch) {
    Json request = {{"scene", "x"}};
    request.merge_patch(patch);
    const auto parsed = api::parse_job(api::dump(request));
    EXPECT_TRUE(parsed) << api::dump(patch) << (parsed ? "" : parsed.problem().detail);
  };
  for (const Json& row : body["integrators"]) {
    accepts({{"integrator", {{"type", row["type"]}}}});
  }
  for (const Json& row : body["samplers"]) {
    accepts({{"sampler", {{"type", row["type"]}}}});
  }
  for (const Json& row : body["light_samplers"]) {
    accepts({{"light_sampler", {{"type", row["type"]}}}});
  }
  for (const Json& row : body["adaptive"]) {
    accepts({{"adaptive", {{"type", row["type"]}}}});
  }
  for (const Json& filter : body["filters"]) {
    accepts({{"film", {{"filter", {{"type", filter}}}}}});
  }
  for (const char* list : {"layers", "optional_layers"}) {
    for (const Json& layer : body[list]) {
      accepts({{"film", {{"layers", Json::array({layer})}}}});
    }
  }
}

TEST(ServerView, EveryOptionEnablesItsFeatureFromAnyStart) {
  std::set<std::string> names;
  for (const api::OptionRow& option : api::estimation_options()) {
    EXPECT_TRUE(names.insert(option.name).second) << option.name;
    const Json patch = Json::parse(option.patch);
    const Json minimal = {{"scene", "x"}};
    for (Json request : {minimal, default_spec()}) {
      request.merge_patch(patch);
      const auto parsed = api::parse_job(api::dump(request));
      ASSERT_TRUE(parsed) << option.name << parsed.problem().detail;
      // Applying the patch again to the effective values changes nothing.
      Json again = api::to_json(parsed->spec);
      const Json before = again;
      again.merge_patch(patch);
      EXPECT_EQ(again, before) << option.name;
    }
  }
  EXPECT_EQ(names.count("estimator.mis.balance"), 1U);
  EXPECT_EQ(names.size(), core::strategies().size() + core::mis_types().size() +
                              core::roulette_types().size() + core::splitting_types().size() +
                              core::control_variate_types().size() +
                              core::expected_value_types().size() + core::spectral_types().size() +
                              core::granularities().size());
}

/// The types of a group of the job, and the options that only some of them accept.
void expect_options_of_types(const Json& rows, const std::string& group) {
  for (const Json& row : rows) {
    const Json request = {{"scene", "x"}, {group, {{"type", row["type"]}}}};
    const auto parsed = api::parse_job(api::dump(request));
    ASSERT_TRUE(parsed) << row;
    const Json spec = api::to_json(parsed->spec);
    for (const Json& other : rows) {
      for (const std::string pointer : other["accepts"]) {
        const bool accepted = std::find(row["accepts"].begin(), row["accepts"].end(), pointer) !=
                              row["accepts"].end();
        // The first replicate is printed only if it is not 0.
        EXPECT_TRUE(spec.contains(Json::json_pointer(pointer)) == accepted ||
                    pointer == "/sampler/first_replicate")
            << row["type"] << pointer;
      }
    }
  }
}

TEST(ServerView, TypeHasExactlyTheOptionsThatItAccepts) {
  const Json body = server();
  expect_options_of_types(body["samplers"], "sampler");
  expect_options_of_types(body["light_samplers"], "light_sampler");
  expect_options_of_types(body["adaptive"], "adaptive");
}

TEST(ServerView, DefaultsOfAnIntegratorAreThoseOfItsJobs) {
  const Json body = server();
  for (const Json& row : body["integrators"]) {
    Json expected = body["defaults"];
    expected.merge_patch(row["defaults"]);
    expected["integrator"]["type"] = row["type"];
    const Json request = {{"scene", "x"}, {"integrator", {{"type", row["type"]}}}};
    Json found = api::to_json(api::parse_job(api::dump(request))->spec);
    found.erase("scene");
    EXPECT_EQ(found, expected) << row["type"];
  }
}

TEST(ServerView, OnlyDirectLightAndMissingOptionsHaveDefaultsOfTheirOwn) {
  const Json about = server();
  int looked_at = 0;
  for (const Json& row : about["integrators"]) {
    const std::vector<std::string> accepts = row["accepts"];
    const auto is_own = [](const std::string& pointer) {
      return pointer == "/integrator/photons" || pointer == "/integrator/records";
    };
    if (std::any_of(accepts.begin(), accepts.end(), is_own)) {
      continue;  // these options have defaults there
    }
    Json expected = Json::object();
    if (row["type"] == "direct") {
      expected["integrator"]["max_depth"] = 1;
    }
    if (std::find(accepts.begin(), accepts.end(), "/estimator/splitting") == accepts.end()) {
      expected["estimator"]["splitting"]["type"] = "none";
    }
    if (std::find(accepts.begin(), accepts.end(), "/light_sampler") == accepts.end()) {
      expected["light_sampler"]["type"] = "tree";
    }
    EXPECT_EQ(row["defaults"], expected) << row["type"];
    ++looked_at;
  }
  EXPECT_GT(looked_at, 3);
}

TEST(ServerView, EveryAcceptedOptionIsAMemberOfTheJob) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    Json request = {{"scene", "x"}, {"integrator", {{"type", row.name}}}};
    if (core::accepts(row, "/shutter_seconds")) {
      request["shutter_seconds"] = 1;  // printed if the shutter is open
    }
    if (core::accepts(row, core::kThroughGlass)) {  // printed if it is not the default
      request["background"] = {{"type", "transparent"}, {"through_glass", false}};
    }
    Json spec = api::to_json(api::parse_job(api::dump(request))->spec);
    if (core::accepts(row, "/integrator/caustics")) {  // likewise; excludes some of the others
      const Json alone = {{"scene", "x"}, {"integrator", {{"caustics", "auto"}}}};
      spec["integrator"].update(
          api::to_json(api::parse_job(api::dump(alone))->spec).at("integrator"));
    }
    for (const std::string_view pointer : row.accepts) {
      EXPECT_TRUE(spec.contains(Json::json_pointer(std::string(pointer)))) << pointer;
    }
  }
}

}  // namespace
