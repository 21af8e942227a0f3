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

template <typename S>
void add(Json& components, const View<S>& view) {
  components[std::string(view.component)] = view.schema();
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
  add(components, field_error_view());
  add(components, problem_view());
  components["JobState"] = job_state_schema();
  components["JobSpec"] =
      as_answer(job_request_schema(), "The job request with all defaults filled in.");
  add(components, progress_view());
  add(components, error_view());
  add(components, light_not_found_view());
  add(components, statistics_view());
  add(components, denoised_view());
  add(components, job_view());
  add(components, job_list_view());
  add(components, dry_run_view());
  add(components, ticket_view());
  add(components, state_event_view());
  add(components, progress_event_view());
  add(components, tile_event_view());
  add(components, warning_event_view());
  add(components, end_event_view());
  add(components, reset_event_view());
  add(components, overloaded_event_view());
  add(components, webhook_view());
  add(components, asset_view());
  add(components, warning_view());
  add(components, camera_view());
  add(components, light_view());
  add(components, scene_view());
  add(components, scene_list_view());
  add(components, curve_point_view());
  add(components, convergence_view());
  add(components, pixel_layer_view());
  add(components, pixel_view());
  add(components, meter_reading_view());
  add(components, meter_view());
  add(components, meter_figures_view());
  add(components, meter_pair_view());
  add(components, meter_comparison_view());
  add(components, comparison_view());
  add(components, object_view());
  add(components, instance_view());
  add(components, label_view());
  add(components, objects_view());
  Json defaults = job_request_schema();
  defaults["properties"].erase("scene");
  components["JobDefaults"] = as_answer(std::move(defaults), "Default values of a job request.");
  add(components, type_info_view());
  add(components, integrator_view());
  add(components, option_view());
  add(components, experiment_view());
  add(components, server_view());
  add(components, drain_view());
  add(components, lab_point_view());
  add(components, lab_outcome_view());
  add(components, lab_cancelled_view());
}

}  // namespace api
