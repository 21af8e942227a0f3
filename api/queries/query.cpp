#include <algorithm>
#include <array>

#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/answers/tenant_view.h"
#include "api/batch.h"
#include "api/json/errors.h"
#include "api/json/faults.h"
#include "api/json/limits.h"
#include "api/json/query_rows.h"
#include "api/json/schemas.h"
#include "api/json/values.h"
#include "api/queries/queries.h"
#include "api/requests.h"
#include "core/base/text.h"
#include "core/settings/choices.h"

namespace api {
namespace {

Json list_schema(Json items) { return {{"type", "array"}, {"items", std::move(items)}}; }

// Lists of jobs and scenes.

void read_states(const std::string& text, ListQuery& out, const std::string& pointer,
                 Faults& faults) {
  each_part(text, [&](const std::string& name) {
    if (const auto state = job_state_from_text(name)) {
      out.states.push_back(*state);
    } else {
      faults.add(pointer, shown(Json(name)) +
                              " is not a state; states: queued, loading, rendering, paused, "
                              "finished, failed, cancelled");
    }
  });
}

Json states_schema(const ListQuery& /*defaults*/) {
  Json names = Json::array();
  for (int i = 0; i <= static_cast<int>(JobState::kCancelled); ++i) {
    names.push_back(to_text(static_cast<JobState>(i)));
  }
  return list_schema({{"type", "string"}, {"enum", std::move(names)}});
}

void read_label(const std::string& text, ListQuery& out, const std::string& pointer,
                Faults& faults) {
  const std::size_t equals = text.find('=');
  LabelFilter filter;
  filter.key = text.substr(0, equals);
  if (equals != std::string::npos) {
    filter.value = text.substr(equals + 1);
  }
  if (filter.key.empty() || out.labels.size() >= static_cast<std::size_t>(limits::kLabels)) {
    faults.add(pointer, filter.key.empty() ? shown(Json(text)) + " is not key=value"
                                           : std::string("too many labels"));
    return;
  }
  out.labels.push_back(std::move(filter));
}

constexpr std::string_view kCursorPattern = "^[A-Za-z0-9_-]{1,256}$";

template <typename S>
void read_cursor(const std::string& text, S& out, const std::string& pointer, Faults& faults) {
  constexpr std::size_t kLongest = 256;
  if (text.empty() || text.size() > kLongest || !core::is_word(text, "-_")) {
    faults.add(pointer, "Invalid page cursor " + shown(Json(text)));
    return;
  }
  out.cursor = text;
}

constexpr std::array kJobClasses = {
    core::NamedValue<ListQuery::Class>{"normal", ListQuery::Class::kNormal, "Images to keep."},
    core::NamedValue<ListQuery::Class>{"preview", ListQuery::Class::kPreview,
                                       "Previews, kept in memory."},
    core::NamedValue<ListQuery::Class>{"all", ListQuery::Class::kAll, "Both."},
};
std::span<const core::NamedValue<ListQuery::Class>> job_classes() { return kJobClasses; }

Json cursor_schema() { return {{"type", "string"}, {"pattern", kCursorPattern}}; }

/// Rows of a list page.
template <typename S>
constexpr auto page_rows() {
  return std::tuple{
      ParameterField<S>{"cursor", "`next` of the previous page.", &read_cursor<S>,
                        [](const S&) { return cursor_schema(); }},
      number("limit", &S::limit, {1, limits::kPageSize}, "Items per page."),
  };
}

const auto& scene_list_table() {
  static constexpr auto kTable = page_rows<ListQuery>();
  return kTable;
}

const auto& job_list_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{
          ParameterField<ListQuery>{
              "state", "Only jobs in one of these states; may be repeated or comma-separated.",
              &read_states, &states_schema, true},
          ParameterField<ListQuery>{
              "label", "Only jobs with this label, `key=value` or `key`; may be repeated.",
              &read_label, [](const ListQuery&) { return list_schema(text_schema()); }, true},
          text(
              "name", &ListQuery::name, {1, limits::kNameCharacters},
              "Only jobs whose name, or scene if they have no name, contains this. Case is ignored "
              "for a to z."),
          choice("class", &ListQuery::job_class, &job_classes,
                 "Only jobs of this class; previews are omitted unless requested."),
      },
      page_rows<ListQuery>());
  return kTable;
}

constexpr std::array<std::string_view, 3> kDeliveryStates = {"pending", "delivered", "failed"};

void read_delivery_job(const std::string& text, DeliveryListQuery& out, const std::string& pointer,
                       Faults& faults) {
  expect_uuid(text, "job", pointer, faults);
  out.job = text;
}

void read_delivery_state(const std::string& text, DeliveryListQuery& out,
                         const std::string& pointer, Faults& faults) {
  if (std::find(kDeliveryStates.begin(), kDeliveryStates.end(), text) == kDeliveryStates.end()) {
    faults.add(pointer, shown(Json(text)) + " is not one of pending, delivered, failed");
  }
  out.state = text;
}

const auto& delivery_list_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{
          ParameterField<DeliveryListQuery>{"job", "Only calls of this job or batch.",
                                            &read_delivery_job,
                                            [](const DeliveryListQuery&) {
                                              return Json{{"type", "string"}, {"format", "uuid"}};
                                            }},
          ParameterField<DeliveryListQuery>{
              "state", "Only calls in this state.", &read_delivery_state,
              [](const DeliveryListQuery&) {
                return Json{{"type", "string"}, {"enum", kDeliveryStates}};
              }},
      },
      page_rows<DeliveryListQuery>());
  return kTable;
}

// Uploads and submissions.

const auto& scene_upload_table() {
  static constexpr auto kTable = std::tuple{
      text("name", &SceneUploadQuery::name, {1, limits::kNameCharacters},
           "Display name, such as that of the file; it replaces the name inside the file. The id "
           "depends only on the content, so the name of a tenant's first upload is kept."),
      flag("strict", &SceneUploadQuery::strict,
           "1: refuse files with faults that would otherwise be mended with a warning."),
  };
  return kTable;
}

const auto& submit_table() {
  static constexpr auto kTable = std::tuple{
      flag("dry_run", &SubmitQuery::dry_run,
           "1: only validate the job and estimate its cost (200)."),
      ParameterField<SubmitQuery>{"from",
                                  "`image`: the body is a PNG or EXR image from a Tessera server; "
                                  "its job is submitted again and gives the same film.",
                                  [](const std::string& value, SubmitQuery& out,
                                     const std::string& pointer, Faults& faults) {
                                    out.from_image = value == "image";
                                    if (!out.from_image) {
                                      faults.add(pointer, shown(Json(value)) + " is not 'image'");
                                    }
                                  },
                                  [](const SubmitQuery&) {
                                    return Json{{"type", "string"}, {"enum", {"image"}}};
                                  }},
  };
  return kTable;
}

const auto& batch_submit_table() {
  static constexpr auto kTable =
      std::tuple{flag("dry_run", &SubmitQuery::dry_run,
                      "1: only validate the batch and return the names of its jobs (200).")};
  return kTable;
}

const auto& wait_table() {
  static constexpr auto kTable = std::tuple{
      number("wait", &WaitQuery::wait_seconds, {0, limits::kWaitSeconds},
             "Respond at a final state (with If-None-Match: at any change), or after this many "
             "seconds (at most --max-wait, 25 by default)."),
  };
  return kTable;
}

/// Parses a list's query; invalid values give 400.
template <typename S, typename Table>
Parsed<S> parse_list_query(const Table& table, QueryParams query) {
  S out;
  Faults faults;
  read_query(table, query, out, faults);
  if (!faults.empty()) {
    return make_problem(core::ErrorCode::kBadSyntax, faults.problem().errors);
  }
  return out;
}

}  // namespace

Parsed<ListQuery> parse_job_list_query(QueryParams query) {
  return parse_list_query<ListQuery>(job_list_table(), query);
}
Parsed<ListQuery> parse_scene_list_query(QueryParams query) {
  return parse_list_query<ListQuery>(scene_list_table(), query);
}
Parsed<DeliveryListQuery> parse_delivery_list_query(QueryParams query) {
  return parse_list_query<DeliveryListQuery>(delivery_list_table(), query);
}
Parsed<SceneUploadQuery> parse_scene_upload_query(QueryParams query) {
  return parse_query(scene_upload_table(), query, SceneUploadQuery{});
}
Parsed<SubmitQuery> parse_submit_query(QueryParams query) {
  return parse_query(submit_table(), query, SubmitQuery{});
}
Parsed<WaitQuery> parse_wait_query(QueryParams query) {
  return parse_query(wait_table(), query, WaitQuery{});
}
Parsed<ListQuery> parse_batch_list_query(QueryParams query) {
  return parse_list_query<ListQuery>(scene_list_table(), query);
}
Parsed<bool> parse_batch_submit_query(QueryParams query) {
  const auto parsed = parse_query(batch_submit_table(), query, SubmitQuery{});
  return parsed ? Parsed<bool>(parsed->dry_run) : parsed.problem();
}
Parsed<std::monostate> parse_no_query(QueryParams query) {
  return parse_query(std::tuple{}, query, std::monostate{});
}

Json job_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(job_list_table(), ListQuery{});
}
Json scene_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(scene_list_table(), ListQuery{});
}
Json delivery_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(delivery_list_table(), DeliveryListQuery{});
}
Json scene_upload_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(scene_upload_table(), SceneUploadQuery{});
}
Json submit_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(submit_table(), SubmitQuery{});
}
Json wait_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(wait_table(), WaitQuery{});
}
Json batch_list_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(scene_list_table(), ListQuery{});
}
Json batch_submit_parameters(const Capabilities& /*capabilities*/) {
  return query_parameters(batch_submit_table(), SubmitQuery{});
}

}  // namespace api
