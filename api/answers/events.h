/// Payloads of the event stream: the text after `data:`.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "api/answers/job_view.h"
#include "core/settings/settings.h"

namespace api {

enum class EventType { kSnapshot, kState, kProgress, kTile, kWarning, kEnd, kReset, kOverloaded };
/// "snapshot" "state" "progress" "tile" "warning" "end" "reset" "overloaded".
std::string_view to_text(EventType type);
std::optional<EventType> event_type_from_text(std::string_view text);
/// Returns whether events of that type survive a restart: state, warning and end.
bool is_durable(EventType type);

/// The job, as GET returns it.
std::string snapshot_event(const JobView& job);
/// {"state", "stop_reason", "queue_position", "spec_version"}.
std::string state_event(const JobView& job);
/// {"state", "progress", "error", "statistics", "revision"}.
std::string progress_event(const JobView& job);

struct TileEvent {
  core::PixelRect rect;  ///< pixels of the full film
  std::uint32_t revision = 0;
  double samples = 0;  ///< per pixel
  double error = 0;    ///< relative RMSE of the tile; NaN: unknown
};
/// {"x", "y", "width", "height", "revision", "samples", "error", "url"}; url: the tile's part of
/// the image.
std::string tile_event(std::string_view job_id, const TileEvent& tile);

/// {"message"}.
std::string warning_event(std::string_view message);
/// {"state", "stop_reason", "film_digest", "revision", "error", "failure"}.
std::string end_event(const JobView& job);
/// Returns the body of a webhook call: {"type": "job.end", "timestamp", "data": the job}.
std::string webhook_body(EventType type, double unix_seconds, const JobView& job);

/// {"reason"}: the events that were lost; a snapshot follows.
std::string reset_event(std::string_view reason);
/// {"detail", "retry_after_seconds"}.
std::string overloaded_event(int retry_after_seconds);

}  // namespace api
