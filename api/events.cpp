#include "api/events.h"

#include <array>

#include <nlohmann/json.hpp>

#include "api/json.h"
#include "api/time_text.h"
#include "api/values.h"
#include "api/view_parts.h"

namespace api {
namespace {

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

std::string state_event(const JobView& job) {
  return dump({{"state", to_text(job.state)},
               {"stop_reason", stop_reason_part(job)},
               {"queue_position", job.queue_position ? Json(*job.queue_position) : Json(nullptr)},
               {"spec_version", job.spec_version}});
}

std::string progress_event(const JobView& job) {
  return dump({{"state", to_text(job.state)},
               {"progress", progress_part(job)},
               {"error", error_part(job)},
               {"statistics", statistics_part(job)},
               {"revision", job.progress.revision}});
}

std::string tile_event(std::string_view job_id, const TileEvent& tile) {
  const core::PixelRect& rect = tile.rect;
  const std::string url =
      "/v1/jobs/" + std::string(job_id) + "/image.png?x=" + std::to_string(rect.x) +
      "&y=" + std::to_string(rect.y) + "&width=" + std::to_string(rect.width) +
      "&height=" + std::to_string(rect.height) + "&revision=" + std::to_string(tile.revision);
  return dump({{"x", rect.x},
               {"y", rect.y},
               {"width", rect.width},
               {"height", rect.height},
               {"revision", tile.revision},
               {"samples", number_json(tile.samples)},
               {"error", number_json(tile.error)},
               {"url", url}});
}

std::string warning_event(std::string_view message) { return dump({{"message", message}}); }

std::string end_event(const JobView& job) {
  return dump({{"state", to_text(job.state)},
               {"stop_reason", stop_reason_part(job)},
               {"film_digest", digest_part(job)},
               {"revision", job.progress.revision},
               {"error", error_part(job)},
               {"failure", failure_part(job)}});
}

std::string webhook_body(EventType type, double unix_seconds, const JobView& job) {
  return dump({{"type", "job." + std::string(to_text(type))},
               {"timestamp", rfc3339(unix_seconds)},
               {"data", job_part(job)}});
}

std::string reset_event(std::string_view reason) { return dump({{"reason", reason}}); }

std::string overloaded_event(int retry_after_seconds) {
  return dump({{"detail", "Too many streams are open; try again later."},
               {"retry_after_seconds", retry_after_seconds}});
}

}  // namespace api
