#include "api/openapi.h"

#include <algorithm>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "api/answers/events.h"
#include "api/batch.h"
#include "api/job/examples.h"
#include "api/job/job_spec.h"
#include "api/json/errors.h"
#include "api/json/field_rows.h"
#include "api/json/limits.h"
#include "api/lab.h"
#include "api/operations.h"
#include "api/requests.h"
#include "core/film/tile_planes.h"
#include "tests/support/enumerators.h"
#include "tests/unit/api/schema_check.h"

namespace {

using api::Json;
using test_api::schema_fault;

api::Capabilities capabilities() {
  return {{{"cornell-box", "x"}},
          {{"png", "image/png"}, {"exr", "image/x-exr"}},
          {"srgb", "linear"},
          {"KHR_lights_punctual"}};
}

const Json& document() {
  static const Json kDocument = api::openapi_document(capabilities(), "1.0.0");
  return kDocument;
}

std::string fault_of(const std::string& body, const std::string& schema) {
  return schema_fault(Json::parse(body), document()["components"]["schemas"][schema], document());
}

/// Follows the reference of a member, also one beside null.
const Json& resolved(const Json& schema) {
  const Json& member = schema.contains("anyOf") ? schema["anyOf"][0] : schema;
  return member.contains("$ref")
             ? document().at(Json::json_pointer(member["$ref"].get<std::string>().substr(1)))
             : schema;
}

template <typename Visit>
void each_node(const Json& node, const Visit& visit) {
  visit(node);
  if (node.is_structured()) {
    for (const Json& child : node) {
      each_node(child, visit);
    }
  }
}

TEST(OpenApi, EveryReferenceIsDefined) {
  each_node(document(), [](const Json& node) {
    if (node.is_object() && node.contains("$ref")) {
      const auto ref = node["$ref"].get<std::string>();
      EXPECT_TRUE(document().contains(Json::json_pointer(ref.substr(1)))) << ref;
    }
  });
}

TEST(OpenApi, HasExactlyTheOperationsOfTheTable) {
  std::set<std::string> ids;
  for (const auto& path : document()["paths"].items()) {
    for (const auto& method : path.value().items()) {
      EXPECT_TRUE(ids.insert(method.value()["operationId"].get<std::string>()).second);
    }
  }
  std::set<std::string> expected = {"getImageInFormat"};
  for (const api::Operation& operation : api::operations()) {
    expected.insert(std::string(operation.id));
  }
  EXPECT_EQ(ids, expected);
}

TEST(OpenApi, HasTheDocumentedOperations) {
  const std::vector<std::pair<std::string, std::string>> rows = {
      {"/livez", "get"},
      {"/readyz", "get"},
      {"/metrics", "get"},
      {"/openapi.json", "get"},
      {"/docs", "get"},
      {"/", "get"},
      {"/v1/server", "get"},
      {"/v1/assets", "post"},
      {"/v1/assets/{sha256}", "put"},
      {"/v1/assets/{sha256}", "get"},
      {"/v1/assets/{sha256}", "delete"},
      {"/v1/scenes", "post"},
      {"/v1/scenes", "get"},
      {"/v1/scenes/{id}", "get"},
      {"/v1/scenes/{id}", "delete"},
      {"/v1/scenes/{id}/gltf", "get"},
      {"/v1/jobs", "post"},
      {"/v1/jobs", "get"},
      {"/v1/jobs/{id}", "get"},
      {"/v1/jobs/{id}", "patch"},
      {"/v1/jobs/{id}/cancel", "post"},
      {"/v1/jobs/{id}", "delete"},
      {"/v1/jobs/{id}/image", "get"},
      {"/v1/jobs/{id}/image.{format}", "get"},
      {"/v1/jobs/{id}/pixels/{x}/{y}", "get"},
      {"/v1/jobs/{id}/convergence", "get"},
      {"/v1/jobs/{id}/events", "get"},
      {"/v1/jobs/{id}/tiles", "get"}};
  for (const auto& [path, method] : rows) {
    EXPECT_TRUE(document()["paths"].contains(path) && document()["paths"][path].contains(method))
        << method << " " << path;
  }
}

TEST(OpenApi, DeclaresEachParameterOfEachPath) {
  const std::regex name("\\{([a-z0-9]+)\\}");
  for (const auto& path : document()["paths"].items()) {
    const std::string text = path.key();
    std::set<std::string> in_path;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), name);
         it != std::sregex_iterator(); ++it) {
      in_path.insert((*it)[1]);
    }
    for (const auto& method : path.value().items()) {
      std::set<std::string> declared;
      for (const Json& parameter : method.value().value("parameters", Json::array())) {
        if (parameter["in"] == "path") {
          declared.insert(parameter["name"].get<std::string>());
        }
      }
      EXPECT_EQ(declared, in_path) << text;
    }
  }
}

TEST(OpenApi, ExamplesAreValid) {
  int count = 0;
  for (const auto& schema : document()["components"]["schemas"].items()) {
    for (const Json& example : schema.value().value("examples", Json::array())) {
      EXPECT_EQ(schema_fault(example, schema.value(), document()), "") << schema.key();
      ++count;
    }
  }
  EXPECT_GE(count, 8);
}

TEST(OpenApi, ExampleRequestsAreAccepted) {
  EXPECT_TRUE(api::parse_job(api::dump(api::example_of("JobRequest"))));
  EXPECT_TRUE(api::parse_job_patch(api::dump(api::example_of("JobPatch")), api::JobSpec{}));
  EXPECT_TRUE(api::parse_extend(api::dump(api::example_of("ExtendRequest")), api::JobSpec{}));
  EXPECT_TRUE(api::parse_scene_from_assets(api::dump(api::example_of("SceneFromAssets"))));
  EXPECT_TRUE(api::parse_comparison(api::dump(api::example_of("ComparisonRequest"))));
  EXPECT_TRUE(api::parse_batch(api::dump(api::example_of("BatchRequest"))));
  EXPECT_TRUE(api::parse_merge(api::dump(api::example_of("MergeRequest"))));
  EXPECT_TRUE(api::parse_lab_request(api::dump(api::example_of("LabRequest"))));
}

TEST(OpenApi, AnswersAreValidInEveryState) {
  for (const auto state : test_support::enumerators<api::JobState>()) {
    for (const auto reason : test_support::enumerators<core::StopReason>()) {
      api::JobView job;
      job.state = state;
      job.stop_reason = reason;
      job.spec.scene = "x";
      job.queue_position = 3;
      job.finished_at_unix_seconds = 5;
      job.film_digest = "abc";
      job.failure = api::make_problem(core::ErrorCode::kNoSpace, "full");
      EXPECT_EQ(fault_of(api::job_json(job), "Job"), "");
    }
  }
  const std::vector<api::JobView> jobs = {api::example_job(), api::JobView{}};
  EXPECT_EQ(fault_of(api::job_list_json({&jobs[0], 1}, {}, std::nullopt), "JobList"), "");
  EXPECT_EQ(fault_of(api::scene_json("id", core::SceneSummary{}), "Scene"), "");
  EXPECT_EQ(fault_of(api::convergence_json({}), "Convergence"), "");
  EXPECT_EQ(fault_of(api::pixel_json({}), "Pixel"), "");
  EXPECT_EQ(fault_of(api::server_json({"1", {}, capabilities(), {}}), "Server"), "");
  EXPECT_EQ(fault_of(api::asset_json("id", 5), "Asset"), "");
}

TEST(OpenApi, SchemaAndParserAgree) {
  struct Case {
    const char* body;
    bool good;
  };
  const std::vector<Case> cases = {
      {R"({"scene":"x"})", true},
      {R"({"scene":"x","seed":9007199254740991})", true},
      {R"({"scene":"x","seed":9007199254740992})", false},
      {R"({"scene":"x","seed":1.5})", false},
      {R"({"scene":"x","seed":2.0})", true},
      {R"({})", false},
      {R"({"scene":""})", false},
      {R"({"scene":"x","colour":1})", false},
      {R"({"scene":"x","environment":null})", true},
      {R"({"scene":"x","environment":{"intensity":-1}})", false},
      {R"({"scene":"x","camera":{"position":[0,0,1],"target":[0,0,0]}})", true},
      {R"({"scene":"x","camera":{"position":[0,0]}})", false},
      {R"({"scene":"x","film":{"filter":{"type":"box","radius":0}}})", false},
      {R"({"scene":"x","film":{"filter":{"type":"box","radius":8}}})", true},
      {R"({"scene":"x","film":{"crop":{"x":0,"y":0,"width":1}}})", false},
      {R"({"scene":"x","film":{"crop":null}})", true},
      {R"({"scene":"x","film":{"layers":["error"]}})", true},
      {R"({"scene":"x","film":{"layers":["heat"]}})", false},
      {R"({"scene":"x","film":{"layers":["bounce:2","bounce:3-","light:left lamp"]}})", true},
      {R"({"scene":"x","film":{"layers":["bounce:02"]}})", false},
      {R"({"scene":"x","medium":{"scattering":[1,1,1],"g":0.5}})", true},
      {R"({"scene":"x","medium":{"density":1}})", false},
      {R"({"scene":"x","sampler":{"replicates":3}})", false},
      {R"({"scene":"x","adaptive":{"type":"none"}})", true},
      {R"({"scene":"x","adaptive":{"type":"pilot","min_samples":16,"granularity":"tile",)"
       R"("dilation":2}})",
       true},
      {R"({"scene":"x","adaptive":{"type":"pilot","dilation":9}})", false},
      {R"({"scene":"x","adaptive":{"type":"magic"}})", false},
      {R"({"scene":"x","labels":{"a":"b"}})", true},
      {R"({"scene":"x","labels":{"a":1}})", false},
      {R"({"scene":"x","stop":{"seconds":1}})", true},
      {R"({"scene":"x","stop":{}})", false},
      {R"({"scene":"x","stop":{"deadline":"2026-01-01T00:00:00Z"}})", true},
  };
  for (const Case& c : cases) {
    EXPECT_EQ(fault_of(c.body, "JobRequest").empty(), c.good) << c.body;
    EXPECT_EQ(api::parse_job(c.body).has_value(), c.good) << c.body;
  }
}

TEST(OpenApi, DefaultsAreTheEffectiveOnes) {
  const Json spec = api::to_json(api::parse_job(R"({"scene":"x"})")->spec);
  int count = 0;
  const auto check = [&count](const auto& self, const Json& schema, const Json& value) -> void {
    EXPECT_FALSE(schema.contains("default")) << api::dump(schema);
    if (schema.contains("x-default")) {
      EXPECT_EQ(schema["x-default"], value);
      ++count;
    }
    const Json inner = resolved(schema);
    if (inner.contains("properties") && value.is_object()) {
      for (const auto& property : inner["properties"].items()) {
        if (value.contains(property.key()) && property.key() != "stop") {
          self(self, property.value(), value[property.key()]);
        }
      }
    }
  };
  check(check, document()["components"]["schemas"]["JobRequest"], spec);
  EXPECT_GT(count, 30);
}

TEST(OpenApi, OnlyTheSceneOfAJobIsRequired) {
  const Json& schemas = document()["components"]["schemas"];
  EXPECT_EQ(schemas["JobRequest"]["required"], Json({"scene"}));
  // Answers contain every member except those that depend on a choice.
  const Json& spec = schemas["JobSpec"];
  const auto has = [](const Json& required, const char* name) {
    return std::find(required.begin(), required.end(), name) != required.end();
  };
  EXPECT_TRUE(has(spec["required"], "film") && has(spec["required"], "name"));
  EXPECT_FALSE(has(spec["required"], "environment") || has(spec["required"], "webhook"));
  const auto part = [](const Json& schema, const char* member) {
    return resolved(schema["properties"][member]);
  };
  EXPECT_EQ(part(spec, "integrator")["required"], Json({"type", "max_depth"}));
  EXPECT_EQ(part(part(spec, "estimator"), "mis")["required"], Json({"type"}));
  EXPECT_EQ(part(spec, "stop")["required"], Json::array());
  each_node(document(), [](const Json& node) {
    EXPECT_FALSE(node.is_object() && node.contains(api::kMayBeAbsent));
  });
}

TEST(OpenApi, DeclaresTheDefaultOfAFlag) {
  const Json& properties = document()["components"]["schemas"]["JobRequest"]["properties"];
  EXPECT_EQ(properties["spectral"]["type"], "boolean");
  EXPECT_EQ(properties["spectral"]["description"],
            "True: paths carry three wavelengths instead of three colours. Default: false.");
  EXPECT_EQ(properties["medium"]["anyOf"],
            Json::parse(R"([{"$ref":"#/components/schemas/JobRequestMedium"},{"type":"null"}])"));
}

TEST(OpenApi, EventsAreValid) {
  const api::JobView job = api::example_job();
  EXPECT_EQ(fault_of(api::snapshot_event(job), "Job"), "");
  EXPECT_EQ(fault_of(api::state_event(job), "StateEvent"), "");
  EXPECT_EQ(fault_of(api::progress_event(job), "ProgressEvent"), "");
  EXPECT_EQ(fault_of(api::tile_event("J", {}), "TileEvent"), "");
  EXPECT_EQ(fault_of(api::warning_event("w"), "WarningEvent"), "");
  EXPECT_EQ(fault_of(api::end_event(job), "EndEvent"), "");
  EXPECT_EQ(fault_of(api::reset_event("lost"), "ResetEvent"), "");
  EXPECT_EQ(fault_of(api::overloaded_event(5), "OverloadedEvent"), "");
  EXPECT_EQ(fault_of(api::webhook_body(api::EventType::kEnd, 5, job), "Webhook"), "");
  EXPECT_EQ(fault_of(api::lab_cancelled_json(), "LabCancelled"), "");
}

TEST(OpenApi, EveryMemberOfAnEventIsInItsSchema) {
  const Json extra = {{"message", "w"}, {"more", 1}};
  EXPECT_NE(schema_fault(extra, document()["components"]["schemas"]["WarningEvent"], document()),
            "");
}

const Json* parameter(const std::string& path, const std::string& name) {
  for (const Json& each : document()["paths"][path]["get"]["parameters"]) {
    if (each["name"] == name) {
      return &each;
    }
  }
  return nullptr;
}

TEST(OpenApi, ParametersHaveTheRangesAndDefaultsOfTheParsers) {
  const auto schema = [](const char* path, const char* name) {
    const Json* found = parameter(path, name);
    return found == nullptr ? Json() : (*found)["schema"];
  };
  EXPECT_EQ(schema("/v1/jobs", "limit"), Json({{"type", "integer"},
                                               {"minimum", 1},
                                               {"maximum", api::limits::kPageSize},
                                               {"default", 50},
                                               {"format", "int32"}}));
  EXPECT_EQ(
      schema("/v1/jobs", "class"),
      Json({{"type", "string"}, {"enum", {"normal", "preview", "all"}}, {"default", "normal"}}));
  EXPECT_EQ(schema("/v1/jobs/{id}", "wait")["maximum"], api::limits::kWaitSeconds);
  EXPECT_EQ(schema("/v1/jobs/{id}/image", "x"), Json({{"type", "integer"},
                                                      {"minimum", 0},
                                                      {"maximum", api::limits::kFilmSide - 1},
                                                      {"format", "int32"}}));
  EXPECT_EQ(schema("/v1/jobs/{id}/image", "stream"),
            Json({{"type", "boolean"}, {"default", false}}));
  EXPECT_EQ(schema("/v1/jobs/{id}/image", "tonemap")["enum"], Json({"srgb", "linear"}));
}

TEST(OpenApi, DeclaresParametersThatReplaceHeadersAndKeys) {
  for (const char* path : {"/v1/jobs/{id}/events", "/v1/events"}) {
    EXPECT_NE(parameter(path, "last_event_id"), nullptr) << path;
    EXPECT_NE(parameter(path, "ticket"), nullptr) << path;
  }
  EXPECT_NE(parameter("/v1/jobs/{id}/tiles", "ticket"), nullptr);
  EXPECT_NE(parameter("/v1/jobs/{id}/image", "ticket"), nullptr);
  // One of the two is required.
  EXPECT_EQ((*parameter("/v1/events", "jobs"))["required"], false);
  EXPECT_EQ((*parameter("/v1/events", "batch"))["required"], false);
}

TEST(OpenApi, ListsEachProblemType) {
  std::set<std::string> types;
  for (const Json& type : document()["x-problem-types"]) {
    types.insert(type["type"].get<std::string>());
  }
  for (const api::ErrorRow& row : api::error_table()) {
    EXPECT_EQ(types.count("/docs#problem-" + std::string(row.slug)), 1U) << row.slug;
  }
}

TEST(OpenApi, LayoutOfFilmsNamesTheFlagOfEveryPart) {
  const std::string told = document()["paths"]["/v1/jobs/{id}/film"]["get"]["description"];
  const std::size_t first = told.find("Flags: ");
  ASSERT_NE(first, std::string::npos);
  const std::string list = told.substr(first, told.find("from bit 8", first) - first);
  const std::string arrays = told.substr(told.find("Then the tiles"));
  for (const core::RecordedPart& row : core::kRecordedParts) {
    const std::regex flag("\\b" + std::to_string(row.file_flag) + "\\b");
    EXPECT_TRUE(std::regex_search(list, flag)) << row.file_flag;
    EXPECT_TRUE(std::regex_search(arrays, flag)) << row.file_flag;
  }
}

}  // namespace
