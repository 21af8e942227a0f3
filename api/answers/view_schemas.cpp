// Components of the OpenAPI document for responses.
#include <string>

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/json/field_rows.h"
#include "api/json/schemas.h"

namespace api {
namespace {

/// Calls `change` with the schema and all its subschemas, the inner ones first.
template <typename Change>
void each_schema(Json& schema, const Change& change) {
  if (schema.contains("properties")) {
    for (const auto& property : schema["properties"].items()) {
      each_schema(property.value(), change);
    }
  }
  for (const char* inner : {"items", "additionalProperties"}) {
    if (schema.contains(inner) && schema[inner].is_object()) {
      each_schema(schema[inner], change);
    }
  }
  change(schema);
}

void show_default(Json& schema) {
  schema.erase(kMayBeAbsent);
  const auto found = schema.find("default");
  if (found == schema.end()) {
    return;
  }
  const Json value = *found;
  schema.erase("default");
  if (!value.is_null()) {
    std::string doc = schema.value("description", "");
    doc += (doc.empty() ? "Default: " : " Default: ") + dump(value) + ".";
    schema["description"] = std::move(doc);
  }
  schema["x-default"] = value;
}

void require_members(Json& schema) {
  schema.erase("default");
  if (!schema.contains("properties")) {
    return;
  }
  Json required = Json::array();
  for (const auto& property : schema["properties"].items()) {
    if (property.value().erase(kMayBeAbsent) == 0) {
      required.push_back(property.key());
    }
  }
  schema.erase("anyOf");  // members that a request requires
  schema["required"] = std::move(required);
}

}  // namespace

Json as_request(Json schema) {
  each_schema(schema, &show_default);
  return schema;
}

Json as_answer(Json schema, std::string_view doc) {
  each_schema(schema, &require_members);
  schema["description"] = doc;
  return schema;
}

void add_view_schemas(Json& components) {
  field_error_view().add_to(components);
  problem_view().add_to(components);
  components["JobState"] = job_state_schema();
  components["JobSpec"] =
      as_answer(job_request_schema(), "The job request with all defaults filled in.");
  progress_view().add_to(components);
  error_view().add_to(components);
  light_not_found_view().add_to(components);
  statistics_view().add_to(components);
  flicker_view().add_to(components);
  denoised_view().add_to(components);
  job_view().add_to(components);
  job_list_view().add_to(components);
  dry_run_view().add_to(components);
  ticket_view().add_to(components);
  add_event_schemas(components);
  add_scene_schemas(components);
  add_result_schemas(components);
  add_meter_schemas(components);
  add_comparison_schemas(components);
  add_object_schemas(components);
  Json defaults = job_request_schema();
  defaults["properties"].erase("scene");
  components["JobDefaults"] = as_answer(std::move(defaults), "Default values of a job request.");
  add_server_schemas(components);
  add_lab_schemas(components);
}

}  // namespace api
