// One route for each row of the API's table, and the files of the page.

#include <string>
#include <utility>

#include "api/operations.h"
#include "core/base/check.h"
#include "server/http/security_headers.h"
#include "server/routes/context.h"
#include "server/routes/page.h"

namespace server {

std::vector<Route> make_routes(const RouteContext& context) {
  HandlerTable table;
  add_system_handlers(context, table);
  add_asset_handlers(context, table);
  add_scene_handlers(context, table);
  add_job_handlers(context, table);
  add_batch_handlers(context, table);
  add_result_handlers(context, table);
  add_meter_handlers(context, table);
  add_film_handlers(context, table);
  add_comparison_handlers(context, table);
  add_stream_handlers(context, table);
  add_lab_handlers(context, table);
  add_webhook_handlers(context, table);
  add_key_handlers(context, table);
  add_work_handlers(context, table);
  std::vector<Route> routes;
  for (const api::Operation& operation : api::operations()) {
    if (!operation.available) {
      continue;
    }
    const auto found = table.find(operation.id);
    CHECK(found != table.end());
    routes.push_back({.method = std::string(operation.method),
                      .pattern = std::string(operation.path),
                      .handler = std::move(found->second.handler),
                      .body = found->second.body,
                      .summary = std::string(operation.summary),
                      .is_probe = found->second.is_probe});
    table.erase(found);
  }
  CHECK(table.empty());
  for (PageFile& file : page_files()) {
    if (file.path == "/" || file.path == "/docs") {
      continue;  // Separate operations.
    }
    if (file.path == kEmbedPath) {
      const auto embedded = [&guard = context.guard, file = std::move(file)](Request& request) {
        Response response = page_answer(request, file);
        response.headers.set("Content-Security-Policy", page_policy(guard.embed_ancestors()));
        return response;
      };
      routes.push_back({.method = "GET", .pattern = "/embed/{id}", .handler = embedded});
      continue;
    }
    const std::string path = file.path;
    routes.push_back(
        {.method = "GET", .pattern = path, .handler = [file = std::move(file)](Request& request) {
           return page_answer(request, file);
         }});
  }
  return routes;
}

}  // namespace server
