// POST /v1/render: upload, job and image in one request; and images by URL, which share its jobs.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/presets.h"
#include "api/queries/render_query.h"
#include "core/base/invalid.h"
#include "core/base/sha256.h"
#include "server/config/url_limits.h"
#include "server/http/form_data.h"
#include "server/http/text.h"
#include "server/jobs/url_jobs.h"
#include "server/jobs/waiting_clients.h"
#include "server/routes/answers.h"
#include "server/routes/asset_upload.h"
#include "server/routes/context.h"
#include "server/routes/job_answers.h"
#include "server/routes/picture_answer.h"
#include "server/routes/picture_by_url.h"
#include "server/routes/render_drake.h"
#include "server/routes/render_order.h"
#include "server/routes/scene_upload.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

/// A request as it was sent. Views are of the body in `upload`.
struct Sent {
  SceneService::Upload upload;
  std::string_view scene = {};
  std::string scene_name = {};  ///< of its file; empty: unknown
  std::string scene_type = {};  ///< media type; empty: unknown
  std::optional<std::string_view> environment = {};
  std::vector<SceneService::SideFile> sides = {};
  std::string_view job = {};
};

/// Sorts the parts of a form. Fields of text are parameters, as those of the query.
core::Status read_form(std::string_view body, std::string_view content_type, Sent& sent,
                       Request& request) {
  auto parts =
      parse_form_data(body, content_type, static_cast<std::size_t>(api::limits::kSceneFiles));
  if (!parts) {
    return parts.error();
  }
  std::size_t text_bytes = 0;  // They are copied, unlike files.
  const auto take_once = [](auto& place, std::string_view content, const std::string& name) {
    const bool is_first = place == std::decay_t<decltype(place)>{};
    place = content;
    return is_first ? core::ok_status()
                    : core::Status(core::invalid("/" + name, "appears more than once"));
  };
  for (FormPart& part : *parts) {
    const std::string_view content = part.content(body);
    core::Status taken = core::ok_status();
    text_bytes += part.name == "job" || !part.is_file() ? content.size() : 0;
    if (text_bytes > static_cast<std::size_t>(api::limits::kBodyBytes)) {
      return Error{ErrorCode::kTooLarge,
                   "the job and the fields of text have more than " +
                       std::to_string(api::limits::kBodyBytes) + " bytes",
                   ""};
    }
    if (part.name == "job") {
      taken = take_once(sent.job, content, part.name);
    } else if (!part.is_file()) {
      request.query_params.emplace_back(std::move(part.name), content);
    } else if (part.name == "scene") {
      taken = take_once(sent.scene, content, part.name);
      sent.scene_name = part.filename.value_or("");
      sent.scene_type = part.content_type;
    } else if (part.name == "environment") {
      taken = take_once(sent.environment, content, part.name);
    } else if (part.name != "file") {
      taken = core::invalid(api::join_pointer("", part.name),
                            "unknown part; files are scene, environment, file and job");
    } else if (part.filename.value_or("").empty()) {
      taken = core::invalid("/file", "needs the name that the scene gives it");
    } else {
      sent.sides.push_back({.name = *std::move(part.filename), .content = content});
    }
    if (!taken) {
      return taken;
    }
  }
  return core::ok_status();
}

core::Result<Sent> read_request(const RouteContext& context, Request& request) {
  auto upload = read_body(context, request);
  if (!upload) {
    return upload.error();
  }
  Sent sent{.upload = *std::move(upload)};
  const std::string_view body(reinterpret_cast<const char*>(sent.upload.content.data()),
                              sent.upload.content.size());
  const std::string content_type(request.header("Content-Type").value_or(""));
  const std::string type = media_type(content_type);
  if (type == "multipart/form-data") {
    if (const auto read = read_form(body, content_type, sent, request); !read) {
      return read.error();
    }
  } else if (type == "application/json") {
    sent.job = body;
  } else {
    sent.scene = body;
    sent.scene_type = type;
  }
  return sent;
}

/// Adds the uploaded scene. Pre: there is one; nothing else of the request is needed afterwards.
core::Result<SceneService::Added> add_scene(const RouteContext& context, const Request& request,
                                            Sent sent) {
  SceneOrigin origin{
      .access = request.access, .name = sent.scene_name, .stop = request.stop_token()};
  // Files of other formats replace the form by a GLB.
  if (const std::string format = format_of(sent.scene_type, sent.scene_name);
      !format.empty() || is_zip_archive(sent.scene)) {
    const auto* first = reinterpret_cast<const std::byte*>(sent.scene.data());
    SceneService::Upload scene(core::Bytes(first, first + sent.scene.size()));
    if (auto room = sent.upload.lease.grow(sent.scene.size()); !room) {
      return room.error();
    }
    std::swap(scene.lease, sent.upload.lease);
    const auto converted = context.scenes.convert(scene, format, sent.sides, origin);
    if (!converted) {
      return converted.error();
    }
    if (*converted) {
      return context.scenes.add_file(std::move(scene), origin);
    }
    std::swap(scene.lease, sent.upload.lease);
  }
  core::Bytes& content = sent.upload.content;
  const auto* begin = reinterpret_cast<const std::byte*>(sent.scene.data());
  if (!sent.sides.empty()) {
    if (is_zip_archive(sent.scene)) {
      return core::invalid("/file", "a zip contains all files of its scene");
    }
    // The sides stay where they are; the scene gets memory of its own.
    auto room = sent.upload.lease.grow(sent.scene.size());
    if (!room) {
      return room.error();
    }
    SceneService::Upload scene(core::Bytes(begin, begin + sent.scene.size()));
    std::swap(scene.lease, sent.upload.lease);
    return context.scenes.add_with_sides(std::move(scene), sent.sides, origin);
  }
  const auto offset = begin - content.data();
  const bool is_zip = is_zip_archive(sent.scene);
  content.resize(static_cast<std::size_t>(offset) + sent.scene.size());
  content.erase(content.begin(), content.begin() + offset);
  return is_zip ? context.scenes.add_zip(std::move(sent.upload), origin)
                : context.scenes.add_file(std::move(sent.upload), origin);
}

Response render(const RouteContext& context, WaitingClients& clients, Request& request) {
  auto sent = read_request(context, request);
  if (!sent) {
    return error_answer(request, sent.error());
  }
  auto query = api::parse_render_query(request.query_params, tone_map_names());
  if (!query) {
    return problem_answer(request, query.problem());
  }
  RenderOrder order{.query = *std::move(query), .job = std::string(sent->job)};
  if (auto refused = check_order(request, order)) {
    return *std::move(refused);
  }
  if (sent->environment) {
    const std::string_view content = *sent->environment;
    const auto stored =
        store_asset(context, request.access,
                    {.id = core::sha256_hex(content.data(), content.size()),
                     .declared_bytes = content.size(),
                     .read = [&](const BodyReader::Sink& sink) { return sink(content); }});
    if (!stored) {
      return error_answer(request, stored.error());
    }
    order.uploads.environment_asset = stored->id;
  }
  if (auto refused = find_preset(context, request, order)) {
    return *std::move(refused);
  }
  if (!sent->scene.empty()) {
    const auto added = add_scene(context, request, *std::move(sent));
    if (auto refused = refused_scene(request, added)) {
      return *std::move(refused);
    }
    order.uploads.scene = added->id;
  } else if (!sent->sides.empty()) {
    return error_answer(request,
                        core::invalid("/file", "needs the scene's document, the part \"scene\""));
  } else {
    sent->upload = SceneService::Upload({});
  }
  return render_order(context, clients, request, std::move(order)).response;
}

}  // namespace

void add_render_handlers(const RouteContext& context, HandlerTable& table) {
  const auto clients = std::make_shared<WaitingClients>();
  table["render"] = {
      .handler = [clients](const RouteContext& routes,
                           Request& request) { return render(routes, *clients, request); },
      .body = BodyPolicy::stream(context.config.upload_bytes_max)};
  table["renderDrake"] = {
      .handler = [clients](const RouteContext& routes,
                           Request& request) { return render_drake(routes, *clients, request); },
      .body = BodyPolicy::stream(context.config.upload_bytes_max)};
  const auto started = std::make_shared<UrlJobs>(UrlJobs::Bounds{
      .of_preset = kUrlJobsOfPreset, .of_tenant = url_jobs_of_tenant(context.config)});
  table["getPicture"] = {
      .handler = [clients, started](const RouteContext& routes, Request& request) {
        return picture_by_url(routes, {.clients = *clients, .started = *started}, request);
      }};
}

}  // namespace server
