#include "api/answers/events.h"

#include <array>

#include <nlohmann/json.hpp>

#include "api/answers/views.h"
#include "api/json/time_text.h"
#include "api/json/values.h"

namespace api {
namespace {

struct TileEventView {
  std::string_view job_id;
  const TileEvent& tile;
};
struct WebhookView {
  EventType type = EventType::kEnd;
  double unix_seconds = 0;
  const JobView& job;
};
struct OverloadedView {
  int retry_after_seconds = 0;
};

struct EventRow {
  EventType type;
  std::string_view name;
  bool durable;
};
constexpr std::array kEvents = {
    EventRow{EventType::kSnapshot, "snapshot", false},
    EventRow{EventType::kState, "state", true},
    EventRow{EventType::kProgress, "progress", false},
    EventRow{EventType::kTile, "tile", false},
    EventRow{EventType::kWarning, "warning", true},
    EventRow{EventType::kEnd, "end", true},
    EventRow{EventType::kReset, "reset", false},
    EventRow{EventType::kOverloaded, "overloaded", false},
};

const View<JobView>& state_event_view() {
  static const View<JobView> kView = {
      "StateEvent",
      "The state has changed.",
      {state_row(),
       pause_reason_row(),
       stop_reason_row(),
       queue_position_row(),
       {"spec_version", shape::count("Number of changes of `spec`."),
        Member<&JobView::spec_version>::json}}};
  return kView;
}

const View<JobView>& progress_event_view() {
  static const View<JobView> kView = {
      "ProgressEvent",
      "The image has progressed.",
      {state_row(), progress_row(), error_estimate_row(), light_not_found_row(), statistics_row(),
       revision_row(), available_row(), denoised_row()}};
  return kView;
}

std::string tile_url(const TileEventView& view) {
  const core::PixelRect& rect = view.tile.rect;
  return "/v1/jobs/" + std::string(view.job_id) + "/image.png?x=" + std::to_string(rect.x) +
         "&y=" + std::to_string(rect.y) + "&width=" + std::to_string(rect.width) +
         "&height=" + std::to_string(rect.height) +
         "&revision=" + std::to_string(view.tile.revision);
}

const View<TileEventView>& tile_event_view() {
  static const View<TileEventView> kView = {
      "TileEvent",
      "A tile has changed; only the newest event of each tile is kept.",
      {{"x", shape::count("Left column, in pixels of the full film."),
        [](const TileEventView& t) -> Json { return t.tile.rect.x; }},
       {"y", shape::count("Top row."),
        [](const TileEventView& t) -> Json { return t.tile.rect.y; }},
       {"width", shape::count(), [](const TileEventView& t) -> Json { return t.tile.rect.width; }},
       {"height", shape::count(),
        [](const TileEventView& t) -> Json { return t.tile.rect.height; }},
       {"revision", shape::count("Revision of the image."),
        [](const TileEventView& t) -> Json { return t.tile.revision; }},
       {"samples", shape::real("Samples per pixel."),
        [](const TileEventView& t) { return number_json(t.tile.samples); }},
       {"error", shape::nullable(shape::real("Relative error of the tile; null: unknown.")),
        [](const TileEventView& t) { return number_json(t.tile.error); }},
       {"url", shape::text("The tile's part of the image."),
        [](const TileEventView& t) -> Json { return tile_url(t); }}}};
  return kView;
}

const View<std::string_view>& warning_event_view() {
  static const View<std::string_view> kView = {
      "WarningEvent",
      "A new entry of the job's `warnings`.",
      {{"message", shape::text(), [](const std::string_view& text) -> Json { return text; }}}};
  return kView;
}

const View<JobView>& end_event_view() {
  static const View<JobView> kView = {
      "EndEvent",
      "The job has ended.",
      {state_row(), stop_reason_row(), digest_row(), revision_row(), available_row(),
       error_estimate_row(), light_not_found_row(), failure_row()}};
  return kView;
}

const View<WebhookView>& webhook_view() {
  static const View<WebhookView> kView = {
      "Webhook",
      "The body of a webhook, signed as defined by Standard Webhooks.",
      {{"type", shape::text("`job.state`, `job.warning` or `job.end`."),
        [](const WebhookView& w) -> Json { return "job." + std::string(to_text(w.type)); }},
       {"timestamp", shape::time(),
        [](const WebhookView& w) -> Json { return rfc3339(w.unix_seconds); }},
       {"data", job_view().shape(), [](const WebhookView& w) { return job_view().print(w.job); }}}};
  return kView;
}

const View<std::string_view>& reset_event_view() {
  static const View<std::string_view> kView = {
      "ResetEvent",
      "Events were lost; a snapshot follows.",
      {{"reason", shape::text(), [](const std::string_view& text) -> Json { return text; }}}};
  return kView;
}

const View<OverloadedView>& overloaded_event_view() {
  static const View<OverloadedView> kView = {
      "OverloadedEvent",
      "The stream is refused: the server's limit of streams is reached.",
      {{"detail", shape::text(),
        [](const OverloadedView&) -> Json {
          return "Too many streams are open; try again later.";
        }},
       {"retry_after_seconds", shape::count(),
        Member<&OverloadedView::retry_after_seconds>::json}}};
  return kView;
}

}  // namespace

std::string_view to_text(EventType type) { return kEvents[static_cast<std::size_t>(type)].name; }
std::optional<EventType> event_type_from_text(std::string_view text) {
  for (const EventRow& row : kEvents) {
    if (row.name == text) {
      return row.type;
    }
  }
  return {};
}
bool is_durable(EventType type) { return kEvents[static_cast<std::size_t>(type)].durable; }

std::string snapshot_event(const JobView& job) { return job_json(job); }

std::string state_event(const JobView& job) { return dump(state_event_view().print(job)); }

std::string progress_event(const JobView& job) { return dump(progress_event_view().print(job)); }

std::string tile_event(std::string_view job_id, const TileEvent& tile) {
  return dump(tile_event_view().print({job_id, tile}));
}

std::string warning_event(std::string_view message) {
  return dump(warning_event_view().print(message));
}

std::string end_event(const JobView& job) { return dump(end_event_view().print(job)); }

std::string webhook_body(EventType type, double unix_seconds, const JobView& job) {
  return dump(webhook_view().print({type, unix_seconds, job}));
}

std::string reset_event(std::string_view reason) { return dump(reset_event_view().print(reason)); }

std::string overloaded_event(int retry_after_seconds) {
  return dump(overloaded_event_view().print({retry_after_seconds}));
}

void add_event_schemas(Json& components) {
  state_event_view().add_to(components);
  progress_event_view().add_to(components);
  tile_event_view().add_to(components);
  warning_event_view().add_to(components);
  end_event_view().add_to(components);
  reset_event_view().add_to(components);
  overloaded_event_view().add_to(components);
  webhook_view().add_to(components);
}

}  // namespace api
