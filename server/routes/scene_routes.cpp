// Scenes: upload, describe, list, delete.

#include <cstddef>
#include <cstring>
#include <mutex>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/queries/queries.h"
#include "api/requests.h"
#include "core/scene_io/gltf_uri.h"
#include "server/http/conditional.h"
#include "server/http/text.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

/// The answer to a client that has sent these names the next ones.
constexpr std::size_t kMissingShown = 1000;

/// Reads the body into memory once it is reserved; the HTTP server limits its size.
core::Result<SceneService::Upload> read_body(const RouteContext& context, const Request& request) {
  constexpr std::uint64_t kFirst = std::uint64_t{64} << 10U;
  const auto declared = request.body_reader->declared_bytes();
  auto lease = context.memory.take(
      {.bytes = declared.value_or(kFirst), .tenant = request.access.tenant}, "the upload");
  if (!lease) {
    return lease.error();
  }
  core::Bytes content;
  // Reserves address space; the system allocates pages as the content arrives.
  content.reserve(static_cast<std::size_t>(declared.value_or(kFirst)));
  core::Status room = core::ok_status();
  const bool complete = request.body_reader->read([&](std::string_view piece) {
    if (content.size() + piece.size() > content.capacity()) {
      // Doubles the buffer for a body of unknown length; both buffers exist while the content is
      // moved.
      const std::uint64_t before = content.capacity();
      const std::uint64_t next = std::max<std::uint64_t>(2 * before, content.size() + piece.size());
      room = lease->grow(next);
      if (!room) {
        return false;
      }
      content.reserve(static_cast<std::size_t>(next));
      lease->shrink_to(next);
    }
    const auto* bytes = reinterpret_cast<const std::byte*>(piece.data());
    content.insert(content.end(), bytes, bytes + piece.size());
    return true;
  });
  if (!room) {
    return room.error();
  }
  if (!complete) {
    return Error{ErrorCode::kBadSyntax, "the body was cut short", ""};
  }
  return SceneService::Upload(std::move(content), *std::move(lease));
}

Response added_answer(const Request& request, const core::Result<SceneService::Added>& added) {
  if (!added) {
    return error_answer(request, added.error());
  }
  if (!added->missing.empty()) {
    api::Problem problem = api::from_error(
        core::missing_files("files that the scene refers to are missing", added->missing));
    for (const std::string& name : added->missing) {
      if (problem.errors.size() == kMissingShown) {
        break;
      }
      constexpr std::size_t kNameShown = 1024;  // No client has a file of a longer name.
      if (name.size() > kNameShown) {
        continue;
      }
      problem.errors.push_back({api::join_pointer("/files", name), "is missing"});
    }
    return problem_answer(request, problem);
  }
  Response response = json_response(added->known ? 200 : 201, added->description);
  response.headers.set("Location", "/v1/scenes/" + added->id);
  return response;
}

bool begins_with(const core::Bytes& content, std::string_view text) {
  return content.size() >= text.size() &&
         std::memcmp(content.data(), text.data(), text.size()) == 0;
}
/// Of every record of a zip archive (APPNOTE.TXT, 4.3), and of a GLB (glTF 2.0, 4.4.2). No JSON
/// begins so.
constexpr std::string_view kZipMark = "PK";
constexpr std::string_view kGlbMark = "glTF";

Response create(const RouteContext& context, Request& request) {
  const auto query = api::parse_scene_upload_query(request.query_params);
  if (!query) {
    return problem_answer(request, query.problem());
  }
  const SceneOrigin origin{.access = request.access,
                           .name = query->name,
                           .is_strict = query->strict,
                           .stop = request.stop_token()};
  const std::string type = media_type(request.header("Content-Type").value_or(""));
  const bool is_scene = type == "model/gltf-binary" || type == "model/gltf+json";
  const bool is_zip = type == "application/zip" || type == "application/x-zip-compressed";
  const bool is_json = type == "application/json";
  if (!is_scene && !is_zip && !is_json && type != "application/octet-stream") {
    return error_answer(request, ErrorCode::kUnsupportedFormat,
                        "\"" + type +
                            "\" is not one of model/gltf-binary, model/gltf+json, "
                            "application/zip, application/octet-stream, application/json");
  }
  auto upload = read_body(context, request);
  if (!upload) {
    return error_answer(request, upload.error());
  }
  const core::Bytes& content = upload->content;
  // The first bytes decide: of several types, generated clients choose the one of JSON for any
  // file.
  if (is_zip || begins_with(content, kZipMark)) {
    return added_answer(request, context.scenes.add_zip(*std::move(upload), origin));
  }
  if (!is_json || begins_with(content, kGlbMark)) {
    return added_answer(request, context.scenes.add_file(*std::move(upload), origin));
  }
  const auto parsed = api::parse_scene_from_assets(
      std::string_view(reinterpret_cast<const char*>(content.data()), content.size()));
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  return added_answer(request, context.scenes.add_from_assets(*parsed, origin));
}

Response list(const RouteContext& context, Request& request) {
  const auto query = api::parse_scene_list_query(request.query_params);
  if (!query) {
    return problem_answer(request, query.problem());
  }
  const auto before = cursor_sequence(query->cursor);
  if (!query->cursor.empty() && !before) {
    return error_answer(request, Error{ErrorCode::kBadSyntax, "invalid page cursor", "/cursor"});
  }
  auto rows = context.scenes.list(request.access, before, query->limit + 1);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  std::optional<std::string> next;
  if (static_cast<int>(rows->size()) > query->limit) {
    rows->pop_back();
    next = std::to_string(rows->back().sequence);
  }
  std::vector<std::string> scenes;
  for (SceneRow& row : *rows) {
    scenes.push_back(std::move(row.description));
  }
  return list_answer(request, api::scene_list_json(scenes, next), next);
}

Response describe(const RouteContext& context, Request& request) {
  auto description =
      context.scenes.description(std::string(request.path_param("id")), request.access);
  if (!description) {
    return error_answer(request, description.error());
  }
  Response response = json_response(200, std::move(*description));
  response.compressible = true;
  return response;
}

Response remove(const RouteContext& context, Request& request) {
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
  table["createScene"] = {.handler = &create,
                          .body = BodyPolicy::stream(context.config.upload_bytes_max)};
  table["listScenes"] = {.handler = &list};
  table["getScene"] = {.handler = &describe};
  table["deleteScene"] = {.handler = &remove};
  table["getSceneGltf"] = {.handler = &gltf};
}

}  // namespace server
