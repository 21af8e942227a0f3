#include "api/answers/tenant_view.h"

#include <algorithm>
#include <array>
#include <functional>

#include "api/json/faults.h"
#include "api/json/fields.h"
#include "api/json/limits.h"
#include "api/json/schemas.h"
#include "api/json/time_text.h"
#include "api/json/values.h"
#include "api/json/view_rows.h"
#include "core/base/text.h"

namespace api {
namespace {

constexpr std::size_t kTenantCharacters = 64;  // maximum length of a tenant's name

constexpr std::array<std::string_view, 4> kScopes = {"read", "write", "admin", "worker"};
constexpr std::array<std::string_view, 3> kDeliveryStates = {"pending", "delivered", "failed"};

/// A member of a response: its printer and its schema.
template <typename View>
struct Column {
  std::string_view name;
  Json schema;
  std::function<Json(const View&)> print;
};
template <typename View>
using Columns = std::vector<Column<View>>;

template <typename View>
Json object(const Columns<View>& columns, const View& view) {
  Json made = Json::object();
  for (const Column<View>& column : columns) {
    made[std::string(column.name)] = column.print(view);
  }
  return made;
}

template <typename View>
Json schema_of(const Columns<View>& columns, std::string_view doc) {
  Json schema = basic_schema("object", doc);
  schema["properties"] = Json::object();
  schema["required"] = Json::array();
  for (const Column<View>& column : columns) {
    schema["properties"][std::string(column.name)] = column.schema;
    schema["required"].push_back(column.name);
  }
  schema["additionalProperties"] = false;
  return schema;
}

Json text_schema(std::string_view doc, bool nullable = false) {
  return basic_schema("string", doc, nullable);
}
Json count_schema(std::string_view doc, bool nullable = false) {
  Json schema = basic_schema("integer", doc, nullable);
  schema["minimum"] = 0;
  return schema;
}
Json time_schema(std::string_view doc, bool nullable = false) {
  Json schema = text_schema(doc, nullable);
  schema["format"] = "date-time";
  return schema;
}
Json enum_schema(std::span<const std::string_view> names, std::string_view doc) {
  Json schema = text_schema(doc);
  schema["enum"] = names;
  return schema;
}
Json array_schema(Json items, std::string_view doc) {
  Json schema = basic_schema("array", doc);
  schema["items"] = std::move(items);
  return schema;
}
Json ref(std::string_view name) { return {{"$ref", "#/components/schemas/" + std::string(name)}}; }

Json time_or_null(const std::optional<double>& time) {
  return time ? Json(rfc3339(*time)) : Json(nullptr);
}

const Columns<KeyView>& key_columns() {
  static const Columns<KeyView> kColumns = {
      {"id", text_schema("Identifies the key in lists and logs."), Member<&KeyView::id>::json},
      {"name", text_schema("Display name."), Member<&KeyView::name>::json},
      {"tenant", text_schema("Tenant whose objects it sees and to which its objects belong."),
       Member<&KeyView::tenant>::json},
      {"scopes", array_schema(enum_schema(kScopes, ""), "Scopes."), Member<&KeyView::scopes>::json},
      {"rate_limit",
       count_schema("Requests per minute; 0: no limit; null: the server's default.", true),
       [](const KeyView& key) { return key.rate_limit ? Json(*key.rate_limit) : Json(nullptr); }},
      {"max_priority", count_schema("Maximum priority of its jobs."),
       Member<&KeyView::max_priority>::json},
      {"created_at", time_schema(""),
       [](const KeyView& key) { return Json(rfc3339(key.created_at_unix_seconds)); }},
      {"expires_at", time_schema("null: never.", true),
       [](const KeyView& key) { return time_or_null(key.expires_at_unix_seconds); }},
  };
  return kColumns;
}

const Columns<UsageView>& usage_columns() {
  static const Columns<UsageView> kColumns = {
      {"tenant", text_schema("Empty: the operator."), Member<&UsageView::tenant>::json},
      {"jobs", count_schema("Stored jobs."), Member<&UsageView::jobs>::json},
      {"unfinished_jobs", count_schema("Stored jobs that have not ended."),
       Member<&UsageView::unfinished_jobs>::json},
      {"cpu_seconds",
       basic_schema("number", "CPU time of all jobs except previews, including deleted jobs."),
       Member<&UsageView::cpu_seconds>::number},
      {"deleted_jobs", count_schema("Number of deleted jobs."),
       Member<&UsageView::deleted_jobs>::json},
      {"asset_bytes", count_schema("Assets and scenes of the tenant."),
       Member<&UsageView::asset_bytes>::json},
      {"film_bytes", count_schema("Films, including space reserved for jobs that are rendering."),
       Member<&UsageView::film_bytes>::json},
      {"streams", count_schema("Open event and tile streams."), Member<&UsageView::streams>::json},
  };
  return kColumns;
}

const Columns<QuotasView>& quota_columns() {
  static const Columns<QuotasView> kColumns = {
      {"jobs", count_schema("Unfinished jobs."), Member<&QuotasView::jobs>::json},
      {"previews", count_schema("Concurrent previews."), Member<&QuotasView::previews>::json},
      {"streams", count_schema("Open streams."), Member<&QuotasView::streams>::json},
      {"lab_runs", count_schema("Concurrent experiments."), Member<&QuotasView::lab_runs>::json},
      {"stored_bytes", count_schema("Assets and films."), Member<&QuotasView::stored_bytes>::json},
  };
  return kColumns;
}

const Columns<DeliveryView>& delivery_columns() {
  static const Columns<DeliveryView> kColumns = {
      {"id", text_schema("The webhook-id that is sent with every attempt."),
       Member<&DeliveryView::id>::json},
      {"job", text_schema("Job or batch of the event; null: a test.", true),
       [](const DeliveryView& call) { return text_or_null(call.job); }},
      {"event", text_schema("Type of event: `state`, `end` or `test`."),
       Member<&DeliveryView::event>::json},
      {"url", text_schema(""), Member<&DeliveryView::url>::json},
      {"state", enum_schema(kDeliveryStates, "`failed`: no further attempts."),
       Member<&DeliveryView::state>::json},
      {"attempts", count_schema("Number of attempts."), Member<&DeliveryView::attempts>::json},
      {"created_at", time_schema(""),
       [](const DeliveryView& call) { return Json(rfc3339(call.created_at_unix_seconds)); }},
      {"next_attempt_at", time_schema("Set while the call is pending.", true),
       [](const DeliveryView& call) { return time_or_null(call.next_attempt_at_unix_seconds); }},
      {"ended_at", time_schema("", true),
       [](const DeliveryView& call) { return time_or_null(call.ended_at_unix_seconds); }},
      {"status", count_schema("Status of the last response; null: none.", true),
       [](const DeliveryView& call) {
         return call.status > 0 ? Json(call.status) : Json(nullptr);
       }},
      {"detail", text_schema("Why the last attempt failed; null: it did not fail.", true),
       [](const DeliveryView& call) { return text_or_null(call.detail); }},
  };
  return kColumns;
}

void read_scopes(const Json& value, KeyRequest& out, const std::string& pointer, Faults& faults) {
  if (!value.is_array() || value.empty()) {
    faults.add(pointer, "expected an array of read, write, admin and worker, got " +
                            std::string(value.is_array() ? "none" : type_text(value)));
    return;
  }
  out.scopes.clear();
  for (std::size_t i = 0; i < value.size(); ++i) {
    const std::string place = join_pointer(pointer, std::to_string(i));
    const auto scope = read_text(value[i], {1, 16}, place, faults);
    if (scope && std::find(kScopes.begin(), kScopes.end(), *scope) == kScopes.end()) {
      faults.add(place, shown(value[i]) + " is not one of read, write, admin, worker");
    } else if (scope) {
      out.scopes.push_back(*scope);
    }
  }
}

const auto& key_request_table() {
  static constexpr auto kTable = std::tuple{
      required_text("name", &KeyRequest::name, {1, limits::kNameCharacters}, "Display name."),
      text("tenant", &KeyRequest::tenant, {1, kTenantCharacters},
           "Tenant of the key: letters, digits, `.`, `_`, `-`; null: a new one. To replace a key, "
           "give its tenant."),
      CustomRow<KeyRequest>{
          "scopes", &read_scopes,
          [](const KeyRequest& body, Json& json) { json["scopes"] = body.scopes; },
          [](const KeyRequest& defaults) {
            Json schema = array_schema(enum_schema(kScopes, ""),
                                       "Scopes; `admin` requires `read` and `write`; `worker` is "
                                       "only for `tessera worker`.");
            schema["minItems"] = 1;
            schema["default"] = defaults.scopes;
            return schema;
          }},
      number("rate_limit", &KeyRequest::rate_limit, {0, limits::kKeyRate},
             "Requests per minute; 0: no limit; null: the server's default."),
      number("max_priority", &KeyRequest::max_priority, {0, limits::kPriority},
             "Maximum priority of its jobs."),
      number("days", &KeyRequest::days, {1, limits::kKeyDays},
             "Days until the key expires; null: never."),
  };
  return kTable;
}

struct TestRequest {
  std::string url;
};

const auto& test_request_table() {
  static constexpr auto kTable = std::tuple{
      required_text("url", &TestRequest::url, {1, limits::kWebhookUrlCharacters},
                    "Address to which a call of type `test` is sent."),
  };
  return kTable;
}

template <typename View>
Json list_of(const Columns<View>& columns, std::span<const View> views) {
  Json list = Json::array();
  for (const View& view : views) {
    list.push_back(object(columns, view));
  }
  return list;
}

}  // namespace

Json key_part(const KeyView& key) { return object(key_columns(), key); }

std::string key_list_json(std::span<const KeyView> keys) {
  return dump({{"keys", list_of(key_columns(), keys)}});
}

std::string new_key_json(const KeyView& key, std::string_view token) {
  Json made = key_part(key);
  made["key"] = token;
  return dump(made);
}

bool is_tenant_name(std::string_view text) {
  return !text.empty() && text.size() <= kTenantCharacters && core::is_word(text, "._-");
}

Parsed<KeyRequest> parse_key_request(std::string_view body) {
  auto parsed = parse_body<KeyRequest>(key_request_table(), body);
  if (parsed && parsed->tenant && !is_tenant_name(*parsed->tenant)) {
    Faults faults;
    faults.add("/tenant",
               shown(Json(*parsed->tenant)) + " may contain only letters, digits and ._-");
    return faults.problem();
  }
  return parsed;
}

std::string usage_json(std::span<const UsageView> tenants, const QuotasView& quotas) {
  return dump({{"tenants", list_of(usage_columns(), tenants)},
               {"quotas", object(quota_columns(), quotas)}});
}

std::string delivery_json(const DeliveryView& delivery) {
  return dump(object(delivery_columns(), delivery));
}

std::string delivery_list_json(std::span<const DeliveryView> deliveries,
                               const std::optional<std::string>& next) {
  return dump({{"deliveries", list_of(delivery_columns(), deliveries)},
               {"next", next ? Json(*next) : Json(nullptr)}});
}

std::string webhook_secret_json(std::string_view secret) { return dump({{"secret", secret}}); }

std::string webhook_test_body(double unix_seconds) {
  return dump({{"type", "test"}, {"timestamp", rfc3339(unix_seconds)}, {"data", Json::object()}});
}

Parsed<std::string> parse_webhook_test(std::string_view body) {
  auto parsed = parse_body<TestRequest>(test_request_table(), body);
  return parsed ? Parsed<std::string>(std::move(parsed->url)) : parsed.problem();
}

void add_tenant_schemas(Json& components) {
  components["KeyRequest"] =
      as_request(object_schema(key_request_table(), KeyRequest{}, "A key to create."));
  components["Key"] = schema_of(key_columns(), "A key, without its text.");
  Json made = schema_of(key_columns(), "A new key.");
  made["properties"]["key"] = text_schema("Text of the key, which is returned only once.");
  made["required"].push_back("key");
  components["IssuedKey"] = std::move(made);
  const auto with = [](std::string_view member, Json schema, std::string_view doc) {
    Json object = basic_schema("object", doc);
    object["properties"] = {{member, std::move(schema)}};
    object["required"] = {member};
    object["additionalProperties"] = false;
    return object;
  };
  components["KeyList"] = with("keys", array_schema(ref("Key"), "Oldest first."), "All keys.");
  Json usage =
      with("tenants", array_schema(schema_of(usage_columns(), ""), "Sorted by name."),
           "Usage of tenants: all for the operator and admins, otherwise only the key's own.");
  usage["properties"]["quotas"] = schema_of(quota_columns(), "Quotas of each tenant; 0: no limit.");
  usage["required"].push_back("quotas");
  components["Usage"] = std::move(usage);
  components["Delivery"] = schema_of(delivery_columns(), "A webhook call.");
  Json page =
      with("deliveries", array_schema(ref("Delivery"), "Newest first."), "A page of calls.");
  page["properties"]["next"] = text_schema("Cursor of the next page; null: the last one.", true);
  page["required"].push_back("next");
  components["DeliveryList"] = std::move(page);
  components["WebhookTestRequest"] =
      as_request(object_schema(test_request_table(), TestRequest{}, "Receiver of a test call."));
  components["WebhookSecret"] =
      with("secret", text_schema("`whsec_` and base64."), "The secret that signs calls.");
}

}  // namespace api
