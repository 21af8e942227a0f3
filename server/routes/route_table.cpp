// One route for each row of the API's table, and the files of the page.

#include <string>
#include <utility>

#include "api/operations.h"
#include "api/requests.h"
#include "core/base/check.h"
#include "server/http/security_headers.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/page.h"

namespace server {
namespace {

/// Operations that need a key refuse parameters that they do not have. Probes, sessions and files
/// of the page take any: monitors, caches and links add their own.
bool refuses_query(const api::Operation& operation) {
  return operation.query == nullptr && !operation.scope.empty();
}

Handler handler_of(const RouteContext& context, RouteHandler row, bool takes_no_query) {
  return [context, row = std::move(row), takes_no_query](Request& request) {
    if (takes_no_query) {
      if (const auto parsed = api::parse_no_query(request.query_params); !parsed) {
        return problem_answer(request, parsed.problem());
      }
    }
    if (!row.of_job) {
      return row.handler(context, request);
    }
    const auto job = find_job(context.jobs, request, row.needs);
    return job ? row.of_job(context, request, *job) : problem_answer(request, job.problem());
  };
}

}  // namespace

std::vector<Route> make_routes(const RouteContext& context) {
  HandlerTable table;
  add_system_handlers(table);
  add_asset_handlers(context, table);
  add_scene_handlers(context, table);
  add_preset_handlers(table);
  add_render_handlers(context, table);
  add_job_handlers(context, table);
  add_batch_handlers(table);
  add_result_handlers(table);
  add_meter_handlers(table);
  add_film_handlers(table);
  add_comparison_handlers(table);
  add_stream_handlers(table);
  add_lab_handlers(context, table);
  add_webhook_handlers(table);
  add_key_handlers(table);
  add_work_handlers(table);
  std::vector<Route> routes;
  for (const api::Operation& operation : api::operations()) {
    const auto found = table.find(operation.id);
    CHECK(found != table.end());
    const RouteHandler& row = found->second;
    routes.push_back({.method = std::string(operation.method),
                      .pattern = std::string(operation.path),
                      .handler = handler_of(context, row, refuses_query(operation)),
                      .body = row.body,
                      .summary = std::string(operation.summary),
                      .is_probe = row.is_probe});
    if (context.config.drake && operation.id == "renderDrake") {
      routes.push_back(routes.back());
      routes.back().alias_of = std::exchange(routes.back().pattern, "/render");
    }
    table.erase(found);
  }
  CHECK(table.empty());
  for (const PageFile& file : page_files()) {
    if (file.path == "/" || file.path == "/docs") {
      continue;  // Separate operations.
    }
    if (file.path == kEmbedPath) {
      const auto embedded = [&guard = context.guard, &file](Request& request) {
        Response response = page_answer(request, file);
        response.headers.set("Content-Security-Policy", page_policy(guard.embed_ancestors()));
        return response;
      };
      routes.push_back({.method = "GET", .pattern = "/embed/{id}", .handler = embedded});
      continue;
    }
    routes.push_back({.method = "GET", .pattern = file.path, .handler = [&file](Request& request) {
                        return page_answer(request, file);
                      }});
  }
  return routes;
}

}  // namespace server
