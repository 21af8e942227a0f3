/// Keys, usage of tenants, and webhook calls: requests and responses.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "api/json/json.h"
#include "api/problem.h"
#include "api/requests.h"

namespace api {

/// Returns whether the name has 1 to 64 letters, digits, `.`, `_` and `-`.
bool is_tenant_name(std::string_view text);

struct KeyView {
  std::string id;
  std::string name;
  std::string tenant;
  std::vector<std::string> scopes;
  std::optional<int> rate_limit;
  int max_priority = 0;
  double created_at_unix_seconds = 0;
  std::optional<double> expires_at_unix_seconds;
};
/// The object.
Json key_part(const KeyView& key);
/// {"keys": [...]}.
std::string key_list_json(std::span<const KeyView> keys);
/// A new key, with "key": its text, which is returned only once.
std::string new_key_json(const KeyView& key, std::string_view token);

/// POST /v1/keys.
struct KeyRequest {
  std::string name;
  std::optional<std::string> tenant;  ///< null: a new tenant
  std::vector<std::string> scopes = {"read", "write"};
  std::optional<int> rate_limit;  ///< null: the server's default
  int max_priority = 0;
  std::optional<int> days;  ///< null: no expiry
};
Parsed<KeyRequest> parse_key_request(std::string_view body);

struct UsageView {
  std::string tenant;  ///< empty: the operator
  std::int64_t jobs = 0;
  std::int64_t unfinished_jobs = 0;
  double cpu_seconds = 0;
  std::int64_t deleted_jobs = 0;
  std::int64_t asset_bytes = 0;
  std::int64_t film_bytes = 0;
  std::int64_t streams = 0;
};
/// {"tenants": [...], "quotas": {...}}. quotas: of each tenant; 0: no limit.
struct QuotasView {
  std::int64_t jobs = 0;
  std::int64_t previews = 0;
  std::int64_t streams = 0;
  std::int64_t lab_runs = 0;
  std::int64_t stored_bytes = 0;
};
std::string usage_json(std::span<const UsageView> tenants, const QuotasView& quotas);

struct DeliveryView {
  std::string id;
  std::string job;  ///< empty: a test
  std::string event;
  std::string url;
  std::string state;
  int attempts = 0;
  double created_at_unix_seconds = 0;
  std::optional<double> next_attempt_at_unix_seconds;
  std::optional<double> ended_at_unix_seconds;
  int status = 0;  ///< 0: no response
  std::string detail;
};
std::string delivery_json(const DeliveryView& delivery);
std::string delivery_list_json(std::span<const DeliveryView> deliveries,
                               const std::optional<std::string>& next);
/// {"secret"}.
std::string webhook_secret_json(std::string_view secret);
/// Returns the body of a test call.
std::string webhook_test_body(double unix_seconds);

/// POST /v1/webhooks/test: the url.
Parsed<std::string> parse_webhook_test(std::string_view body);

/// GET /v1/webhooks/deliveries?job=&state=&cursor=&limit=.
struct DeliveryListQuery {
  std::string job;    ///< empty: all jobs
  std::string state;  ///< empty: all states
  std::string cursor;
  int limit = 50;
};
Parsed<DeliveryListQuery> parse_delivery_list_query(QueryParams query);

/// Adds the schemas of this header to `components`.
void add_tenant_schemas(Json& components);

}  // namespace api
