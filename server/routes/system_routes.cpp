// Probes, metrics, the API description, the web page, and the server's capabilities.

#include <memory>
#include <string>
#include <utility>

#include "api/json/values.h"
#include "api/openapi.h"
#include "core/base/sha256.h"
#include "server/http/conditional.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/metrics_page.h"
#include "server/routes/page.h"
#include "server/scenes/single_flight_cache.h"
#include "server/store/files.h"

namespace server {
namespace {

auto file_handler(const PageFile& file) {
  return [&file](const RouteContext&, Request& request) { return page_answer(request, file); };
}

/// Space needed for a job's record, its events and their journal: 16 pages of the database.
constexpr std::uint64_t kRecordBytes = std::uint64_t{16} * 4096;

bool is_disk_full(const RouteContext& context) {
  const auto space = disk_space(context.data.path());
  return context.quota.is_disk_full() || (space && space->free_bytes < kRecordBytes);
}

Response liveness(const RouteContext& /*context*/, Request& /*request*/) {
  return text_response(200, "text/plain; charset=utf-8", "alive\n");
}

Response metrics(const RouteContext& context, Request& /*request*/) {
  return text_response(200, "text/plain; version=0.0.4; charset=utf-8", metrics_text(context));
}

Response start_session(const RouteContext& context, Request& request) {
  return context.guard.start_session(request);
}

Response end_session(const RouteContext& context, Request& request) {
  return context.guard.end_session(request);
}

Response describe_server(const RouteContext& context, Request& /*request*/) {
  Response response = json_response(200, api::server_json(context.about));
  response.compressible = true;
  return response;
}

Response readiness(const RouteContext& context, const Request& request) {
  if (!context.ready) {
    return error_answer(request, core::ErrorCode::kUnavailable,
                        "the server is starting or stopping");
  }
  std::string text = "ready\n";
  if (const auto drained = context.jobs.drain(); drained.draining) {
    text += "draining: no new jobs are accepted; " + std::to_string(drained.running) + " run, " +
            std::to_string(drained.queued) + " wait\n";
  }
  const int waiting = context.jobs.jobs_without_room();
  if (waiting > 0 || is_disk_full(context)) {
    text += "storage_full: " + std::to_string(waiting) +
            (waiting == 1 ? " job waits" : " jobs wait") +
            " for disk space; delete jobs or assets, or free space\n";
  }
  return text_response(200, "text/plain; charset=utf-8", std::move(text));
}

Response drain(const RouteContext& context, const Request& request) {
  if (request.method == "PUT" || request.method == "DELETE") {
    context.jobs.set_draining(request.method == "PUT");
  }
  return json_response(200, api::drain_json(context.jobs.drain()));
}

PageFile openapi_file(const RouteContext& context, const std::string& base_path) {
  std::string text =
      api::openapi_json(context.about.capabilities, context.about.version, base_path);
  std::string etag = make_etag(core::sha256_hex(text.data(), text.size()).substr(0, 32));
  return {.path = "/openapi.json",
          .content_type = "application/json",
          .content = std::make_shared<const std::string>(std::move(text)),
          .etag = std::move(etag)};
}

using OpenApiFiles = SingleFlightCache<PageFile>;

/// The document for the paths by which clients reach the server, made when it is asked for.
class OpenApi {
 public:
  Response operator()(const RouteContext& context, const Request& request) {
    const std::string& own = context.config.base_path;
    const std::string& path = request.base_path.empty() ? own : request.base_path;
    OpenApiFiles& files = path == own ? own_ : others_;
    const auto made = files.get(path, [&]() -> core::Result<OpenApiFiles::Made> {
      auto file = std::make_shared<const PageFile>(openapi_file(context, path));
      const std::uint64_t bytes = file->content->size();
      return OpenApiFiles::Made{.value = std::move(file), .bytes = bytes};
    });
    return made ? page_answer(request, **made) : error_answer(request, made.error());
  }

 private:
  OpenApiFiles own_{0};
  OpenApiFiles others_{0};  ///< Of trusted proxies; keeps the one that was asked for last.
};

}  // namespace

void add_system_handlers(HandlerTable& table) {
  table["getLiveness"] = {.handler = &liveness, .is_probe = true};
  table["getReadiness"] = {.handler = &readiness, .is_probe = true};
  table["getMetrics"] = {.handler = &metrics, .is_probe = true};
  table["getOpenApi"] = {.handler = [documents = std::make_shared<OpenApi>()](
                                        const RouteContext& asked, const Request& request) {
    return (*documents)(asked, request);
  }};
  table["createSession"] = {.handler = &start_session};
  table["deleteSession"] = {.handler = &end_session};
  for (const char* id : {"getDrain", "startDrain", "endDrain"}) {
    table[id] = {.handler = &drain};
  }
  table["getServer"] = {.handler = &describe_server};
  for (const PageFile& file : page_files()) {
    if (file.path == "/" || file.path == "/docs") {
      table[file.path == "/" ? "getPage" : "getDocs"] = {.handler = file_handler(file)};
    }
  }
}

}  // namespace server
