// Schemas of the answers. tests/unit/api checks that what the printers write is valid against them,
// no member left over.
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/job_view.h"
#include "api/lab.h"
#include "api/schemas.h"
#include "api/stop_rules.h"
#include "api/values.h"
#include "core/render/registry.h"

namespace api {
namespace {

struct Member {
  std::string_view name;
  Json schema;
};

Json object_of(std::string_view doc, const std::vector<Member>& members) {
  Json schema = basic_schema("object", doc);
  Json properties = Json::object();
  Json required = Json::array();
  for (const Member& member : members) {
    properties[std::string(member.name)] = member.schema;
    required.push_back(member.name);
  }
  schema["properties"] = std::move(properties);
  schema["required"] = std::move(required);
  schema["additionalProperties"] = false;
  return schema;
}

Json ref(std::string_view name) { return {{"$ref", "#/components/schemas/" + std::string(name)}}; }
Json ref_or_null(std::string_view name) {
  return {{"anyOf", Json::array({ref(name), {{"type", "null"}}})}};
}
Json array_of(Json items, std::string_view doc) {
  Json schema = basic_schema("array", doc);
  schema["items"] = std::move(items);
  return schema;
}
Json string(std::string_view doc) { return basic_schema("string", doc); }
Json strings(std::string_view doc) { return array_of(basic_schema("string", ""), doc); }
Json maybe_string(std::string_view doc) { return basic_schema("string", doc, true); }
Json integer(std::string_view doc) {
  Json schema = basic_schema("integer", doc);
  schema["minimum"] = 0;
  return schema;
}
Json real(std::string_view doc) { return basic_schema("number", doc); }
Json maybe_real(std::string_view doc) { return basic_schema("number", doc, true); }
Json time(std::string_view doc, bool nullable) {
  Json schema = basic_schema("string", doc, nullable);
  schema["format"] = "date-time";
  return schema;
}
Json one_of(std::string_view doc, const std::vector<std::string_view>& names) {
  Json schema = basic_schema("string", doc);
  schema["enum"] = names;
  return schema;
}
Json bias_schema() {
  return one_of("How the expected picture relates to the truth.", {"none", "consistent", "biased"});
}
Json reals(std::string_view doc) { return array_of(basic_schema("number", "", true), doc); }
Json point(std::string_view doc) {
  Json schema = array_of(basic_schema("number", ""), doc);
  schema["minItems"] = 3;
  schema["maxItems"] = 3;
  return schema;
}

Json state_schema() {
  std::vector<std::string_view> names;
  for (int i = 0; i <= static_cast<int>(JobState::kCancelled); ++i) {
    names.push_back(to_text(static_cast<JobState>(i)));
  }
  return one_of("Where the job is.", names);
}

Json stop_reason_schema() {
  Json schema = basic_schema("string", "What ended the job; null before.", true);
  Json names = Json::array();
  for (int i = 1; i <= static_cast<int>(core::StopReason::kFailed); ++i) {
    names.push_back(to_text(static_cast<core::StopReason>(i)));
  }
  names.push_back(nullptr);
  schema["enum"] = std::move(names);
  return schema;
}

/// The request with every member there; `environment` comes when the scene is known.
Json spec_schema() {
  Json schema = job_request_schema();
  schema["description"] = "The job request with every member in force.";
  Json required = Json::array();
  for (const auto& property : schema["properties"].items()) {
    if (property.key() != "environment" && property.key() != "webhook" &&
        property.key() != "retention_seconds") {
      required.push_back(property.key());
    }
  }
  schema["required"] = std::move(required);
  return schema;
}

Json problem_schema() {
  const Json field_error =
      object_of("", {{"pointer", string("JSON pointer into the body; /name for a "
                                        "query parameter.")},
                     {"detail", string("What was seen and what is allowed.")}});
  Json schema =
      object_of("RFC 9457.", {{"type", string("Kind of problem, a URI reference.")},
                              {"title", string("The same for every problem of the type.")},
                              {"status", integer("HTTP status.")},
                              {"detail", string("About this one.")},
                              {"instance", string("Path of the request.")},
                              {"errors", array_of(field_error, "Faults of the input.")}});
  schema["required"] = {"type", "title", "status", "detail"};
  return schema;
}

void add_job_schemas(Json& components) {
  components["Problem"] = problem_schema();
  components["JobSpec"] = spec_schema();
  Json eta_interval = reals("Lower and upper bound of eta_seconds, as long as the pace stays what it was; null: unknown.");
  eta_interval["type"] = {"array", "null"};
  eta_interval["minItems"] = 2;
  eta_interval["maxItems"] = 2;
  components["Progress"] =
      object_of("How far it is.",
                {{"fraction", real("0 to 1; 1 only at the end.")},
                 {"samples_per_pixel",
                  object_of("Samples a pixel has, over the pixels of the crop.",
                            {{"min", integer("")}, {"mean", real("")}, {"max", integer("")}})},
                 {"elapsed_seconds", real("Rendering time without pauses and downtime.")},
                 {"cpu_seconds", real("Of all threads.")},
                 {"eta_seconds", maybe_real("Until the end; null: unknown.")},
                 {"eta_interval_seconds", eta_interval}});
  components["ErrorEstimate"] = object_of(
      "How wrong the picture still is.",
      {{"relative_rmse",
        maybe_real("sqrt(mean over pixels and channels of variance / (mean^2 + 0.01)); "
                   "null: unknown.")},
       {"low", maybe_real("Lower end of the interval; null: unknown, or not valid.")},
       {"high", maybe_real("Upper end of the interval.")},
       {"confidence", real("Of the interval.")},
       {"bias", bias_schema()},
       {"valid", basic_schema("boolean", "False: the two halves depend on each other, and there is no interval.")},
       {"unreliable", basic_schema("boolean", "Too few distinct events to trust the interval.")}});
  components["Statistics"] = object_of(
      "What it cost.", {{"rays", integer("")},
                        {"rays_per_second", maybe_real("")},
                        {"efficiency", maybe_real("1 / (relative error^2 * CPU seconds).")},
                        {"rejected_samples", integer("Non-finite ones, counted as zero.")},
                        {"peak_bytes", basic_schema("integer", "Memory; null: unknown.", true)},
                        {"split_count", basic_schema("integer",
                                                     "Continuations of each path that splitting 'measured' found; null: not yet "
                                                     "known, or another type.",
                                                     true)}});
  Json links = basic_schema("object", "Paths of what belongs to the job.");
  links["additionalProperties"] = {{"type", "string"}};
  components["Job"] = object_of(
      "A job.",
      {{"id", string("UUID.")},
       {"state", state_schema()},
       {"stop_reason", stop_reason_schema()},
       {"created_at", time("", false)},
       {"started_at", time("", true)},
       {"finished_at", time("", true)},
       {"spec", ref("JobSpec")},
       {"progress", ref("Progress")},
       {"error", ref("ErrorEstimate")},
       {"failure", ref_or_null("Problem")},
       {"queue_position", basic_schema("integer", "0 is next; null: not waiting.", true)},
       {"statistics", ref("Statistics")},
       {"revision", integer("Counts the changes of the picture.")},
       {"film_digest", maybe_string("sha256 of the film's exact content, when finished.")},
       {"warnings", strings("What is in force instead of what was asked, and the like.")},
       {"links", links}});
  components["DryRun"] =
      object_of("What a job would be, and what it would cost.",
                {{"spec", ref("JobSpec")},
                 {"warnings", strings("")},
                 {"estimate",
                  object_of("From a pilot of at most half a second.",
                            {{"seconds", real("On an idle server.")},
                             {"seconds_low", real("Lower end of the interval.")},
                             {"seconds_high", real("Upper end of the interval.")},
                             {"confidence", real("Of the interval.")},
                             {"cpu_seconds", real("")},
                             {"samples_per_pixel", real("That will be needed.")},
                             {"memory_bytes", real("Film and scene.")},
                             {"memory_bytes_low", real("The film alone.")},
                             {"memory_bytes_high", real("With what encoding and a checkpoint take.")},
                             {"pilot_cpu_seconds", real("What the pilot took.")}})}});
  components["Ticket"] =
      object_of("Leave to watch.", {{"ticket", string("Goes into `?ticket=`.")},
                                    {"expires_at", time("", false)},
                                    {"jobs", strings("What it is for.")}});
  components["JobList"] = object_of(
      "A page of jobs.", {{"jobs", array_of(ref("Job"), "Newest first.")},
                          {"next", maybe_string("Cursor of the next page; null: the last one.")}});
}

void add_scene_schemas(Json& components) {
  components["Asset"] =
      object_of("A stored file.", {{"id", string("sha256, hex.")}, {"bytes", integer("")}});
  Json bounds =
      object_of("Axis-aligned box, metres; null: empty.", {{"min", point("")}, {"max", point("")}});
  bounds["type"] = {"object", "null"};
  const Json camera = object_of("", {{"index", integer("")},
                                     {"name", string("")},
                                     {"type", one_of("", {"perspective", "orthographic"})},
                                     {"vertical_fov_degrees", maybe_real("")},
                                     {"position", point("Metres.")},
                                     {"direction", point("Where it looks, unit vector.")},
                                     {"up", point("Unit vector.")}});
  const Json light =
      object_of("", {{"name", string("")},
                     {"type", one_of("", {"directional", "point", "spot"})},
                     {"intensity", point("W/sr, or W/m2 if directional; linear RGB.")}});
  components["Scene"] =
      object_of("A loaded scene.",
                {{"id", string("What a job's `scene` names.")},
                 {"name", string("")},
                 {"bytes", integer("Memory of geometry, acceleration structure and textures.")},
                 {"bounds", bounds},
                 {"triangles", integer("As placed: a mesh used twice counts twice.")},
                 {"instances", integer("")},
                 {"cameras", array_of(camera, "")},
                 {"lights", array_of(light, "Punctual lights.")},
                 {"materials", strings("Names.")},
                 {"variants", strings("Names.")},
                 {"animations", strings("Names.")},
                 {"extensions", strings("Extensions that the file uses.")},
                 {"warnings", strings("")}});
  components["SceneList"] =
      object_of("A page of scenes.",
                {{"scenes", array_of(ref("Scene"), "Newest first.")},
                 {"next", maybe_string("Cursor of the next page; null: the last one.")}});
}

void add_result_schemas(Json& components) {
  const Json curve_point = object_of("", {{"samples_per_pixel", integer("")},
                                          {"elapsed_seconds", real("")},
                                          {"cpu_seconds", real("")},
                                          {"rays", integer("")},
                                          {"relative_rmse", maybe_real("")},
                                          {"low", maybe_real("")},
                                          {"high", maybe_real("")}});
  components["Convergence"] = object_of(
      "Error over samples and time.",
      {{"points", array_of(curve_point, "One for each look.")},
       {"slope",
        object_of(
            "Of log error against log samples, least squares, 95 % interval.",
            {{"value", maybe_real("")}, {"low", maybe_real("")}, {"high", maybe_real("")}})}});
  Json halves = array_of(reals(""), "Halves A and B; null where the layer has none.");
  halves["type"] = {"array", "null"};
  const Json layer = object_of("", {{"mean", reals("")},
                                    {"standard_error", reals("")},
                                    {"low", reals("Of the 95 % interval.")},
                                    {"high", reals("Of the 95 % interval.")},
                                    {"halves", halves}});
  Json layers = basic_schema("object", "By name.");
  layers["additionalProperties"] = layer;
  components["Pixel"] = object_of(
      "One pixel.",
      {{"x", integer("")}, {"y", integer("")}, {"samples", integer("")}, {"layers", layers}});
  Json links = basic_schema("object", "");
  links["additionalProperties"] = {{"type", "string"}};
  components["Comparison"] = object_of(
      "Two pictures compared; b is the reference.",
      {{"id", string("")},
       {"mse", maybe_real("")},
       {"relmse", maybe_real("Mean of (a-b)^2 / (b^2 + 0.01).")},
       {"flip", maybe_real("LDR, 67 pixels per degree.")},
       {"bias",
        object_of("Mean of a - b.",
                  {{"value", maybe_real("")}, {"low", maybe_real("")}, {"high", maybe_real("")}})},
       {"z", object_of("Of (a-b) / standard error.", {{"mean", maybe_real("")},
                                                      {"variance", maybe_real("")},
                                                      {"share_above_3", maybe_real("")}})},
       {"links", links}});
}

void add_server_schema(Json& components) {
  const auto typed = [](std::string_view doc) {
    return array_of(object_of("", {{"type", string("Name in requests.")},
                                   {"bias", bias_schema()},
                                   {"summary", string("")},
                                   {"accepts", strings("JSON pointers of the job request that it "
                                                       "honours.")}}),
                    doc);
  };
  Json limits = basic_schema("object", "Every maximum by name.");
  limits["additionalProperties"] = {{"type", "integer"}};
  components["Server"] = object_of(
      "What this server can do.",
      {{"version", string("")},
       {"build",
        object_of("What the bits of a film depend on besides the job.", {{"id", string("")},
                                                                         {"commit", string("")},
                                                                         {"compiler", string("")},
                                                                         {"isa", string("")},
                                                                         {"embree", string("")}})},
       {"limits", limits},
       {"integrators", typed("")},
       {"samplers", typed("")},
       {"light_samplers", typed("")},
       {"adaptive", typed("")},
       {"options", array_of(object_of("", {{"name", string("")},
                                           {"bias", bias_schema()},
                                           {"summary", string("")},
                                           {"patch", basic_schema("object",
                                                                  "Merge patch (RFC 7396) of "
                                                                  "the job request that turns "
                                                                  "it on.")}}),
                            "Every other switch of the estimation.")},
       {"layers", strings("")},
       {"image_formats", strings("Extensions.")},
       {"tone_maps", strings("")},
       {"filters", strings("")},
       {"scenes", array_of(object_of("", {{"name", string("")}, {"summary", string("")}}),
                           "Built-in scenes.")},
       {"experiments", array_of(experiment_schema(), "Of the laboratory.")},
       {"extensions", strings("Of glTF.")}});
}

}  // namespace

void add_view_schemas(Json& components) {
  add_job_schemas(components);
  add_scene_schemas(components);
  add_result_schemas(components);
  add_server_schema(components);
  components["LabPoint"] = lab_point_schema();
  components["LabOutcome"] = lab_outcome_schema();
}

}  // namespace api
