#include "api/docs_page.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "api/docs_style.h"
#include "api/errors.h"
#include "api/openapi.h"

namespace api {
namespace {

std::string escape(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  });
  return text;
}

std::string text_of(const Json& object, const char* key) {
  const auto member = object.find(key);
  return member != object.end() && member->is_string() ? member->get<std::string>() : std::string();
}

/// Escaped, with `code` between backquotes.
std::string prose(const std::string& text) {
  std::string out;
  bool in_code = false;
  for (const char c : escape(text)) {
    if (c == '`') {
      out += in_code ? "</code>" : "<code>";
      in_code = !in_code;
    } else {
      out += c;
    }
  }
  return out + (in_code ? "</code>" : "");
}

std::string code(std::string_view text) { return "<code>" + escape(text) + "</code>"; }

/// Last part of a "$ref".
std::string ref_name(const Json& schema) {
  const std::string ref = text_of(schema, "$ref");
  return ref.substr(ref.rfind('/') + 1);
}

std::string schema_link(const std::string& name) {
  return "<a href=\"#schema-" + name + "\">" + escape(name) + "</a>";
}

/// "integer or null", "array of string", a link.
std::string type_html(const Json& schema) {
  if (schema.contains("$ref")) {
    return schema_link(ref_name(schema));
  }
  if (schema.contains("anyOf") && !schema.contains("properties")) {
    std::string out;
    for (const Json& each : schema["anyOf"]) {
      out += (out.empty() ? "" : " or ") + type_html(each);
    }
    return out;
  }
  if (schema.contains("const")) {
    return "always " + code(dump(schema["const"]));
  }
  if (!schema.contains("type")) {
    return "bytes";
  }
  std::string out;
  const Json types = schema["type"].is_array() ? schema["type"] : Json::array({schema["type"]});
  for (const Json& type : types) {
    out += (out.empty() ? "" : " or ") + type.get<std::string>();
    if (type == "array" && schema.contains("items")) {
      out += " of " + type_html(schema["items"]);
    }
  }
  return out;
}

/// Range, names and default, as far as there are any.
std::string facts_html(const Json& schema) {
  std::vector<std::string> facts = {type_html(schema)};
  if (schema.contains("enum")) {
    std::string names;
    for (const Json& name : schema["enum"]) {
      names += (names.empty() ? "" : " ") +
               code(name.is_string() ? name.get<std::string>() : dump(name));
    }
    facts.push_back(names);
  }
  const bool min_open = schema.contains("exclusiveMinimum");
  const bool max_open = schema.contains("exclusiveMaximum");
  const char* min = min_open ? "exclusiveMinimum" : "minimum";
  const char* max = max_open ? "exclusiveMaximum" : "maximum";
  if (schema.contains(min) && schema.contains(max)) {
    facts.push_back((min_open ? "above " : "") + dump(schema[min]) + " to " +
                    (max_open ? "below " : "") + dump(schema[max]));
  }
  if (schema.contains("maxLength")) {
    facts.push_back("at most " + dump(schema["maxLength"]) + " characters");
  }
  if (schema.contains("default") && !schema.contains("const")) {
    facts.push_back("default " + code(dump(schema["default"])));
  }
  std::string out;
  for (const std::string& fact : facts) {
    out += (out.empty() ? "" : ", ") + fact;
  }
  return out;
}

/// The object whose members are worth a table of their own: the schema, or what its array holds.
const Json* inner_object(const Json& schema) {
  if (schema.contains("properties")) {
    return &schema;
  }
  if (schema.contains("items")) {
    return inner_object(schema["items"]);
  }
  const auto more = schema.find("additionalProperties");
  return more != schema.end() && more->is_object() ? inner_object(*more) : nullptr;
}

void add_rows(std::string& out, const Json& object, const std::string& prefix) {
  const Json required = object.value("required", Json::array());
  for (const auto& property : object["properties"].items()) {
    const Json& schema = property.value();
    const bool is_required =
        std::find(required.begin(), required.end(), property.key()) != required.end();
    const Json* inner = inner_object(schema);
    out += "<tr><td>" + code(prefix + property.key()) + "</td><td>" +
           prose(text_of(schema, "description")) + "<span class=\"facts\">" + facts_html(schema) +
           (is_required ? ", required" : "") + "</span></td></tr>";
    if (inner != nullptr) {
      const std::string separator = &schema == inner ? "." : "[].";
      add_rows(out, *inner, prefix + property.key() + separator);
    }
  }
}

std::string members_table(const Json& schema) {
  std::string rows;
  add_rows(rows, schema, "");
  return "<div "
         "class=\"scroll\"><table><thead><tr><th>Member</th><th>Meaning</th></tr></thead><tbody>" +
         rows + "</tbody></table></div>";
}

std::string content_html(const Json& content) {
  std::string out;
  for (const auto& media : content.items()) {
    const Json& schema = media.value()["schema"];
    out += (out.empty() ? "" : ", ") + code(media.key());
    if (schema.contains("$ref") || schema.contains("anyOf")) {
      out += " " + type_html(schema);
    }
  }
  return out;
}

std::string parameters_html(const Json& operation) {
  if (!operation.contains("parameters")) {
    return {};
  }
  std::string out =
      "<h4>Parameters</h4><div "
      "class=\"scroll\"><table><thead><tr><th>Name</th><th>Meaning</th></tr>"
      "</thead><tbody>";
  for (const Json& parameter : operation["parameters"]) {
    out += "<tr><td>" + code(text_of(parameter, "name")) + "</td><td>" +
           prose(text_of(parameter, "description")) + "<span class=\"facts\">" +
           text_of(parameter, "in") + ", " + facts_html(parameter["schema"]) + "</span></td></tr>";
  }
  return out + "</tbody></table></div>";
}

std::string responses_html(const Json& operation, const Json& openapi) {
  std::string out =
      "<h4>Answers</h4><div class=\"scroll\"><table><thead><tr><th>Status</th><th>Meaning</th></tr>"
      "</thead><tbody>";
  std::string problems;
  for (const auto& response : operation["responses"].items()) {
    const Json& body = response.value();
    if (body.contains("$ref")) {
      const Json& problem = openapi["components"]["responses"][ref_name(body)];
      problems += (problems.empty() ? "" : ", ") + std::string("<a href=\"#problems\" title=\"") +
                  escape(text_of(problem, "description")) + "\">" + response.key() + "</a>";
      continue;
    }
    out += "<tr><td>" + response.key() + "</td><td>" + prose(text_of(body, "description"));
    if (body.contains("content")) {
      out += "<span class=\"facts\">" + content_html(body["content"]) + "</span>";
    }
    out += "</td></tr>";
  }
  if (!problems.empty()) {
    out += "<tr><td>Problems</td><td>" + problems + "</td></tr>";
  }
  return out + "</tbody></table></div>";
}

/// What to type: the first media type of the request, with its example.
std::string curl_example(const std::string& method, const std::string& path, const Json& operation,
                         const Json& openapi) {
  std::string out = "curl ";
  if (path.ends_with("/events") || path.ends_with("/tiles")) {
    out += "-N ";
  }
  if (method != "get" && !(method == "post" && operation.contains("requestBody"))) {
    out += "-X " + upper_case(method) + " ";
  }
  std::string target = path;
  if (const auto at = target.find("{format}"); at != std::string::npos) {
    target.replace(at, 8, "png");
    out += "-o picture.png ";
  }
  out += "http://127.0.0.1:8080" + target;
  if (!operation.contains("requestBody")) {
    return out;
  }
  const auto media = operation["requestBody"]["content"].items().begin();
  out += " \\\n  -H 'Content-Type: " + media.key() + "'";
  const Json& schema = media.value()["schema"];
  const Json& schemas = openapi["components"]["schemas"];
  if (schema.contains("$ref") && schemas[ref_name(schema)].contains("examples")) {
    return out + " \\\n  -d '" + dump(schemas[ref_name(schema)]["examples"][0]) + "'";
  }
  return out + " \\\n  --data-binary @" +
         (media.key() == "model/gltf-binary" ? "scene.glb" : "FILE");
}

std::string operation_html(const std::string& method, const std::string& path,
                           const Json& operation, const Json& openapi) {
  const std::string id = text_of(operation, "operationId");
  std::string out = "<article id=\"" + id + "\"><h3>" + prose(text_of(operation, "summary")) +
                    "</h3><div class=\"route\"><code class=\"method " + method + "\">";
  out += upper_case(method) + "</code>" + code(path) + "</div>";
  if (const std::string description = text_of(operation, "description"); !description.empty()) {
    out += "<p>" + prose(description) + "</p>";
  }
  if (operation.contains("requestBody")) {
    out += "<p><span class=\"soft\">Body:</span> " +
           content_html(operation["requestBody"]["content"]) + "</p>";
  }
  out += "<pre>" + escape(curl_example(method, path, operation, openapi)) + "</pre>";
  out += parameters_html(operation) + responses_html(operation, openapi);
  return out + "</article>";
}

template <typename Visit>
void each_operation(const Json& openapi, const std::string& tag, const Visit& visit) {
  for (const auto& path : openapi["paths"].items()) {
    for (const auto& method : path.value().items()) {
      if (method.value()["tags"][0] == tag) {
        visit(method.key(), path.key(), method.value());
      }
    }
  }
}

std::string navigation_html(const Json& openapi) {
  std::string out = "<nav aria-label=\"Contents\"><a class=\"name\" href=\"/\">" +
                    escape(text_of(openapi["info"], "title")) + "</a>";
  for (const Json& tag : openapi["tags"]) {
    const std::string name = text_of(tag, "name");
    out += "<h2><a href=\"#tag-" + name + "\">" + name + "</a></h2><ul>";
    each_operation(openapi, name, [&](const auto& method, const auto&, const Json& operation) {
      out += "<li><a href=\"#" + text_of(operation, "operationId") + "\"><code class=\"" + method +
             "\">" + upper_case(method) + "</code> " + escape(text_of(operation, "summary")) +
             "</a></li>";
    });
    out += "</ul>";
  }
  out += "<h2><a href=\"#schemas\">Schemas</a></h2><ul>";
  for (const auto& schema : openapi["components"]["schemas"].items()) {
    out += "<li><a href=\"#schema-" + schema.key() + "\">" + schema.key() + "</a></li>";
  }
  return out + "</ul><h2><a href=\"#problems\">Problems</a></h2></nav>";
}

std::string schemas_html(const Json& openapi) {
  std::string out = "<h2 id=\"schemas\">Schemas</h2>";
  for (const auto& entry : openapi["components"]["schemas"].items()) {
    const Json& schema = entry.value();
    out += "<article id=\"schema-" + entry.key() + "\"><h3>" + entry.key() + "</h3><p>" +
           prose(text_of(schema, "description")) + "</p>" + members_table(schema);
    if (schema.contains("examples")) {
      out += "<details><summary>Example</summary><pre>" +
             escape(dump_pretty(schema["examples"][0])) + "</pre></details>";
    }
    out += "</article>";
  }
  return out;
}

std::string problems_html() {
  std::string out =
      "<h2 id=\"problems\">Problems</h2><p>Errors are <code>application/problem+json</code>. "
      "Faults of the "
      "input are listed in <code>errors</code>, each with a JSON pointer to the place; all that "
      "were "
      "found, not only the first.</p><div class=\"scroll\"><table><thead><tr><th>Status</th>"
      "<th>Meaning</th></tr></thead><tbody>";
  for (const ErrorRow& row : error_table()) {
    out += "<tr id=\"problem-" + std::string(row.slug) + "\"><td>" + std::to_string(row.status) +
           "</td><td>" + escape(row.title) + ".<span class=\"facts\">" +
           code("/docs#problem-" + std::string(row.slug)) + "</span></td></tr>";
  }
  return out + "</tbody></table></div>";
}

}  // namespace

std::string docs_page(const Json& openapi) {
  const Json& info = openapi["info"];
  const std::string title = escape(text_of(info, "title"));
  std::string out = "<!doctype html><html lang=\"en\"><head><meta charset=\"utf-8\"><title>" +
                    title +
                    " API</title><meta name=\"viewport\" content=\"width=device-width, "
                    "initial-scale=1\"><link rel=\"icon\" href=\"data:,\"><style>";
  out += kDocsStyle;
  out += "</style></head><body><div class=\"page\">" + navigation_html(openapi) + "<main><h1>" +
         title + " API</h1><p>" + prose(text_of(info, "description")) +
         "</p><p class=\"soft\">Version " + escape(text_of(info, "version")) +
         ". As a document: <a href=\"/openapi.json\">" + "/openapi.json</a> (OpenAPI " +
         escape(text_of(openapi, "openapi")) + ").</p>";
  for (const Json& tag : openapi["tags"]) {
    const std::string name = text_of(tag, "name");
    out += "<section><h2 id=\"tag-" + name + "\">" + name + "</h2><p class=\"soft\">" +
           prose(text_of(tag, "description")) + "</p>";
    each_operation(openapi, name, [&](const auto& method, const auto& path, const Json& operation) {
      out += operation_html(method, path, operation, openapi);
    });
    out += "</section>";
  }
  return out + schemas_html(openapi) + problems_html() + "</main></div></body></html>";
}

std::string docs_page(const Capabilities& capabilities, std::string_view version) {
  return docs_page(openapi_document(capabilities, version));
}

}  // namespace api
