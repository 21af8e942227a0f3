// Scenes: upload, describe, list, delete.

#include <mutex>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <utility>

#include "api/answers/job_view.h"
#include "api/queries/queries.h"
#include "api/requests.h"
#include "server/http/conditional.h"
#include "server/http/text.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/scene_upload.h"
#include "server/routes/with_query.h"

namespace server {
namespace {

using core::ErrorCode;

/// name: given by the upload; empty: none.
Response added_answer(const Request& request, const std::string& name,
                      const core::Result<SceneService::Added>& added) {
  if (auto refused = refused_scene(request, added)) {
    return *std::move(refused);
  }
  Response response = added->known && !name.empty()
                          ? json_response(200, api::known_scene_json(added->description, name))
                          : json_response(added->known ? 200 : 201, added->description);
  response.headers.set("Location", "/v1/scenes/" + added->id);
  return response;
}

Response create_scene(const RouteContext& context, Request& request,
                      const api::SceneUploadQuery& query) {
  SceneOrigin origin{.access = request.access,
                     .name = query.name,
                     .is_strict = query.strict,
                     .stop = request.stop_token()};
  const std::string type = media_type(request.header("Content-Type").value_or(""));
  const bool is_scene = type.starts_with("model/");
  const bool is_zip = type == "application/zip" || type == "application/x-zip-compressed";
  const bool is_json = type == "application/json";
  if (!is_scene && !is_zip && !is_json && type != "application/octet-stream") {
    return error_answer(request, ErrorCode::kUnsupportedFormat,
                        "\"" + type +
                            "\" is not one of model/gltf-binary, model/gltf+json, model/stl, "
                            "model/obj, model/ply, model/3mf, application/zip, "
                            "application/octet-stream, application/json");
  }
  auto upload = read_body(context, request);
  if (!upload) {
    return error_answer(request, upload.error());
  }
  const auto converted = context.scenes.convert(*upload, format_of(type, query.name), {}, origin);
  if (!converted) {
    return error_answer(request, converted.error());
  }
  const std::string_view content(reinterpret_cast<const char*>(upload->content.data()),
                                 upload->content.size());
  // The first bytes decide: of several types, generated clients choose the one of JSON for any
  // file.
  if (!*converted && (is_zip || is_zip_archive(content))) {
    return added_answer(request, query.name, context.scenes.add_zip(*std::move(upload), origin));
  }
  if (!is_json || is_glb(content)) {
    return added_answer(request, query.name, context.scenes.add_file(*std::move(upload), origin));
  }
  const auto parsed = api::parse_scene_from_assets(content);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  return added_answer(request, query.name, context.scenes.add_from_assets(*parsed, origin));
}

Response list_scenes(const RouteContext& context, Request& request, const api::ListQuery& query) {
  const auto before = page_start(query.cursor);
  if (!before) {
    return error_answer(request, before.error());
  }
  auto rows = context.scenes.list(request.access, *before, query.limit + 1);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  const auto next = next_page(*rows, query.limit);
  std::vector<std::string> scenes;
  for (SceneRow& row : *rows) {
    scenes.push_back(std::move(row.description));
  }
  return list_answer(request, api::scene_list_json(scenes, next), next);
}

Response describe_scene(const RouteContext& context, Request& request) {
  auto description =
      context.scenes.description(std::string(request.path_param("id")), request.access);
  if (!description) {
    return error_answer(request, description.error());
  }
  Response response = json_response(200, std::move(*description));
  response.compressible = true;
  return response;
}

Response remove_scene(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("id"));
  if (context.scenes.builtin_glb(id) != nullptr) {
    return error_answer(request, ErrorCode::kConflict, "a built-in scene cannot be deleted");
  }
  // No request can refer to the scene between the check and its deletion.
  const std::unique_lock<std::shared_mutex> naming(context.scenes.names_mutex());
  const auto in_use = [&](const std::optional<std::string>& tenant) {
    return context.jobs.index().needs_scene(id, tenant);
  };
  if (const auto removed = context.scenes.remove(id, request.access, in_use); !removed) {
    return error_answer(request, removed.error());
  }
  return empty_response();
}

Response gltf(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("id"));
  const auto glb = context.scenes.builtin_glb(id);
  if (!glb) {
    return error_answer(request, ErrorCode::kNotFound,
                        "no built-in scene has the name \"" + id + "\"");
  }
  const std::string etag = make_etag(id + "-" + std::to_string(glb->size()) + "-" +
                                     context.about.build.id.substr(0, 16));
  if (is_not_modified(request, etag)) {
    return not_modified(etag);
  }
  Response response = bytes_response(
      200, "model/gltf-binary",
      std::make_shared<const std::string>(reinterpret_cast<const char*>(glb->data()), glb->size()));
  response.headers.set("ETag", etag);
  response.headers.set("Content-Disposition", "attachment; filename=\"" + id + ".glb\"");
  return response;
}

}  // namespace

void add_scene_handlers(const RouteContext& context, HandlerTable& table) {
  table["createScene"] = {.handler = with_query(&api::parse_scene_upload_query, &create_scene),
                          .body = BodyPolicy::stream(context.config.upload_bytes_max)};
  table["listScenes"] = {.handler = with_query(&api::parse_scene_list_query, &list_scenes)};
  table["getScene"] = {.handler = &describe_scene};
  table["deleteScene"] = {.handler = &remove_scene};
  table["getSceneGltf"] = {.handler = &gltf};
}

}  // namespace server
