#include "api/openapi.h"

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "api/answers/tenant_view.h"
#include "api/answers/worker_view.h"
#include "api/batch.h"
#include "api/job/examples.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/json/schemas.h"
#include "api/lab.h"
#include "api/operations.h"
#include "api/schema_parts.h"
#include "core/base/text.h"

namespace api {
namespace {

constexpr std::string_view kFormatPart = "{.format}";

Json schema_of(std::string_view schema) {
  if (schema.empty()) {
    // Bytes. OpenAPI 3.1 needs no schema for them, but older generators need `format`.
    return {{"type", "string"}, {"format", "binary"}};
  }
  if (schema.front() == '{') {
    return Json::parse(schema);
  }
  return {{"$ref", "#/components/schemas/" + std::string(schema)}};
}

Json content_of(const Rows<ContentRow>& rows) {
  Json content = Json::object();
  for (const ContentRow& row : rows) {
    content[std::string(row.media_type)] = {{"schema", schema_of(row.schema)}};
  }
  return content;
}

Json path_parameter(const std::string& name, const Capabilities& capabilities) {
  Json schema = {{"type", "string"}};
  std::string doc = "Id.";
  if (name == "x" || name == "y") {
    schema = {{"type", "integer"}, {"minimum", 0}, {"maximum", limits::kFilmSide - 1}};
    doc = name == "x" ? "Column, in pixels of the full film." : "Row, from the top.";
  } else if (name == "signature") {
    doc =
        "Unpadded base64url of the HMAC-SHA256, by a signing key, of all that follows in the URL, "
        "with its slash and query; or `public` for a public preset. `tessera sign` makes it.";
  } else if (name == "preset" || name == "name") {
    doc = "Name of a preset.";
  } else if (name == "scene") {
    doc = "Id or built-in name of a scene, or SCENE:VARIANT.";
  } else if (name == "view") {
    doc = "THETA,PHI.FORMAT: degrees of the camera's orbit, and the extension of the format.";
  } else if (name == "sha256") {
    schema["pattern"] = "^[0-9a-f]{64}$";
    doc = "Hash of the content, hex.";
  } else if (name == "format") {
    Json formats = Json::array();
    for (const FormatView& format : capabilities.image_formats) {
      formats.push_back(format.extension);
    }
    if (!formats.empty()) {
      schema["enum"] = std::move(formats);
    }
    doc = "Extension of the image format.";
  }
  return {
      {"name", name}, {"in", "path"}, {"required", true}, {"description", doc}, {"schema", schema}};
}

Json parameters_of(const Operation& operation, const std::string& path,
                   const Capabilities& capabilities) {
  Json list = Json::array();
  for (std::size_t at = path.find('{'); at != std::string::npos; at = path.find('{', at + 1)) {
    list.push_back(path_parameter(path.substr(at + 1, path.find('}', at) - at - 1), capabilities));
  }
  if (operation.query != nullptr) {
    for (Json& parameter : operation.query(capabilities)) {
      list.push_back(std::move(parameter));
    }
  }
  for (const std::string_view name : operation.headers) {
    const auto rows = request_headers();
    const HeaderRow& row = *std::find_if(
        rows.begin(), rows.end(), [name](const HeaderRow& each) { return each.name == name; });
    Json header = {{"name", row.name},
                   {"in", "header"},
                   {"required", false},
                   {"description", row.summary},
                   {"schema", Json::parse(row.schema)}};
    // Go has one struct for query and headers: the header Range beside the query `range`.
    if (std::any_of(list.begin(), list.end(), [name](const Json& each) {
          return core::equal_ignoring_case(each["name"].get<std::string>(), name);
        })) {
      header["x-go-name"] = std::string(name) + "Header";
    }
    list.push_back(std::move(header));
  }
  return list;
}

/// Problems that the HTTP layer returns before a route is called.
constexpr std::array kTransportProblems = {408, 414, 431};

std::vector<int> problem_statuses(const Operation& operation) {
  std::vector<int> statuses(operation.problems.begin(), operation.problems.end());
  statuses.insert(statuses.end(), {400, 421, 500});  // not HTTP; wrong Host; internal error
  statuses.insert(statuses.end(), kTransportProblems.begin(), kTransportProblems.end());
  if (!operation.scope.empty()) {
    // No key; missing scope; unknown query parameter; too many requests.
    statuses.insert(statuses.end(), {401, 403, 422, 429});
  }
  if (!operation.scope.empty() || operation.id == "getReadiness") {
    statuses.push_back(503);
  }
  std::sort(statuses.begin(), statuses.end());
  statuses.erase(std::unique(statuses.begin(), statuses.end()), statuses.end());
  return statuses;
}

Json responses_of(const Operation& operation) {
  Json responses = Json::object();
  for (const ResponseRow& row : operation.responses) {
    Json response = {{"description", row.summary}};
    if (!row.content.empty()) {
      response["content"] = content_of(row.content);
    }
    if (row.status == 201) {
      response["headers"]["Location"] = {{"$ref", "#/components/headers/Location"}};
    }
    responses[std::to_string(row.status)] = std::move(response);
  }
  for (const int status : problem_statuses(operation)) {
    responses[std::to_string(status)] = {
        {"$ref", "#/components/responses/Problem" + std::to_string(status)}};
  }
  return responses;
}

Json operation_json(const Operation& operation, const std::string& id, const std::string& path,
                    const Capabilities& capabilities) {
  Json body = {
      {"operationId", id}, {"tags", Json::array({operation.tag})}, {"summary", operation.summary}};
  if (!operation.description.empty()) {
    body["description"] = operation.description;
  }
  if (operation.scope.empty()) {
    body["security"] = Json::array();
  }
  if (Json parameters = parameters_of(operation, path, capabilities); !parameters.empty()) {
    body["parameters"] = std::move(parameters);
  }
  if (!operation.request.empty()) {
    body["requestBody"] = {{"required", true}, {"content", content_of(operation.request)}};
  }
  body["responses"] = responses_of(operation);
  return body;
}

void add_operation(Json& paths, const Operation& operation, const Capabilities& capabilities) {
  const std::string method = core::in_lower_case(operation.method);
  std::string path(operation.path);
  const std::string id(operation.id);
  // OpenAPI has no optional path parts: `image{.format}` becomes two paths.
  const auto at = path.find(kFormatPart);
  path.erase(std::min(at, path.size()));
  paths[path][method] = operation_json(operation, id, path, capabilities);
  if (at != std::string::npos) {
    const std::string with_format = path + ".{format}";
    Json in_format = operation_json(operation, id + "InFormat", with_format, capabilities);
    in_format["summary"] = std::string(operation.summary) + " In the format of the extension.";
    paths[with_format][method] = std::move(in_format);
  }
}

Json problem_response(const std::string& words) {
  Json response = {{"description", words}};
  response["content"]["application/problem+json"] = {
      {"schema", {{"$ref", "#/components/schemas/Problem"}}}};
  return response;
}

Json problem_responses() {
  Json responses = Json::object();
  for (const ErrorRow& row : error_table()) {
    const std::string name = "Problem" + std::to_string(row.status);
    if (responses.contains(name)) {
      continue;
    }
    Json response = problem_response(std::string(row.title) + ".");
    if (row.status == 429 || row.status == 503) {
      response["headers"]["Retry-After"] = {{"$ref", "#/components/headers/Retry-After"}};
    }
    responses[name] = std::move(response);
  }
  return responses;
}

/// Returns the possible values of a problem's `type`. docs.js lists them at these anchors of /docs.
Json problem_types() {
  Json types = Json::array();
  for (const ErrorRow& row : error_table()) {
    types.push_back({{"type", "/docs#problem-" + std::string(row.slug)},
                     {"status", row.status},
                     {"title", row.title}});
  }
  return types;
}

Json tags() {
  struct Tag {
    const char* name;
    const char* doc;
  };
  constexpr std::array kTags = {
      Tag{"Jobs", "Submit, monitor and manage render jobs."},
      Tag{"Batches", "Sets of jobs that vary a template."},
      Tag{"Presets", "Job templates, and images by URL."},
      Tag{"Results", "Images, pixel values and error estimates."},
      Tag{"Streams", "Live events and tiles."},
      Tag{"Scenes", "Uploaded and built-in glTF scenes."},
      Tag{"Assets", "Content-addressed file storage."},
      Tag{"Service", "The server itself."},
      Tag{"Webhooks", "Calls made on events of jobs."},
      Tag{"Keys", "Access keys, and usage of tenants."},
      Tag{"Workers",
          "Machines that render units of jobs; everything except the list is for `tessera "
          "worker`."},
      Tag{"Laboratory", "Monte Carlo experiments."},
  };
  Json list = Json::array();
  for (const Tag& tag : kTags) {
    list.push_back({{"name", tag.name}, {"description", tag.doc}});
  }
  return list;
}

Json components() {
  Json schemas = Json::object();
  schemas["JobRequest"] = as_request(job_request_schema());
  schemas["JobPatch"] = as_request(job_patch_schema());
  schemas["SceneFromAssets"] = as_request(scene_from_assets_schema());
  schemas["ExtendRequest"] = as_request(extend_schema());
  schemas["MergeRequest"] = as_request(merge_schema());
  add_preset_schemas(schemas);
  schemas["TicketRequest"] = as_request(ticket_request_schema());
  schemas["LabRequest"] = as_request(lab_request_schema());
  add_view_schemas(schemas);
  add_tenant_schemas(schemas);
  add_worker_schemas(schemas);
  add_batch_schemas(schemas);
  schemas["ComparisonRequest"] = as_request(comparison_request_schema());
  name_parts(schemas);
  for (const auto& schema : schemas.items()) {
    if (const Json example = example_of(schema.key()); !example.is_null()) {
      schema.value()["examples"] = Json::array({example});
    }
  }
  Json body;
  body["schemas"] = std::move(schemas);
  body["responses"] = problem_responses();
  for (const HeaderRow& row : response_headers()) {
    body["headers"][std::string(row.name)] = {{"description", row.summary},
                                              {"schema", Json::parse(row.schema)}};
  }
  body["securitySchemes"] = {
      {"bearer",
       {{"type", "http"},
        {"scheme", "bearer"},
        {"description",
         "A key of the server. If no key exists, only local connections are accepted."}}},
      {"cookie",
       {{"type", "apiKey"},
        {"in", "cookie"},
        {"name", "tessera_session"},
        {"description", "Session cookie that the web page gets in exchange for the key."}}}};
  return body;
}

}  // namespace

Json openapi_document(const Capabilities& capabilities, std::string_view version,
                      const std::string& base_path) {
  Json document;
  document["openapi"] = "3.1.0";
  document["info"] = {
      {"title", "Tessera"},
      {"version", version},
      {"summary", "A render server."},
      {"description",
       "Upload a glTF scene, post a job, watch the image converge. Bodies are JSON in UTF-8; "
       "errors are application/problem+json (RFC 9457) with JSON pointers to the errors; unknown "
       "fields are refused; every response has X-Request-Id."},
      {"license", {{"name", "MIT"}, {"identifier", "MIT"}}}};
  document["servers"] = Json::array({{{"url", base_path + "/"}, {"description", "This server."}}});
  // The empty requirement: a server on loopback needs no key.
  document["security"] =
      Json::array({{{"bearer", Json::array()}}, {{"cookie", Json::array()}}, Json::object()});
  document["tags"] = tags();
  Json paths = Json::object();
  for (const Operation& operation : operations()) {
    add_operation(paths, operation, capabilities);
  }
  document["paths"] = std::move(paths);
  document["components"] = components();
  document["x-problem-types"] = problem_types();
  add_number_formats(document);
  return document;
}

std::string openapi_json(const Capabilities& capabilities, std::string_view version,
                         const std::string& base_path) {
  return dump(openapi_document(capabilities, version, base_path));
}

}  // namespace api
