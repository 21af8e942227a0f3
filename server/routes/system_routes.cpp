// Probes, metrics, the API description, the web page, what the server can do.

#include <memory>
#include <string>
#include <utility>

#include "api/docs_page.h"
#include "api/openapi.h"
#include "api/values.h"
#include "core/base/sha256.h"
#include "server/http/conditional.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/page.h"

namespace server {
namespace {

/// A text that never changes while the process lives.
struct Document {
  SharedBytes content;
  std::string content_type;
  std::string etag;
};

std::shared_ptr<const Document> make_document(std::string content, std::string content_type) {
  std::string etag = make_etag(core::sha256_hex(content.data(), content.size()).substr(0, 32));
  return std::make_shared<const Document>(
      Document{.content = std::make_shared<const std::string>(std::move(content)),
               .content_type = std::move(content_type),
               .etag = std::move(etag)});
}

Handler document_handler(std::shared_ptr<const Document> document) {
  return [document = std::move(document)](Request& request) {
    if (is_not_modified(request, document->etag)) {
      return not_modified(document->etag);
    }
    Response response = bytes_response(200, document->content_type, document->content);
    response.headers.set("ETag", document->etag);
    response.headers.set("Cache-Control", "no-cache");
    response.compressible = true;
    return response;
  };
}

void write_gauge(MetricsText& text, std::string_view name, std::string_view help, double value) {
  text.family(name, "gauge", help);
  text.sample(name, "", value);
}

std::string metrics_text(const RouteContext& context) {
  MetricsText text;
  const JobService::Counts counts = context.jobs.counts();
  text.family("tessera_jobs", "gauge", "Stored jobs by state.");
  for (const auto& [state, count] : counts.by_state) {
    text.sample("tessera_jobs", metric_label("state", state), static_cast<double>(count));
  }
  write_gauge(text, "tessera_queue_jobs", "Jobs that wait for a place.", counts.queued);
  write_gauge(text, "tessera_rendering_jobs", "Jobs that get slices.", counts.rendering);
  write_gauge(text, "tessera_render_threads", "Threads that render.", context.jobs.threads());
  text.family("tessera_render_cpu_seconds_total", "counter", "CPU time of all slices.");
  text.sample("tessera_render_cpu_seconds_total", "", counts.cpu_seconds);
  text.family("tessera_rays_total", "counter", "Rays traced since the process began.");
  text.sample("tessera_rays_total", "", static_cast<double>(counts.rays));
  text.family("tessera_samples_total", "counter", "Pixel samples since the process began.");
  text.sample("tessera_samples_total", "", static_cast<double>(counts.samples));
  write_gauge(text, "tessera_streams", "Open event and tile streams.", context.streams.open_count());
  write_gauge(text, "tessera_film_cache_bytes", "Finished films in memory.",
              static_cast<double>(counts.film_cache_bytes));
  write_gauge(text, "tessera_scene_cache_bytes", "Loaded scenes.",
              static_cast<double>(context.scenes.cached_bytes()));
  write_gauge(text, "tessera_held_memory_bytes", "Films and scenes of jobs from their start to their end, pauses included.",
              static_cast<double>(counts.held_bytes));
  write_gauge(text, "tessera_held_memory_bytes_limit", "Above it jobs wait.",
              static_cast<double>(context.jobs.memory_max_bytes()));
  write_gauge(text, "tessera_queue_waits_for_memory", "1: the next job would start if there were memory for it.",
              counts.waits_for_memory ? 1 : 0);
  if (const auto stored = context.quota.total()) {
    text.family("tessera_stored_bytes", "gauge", "What the data directory keeps.");
    text.sample("tessera_stored_bytes", metric_label("kind", "assets"), static_cast<double>(stored->asset_bytes));
    text.sample("tessera_stored_bytes", metric_label("kind", "films"), static_cast<double>(stored->film_bytes));
  }
  write_gauge(text, "tessera_stored_bytes_limit", "Above it films are evicted and uploads refused; 0: none.",
              static_cast<double>(context.quota.limits().total_bytes));
  write_gauge(text, "process_resident_memory_bytes", "Resident memory size in bytes.",
              static_cast<double>(resident_bytes()));
  if (const auto space = disk_space(context.data.path())) {
    write_gauge(text, "tessera_disk_free_bytes", "Free space of the data directory's disk.",
                static_cast<double>(space->free_bytes));
    write_gauge(text, "tessera_disk_total_bytes", "Size of the data directory's disk.",
                static_cast<double>(space->total_bytes));
  }
  context.metrics.write(text);
  return text.take();
}

Response readiness(const RouteContext& context, const Request& request) {
  if (!context.ready) {
    return error_answer(request, core::ErrorCode::kUnavailable, "the server starts or stops");
  }
  return text_response(200, "text/plain; charset=utf-8", "ready\n");
}

}  // namespace

void add_system_handlers(const RouteContext& context, HandlerTable& table) {
  table["getLiveness"] = {.handler = [](Request&) {
                            return text_response(200, "text/plain; charset=utf-8", "alive\n");
                          },
                          .body = {},
                          .is_probe = true};
  table["getReadiness"] = {
      .handler = [context](Request& request) { return readiness(context, request); },
      .body = {},
      .is_probe = true};
  table["getMetrics"] = {.handler =
                             [context](Request&) {
                               return text_response(200, "text/plain; version=0.0.4; charset=utf-8",
                                                    metrics_text(context));
                             },
                         .body = {},
                         .is_probe = true};
  const api::Json openapi = api::openapi_document(context.about.capabilities, context.about.version);
  table["getOpenApi"] = {
      .handler = document_handler(make_document(api::dump(openapi), "application/json"))};
  table["getDocs"] = {.handler = document_handler(
                          make_document(api::docs_page(openapi), "text/html; charset=utf-8"))};
  table["getServer"] = {.handler = [context](Request& request) {
    if (auto refused = refuse_query(request)) {
      return std::move(*refused);
    }
    Response response = json_response(200, api::server_json(context.about));
    response.compressible = true;
    return response;
  }};
  for (PageFile& file : page_files()) {
    if (file.path == "/") {
      table["getPage"] = {.handler = [file = std::move(file)](Request& request) {
        return page_answer(request, file);
      }};
    }
  }
}

}  // namespace server
