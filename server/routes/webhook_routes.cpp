// Webhook calls: list, retry, test; the secret.

#include <string>
#include <vector>

#include "api/answers/tenant_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/webhook_address.h"
#include "server/routes/with_query.h"
#include "server/store/key_table.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

api::DeliveryView view_of(const DeliveryRow& row) {
  const bool is_pending = row.state == "pending";
  return {.id = row.id,
          .job = row.job,
          .event = row.event,
          .url = row.url,
          .state = row.state,
          .attempts = row.attempts,
          .created_at_unix_seconds = row.created_at,
          .next_attempt_at_unix_seconds =
              is_pending ? std::optional<double>(row.next_at) : std::nullopt,
          .ended_at_unix_seconds = row.ended_at,
          .status = row.status,
          .detail = row.detail};
}

Response delivery_answer(const RouteContext& context, const Request& request, int status,
                         std::string_view id) {
  const auto row = context.deliveries.find(id, request.access);
  if (!row) {
    return error_answer(request, row.error());
  }
  Response response = json_response(status, api::delivery_json(view_of(*row)));
  response.headers.set("Location", "/v1/webhooks/deliveries/" + row->id);
  return response;
}

Response list_deliveries(const RouteContext& context, Request& request,
                         const api::DeliveryListQuery& query) {
  const auto before = page_start(query.cursor);
  if (!before) {
    return error_answer(request, before.error());
  }
  const DeliveryQuery wanted{
      .job = query.job, .state = query.state, .before = *before, .limit = query.limit + 1};
  auto rows = context.deliveries.list(wanted, request.access);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  const auto next = next_page(*rows, query.limit);
  std::vector<api::DeliveryView> views;
  for (const DeliveryRow& row : *rows) {
    views.push_back(view_of(row));
  }
  return list_answer(request, api::delivery_list_json(views, next), next);
}

Response get_delivery(const RouteContext& context, Request& request) {
  return delivery_answer(context, request, 200, request.path_param("id"));
}

Response redeliver(const RouteContext& context, Request& request) {
  const std::string_view id = request.path_param("id");
  if (const auto sent = context.deliveries.send_again(id, request.access, unix_now()); !sent) {
    return error_answer(request, sent.error());
  }
  return delivery_answer(context, request, 202, id);
}

Response test(const RouteContext& context, Request& request) {
  const auto url = api::parse_webhook_test(request.body);
  if (!url) {
    return problem_answer(request, url.problem());
  }
  if (const auto fault = webhook_address_fault(context.config, *url)) {
    return error_answer(request, Error{ErrorCode::kInvalidArgument, *fault, "/url"});
  }
  const double now = unix_now();
  const DeliveryRow row{.id = "msg_" + random_hex(12),
                        .tenant = request.access.tenant,
                        .event = "test",
                        .url = *url,
                        .body = api::webhook_test_body(now),
                        .created_at = now,
                        .next_at = now};
  if (const auto inserted = context.deliveries.insert(row); !inserted) {
    return error_answer(request, inserted.error());
  }
  return delivery_answer(context, request, 202, row.id);
}

Response secret(const Request& request, const core::Result<std::string>& made) {
  if (!made) {
    return error_answer(request, made.error());
  }
  Response response = json_response(200, api::webhook_secret_json(*made));
  response.headers.set("Cache-Control", "no-store");
  return response;
}

}  // namespace

void add_webhook_handlers(HandlerTable& table) {
  table["listDeliveries"] = {.handler =
                                 with_query(&api::parse_delivery_list_query, &list_deliveries)};
  table["getDelivery"] = {.handler = &get_delivery};
  table["redeliver"] = {.handler = &redeliver};
  table["testWebhook"] = {
      .handler = &test,
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
  table["getWebhookSecret"] = {.handler = [](const RouteContext& context, Request& request) {
    return secret(request, context.webhook_secrets.of(request.access.tenant));
  }};
  table["replaceWebhookSecret"] = {.handler = [](const RouteContext& context, Request& request) {
    return secret(request, context.webhook_secrets.replace(request.access.tenant));
  }};
}

}  // namespace server
