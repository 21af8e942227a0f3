// Keys over HTTP, and the usage of tenants.

#include <string>
#include <vector>

#include "api/answers/tenant_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "core/base/check.h"
#include "core/base/text.h"
#include "server/auth/key_view.h"
#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"

namespace server {
namespace {

using core::ErrorCode;

Response list_keys(const RouteContext& context, Request& request) {
  const auto rows = context.keys.list();
  if (!rows) {
    return error_answer(request, rows.error());
  }
  std::vector<api::KeyView> views;
  for (const KeyRow& row : *rows) {
    views.push_back(key_view(row));
  }
  return json_response(200, api::key_list_json(views));
}

MadeKey made_key(const api::KeyRequest& asked) {
  MadeKey made = make_key(asked.name);
  const std::string scopes = core::joined(asked.scopes, ",");
  CHECK(read_scopes(scopes, made.row));  // Guaranteed by parse_key_request().
  made.row.tenant = asked.tenant.value_or(made.row.tenant);
  made.row.rate_limit = asked.rate_limit;
  made.row.priority_max = asked.max_priority;
  made.row.created_at = unix_now();
  if (asked.days) {
    made.row.expires_at = made.row.created_at + *asked.days * kDaySeconds;
  }
  return made;
}

Response create_key(const RouteContext& context, Request& request) {
  const auto asked = api::parse_key_request(request.body);
  if (!asked) {
    return problem_answer(request, asked.problem());
  }
  if (!context.key_ring.is_needed()) {
    return error_answer(request, ErrorCode::kForbidden,
                        "this server has no keys, and once one exists, every request needs a key; "
                        "create the first one with `tessera keys add`");
  }
  const MadeKey made = made_key(*asked);
  if (const auto inserted = context.keys.insert(made.row); !inserted) {
    return error_answer(request, inserted.error());
  }
  Response response = json_response(201, api::new_key_json(key_view(made.row), made.token));
  response.headers.set("Cache-Control", "no-store");
  return response;
}

Response remove_key(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("id"));
  const auto removed = context.keys.remove(id);
  if (!removed) {
    return error_answer(request, removed.error());
  }
  if (!*removed) {
    return error_answer(request, ErrorCode::kNotFound, "no key has the id \"" + id + "\"");
  }
  return empty_response();
}

Response usage(const RouteContext& context, Request& request) {
  const auto rows = context.usage.list(request.access);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  std::vector<api::UsageView> tenants;
  for (const UsageRow& row : *rows) {
    const auto stored = context.quota.of_tenant(row.tenant);
    if (!stored) {
      return error_answer(request, stored.error());
    }
    tenants.push_back({.tenant = row.tenant,
                       .jobs = row.jobs,
                       .unfinished_jobs = row.unfinished_jobs,
                       .cpu_seconds = row.cpu_seconds,
                       .deleted_jobs = row.deleted_jobs,
                       .asset_bytes = static_cast<std::int64_t>(stored->asset_bytes),
                       .film_bytes = row.film_bytes,
                       .streams = context.streams.open_count_of(row.tenant)});
  }
  const api::QuotasView quotas = {
      .jobs = context.config.quota_jobs,
      .previews = context.config.quota_previews,
      .streams = context.config.quota_streams,
      .lab_runs = context.config.quota_lab_runs,
      .stored_bytes = static_cast<std::int64_t>(context.quota.limits().tenant_bytes)};
  return json_response(200, api::usage_json(tenants, quotas));
}

}  // namespace

void add_key_handlers(HandlerTable& table) {
  table["listKeys"] = {.handler = &list_keys};
  table["createKey"] = {
      .handler = &create_key,
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
  table["deleteKey"] = {.handler = &remove_key};
  table["getUsage"] = {.handler = &usage};
}

}  // namespace server
