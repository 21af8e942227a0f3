/// GET /v1/jobs/{id}/events: sends the events of a job to one client.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "api/answers/events.h"
#include "server/http/message.h"
#include "server/http/sse.h"
#include "server/http/stream_gate.h"
#include "server/jobs/job_service.h"

namespace server {

/// Returns the STREAM part of event ids: the number of the server's run, in base 36.
std::string stream_name(std::int64_t run);
/// Returns empty if the name is not such a number.
std::optional<std::int64_t> stream_number(std::string_view name);

/// Silence after which a stream of events sends a comment.
inline constexpr std::chrono::seconds kEventsPing{15};
/// Between two polls, as for StreamGate::pace().
inline constexpr std::chrono::microseconds kEventsPace{50'000};
/// Asks the client to reconnect and resume, since the server stops.
std::string farewell_text();

class EventStream {
 public:
  struct Options {
    std::chrono::milliseconds progress{500};
    std::size_t tiles_at_a_time = 256;
    /// Formats an event; empty: format_sse().
    std::function<std::string(const SseEvent&)> format = {};
  };

  /// last: the last event that the client has. streams: number of open streams.
  EventStream(JobService& jobs, JobPointer job, std::optional<SseId> last,
              const StreamGate& streams, Options options);

  /// Returns whether the client has the `end` and nothing follows it: 204.
  bool is_over() const;
  /// Sends until the job has ended or the client has disconnected.
  void run(StreamWriter& writer);

  // For clients that watch several jobs: beginning() returns the first events, news() those since
  // then. Neither waits.
  std::string beginning();
  std::string news();
  /// Returns whether `end` was among the events sent.
  bool has_ended() const { return ended_; }
  const Job& job() const { return *job_; }

 private:
  using Clock = std::chrono::steady_clock;

  std::string from_store(const SseId& last);
  std::string ended_job();
  std::string text_of(std::string_view id, api::EventType type, std::string_view data) const;
  /// Returns whether the job ended with this event and has not been resumed since.
  bool is_last_end(const LoggedEvent& event) const;
  bool send_news(StreamWriter& writer);
  void wait_for_news(bool has_sent, StreamWriter& writer) const;
  std::string format_event(const LoggedEvent& event);
  std::string tile_text(const LoggedEvent& event);
  std::string snapshot(const std::string& id) const;
  void append_due_progress(std::string& text);

  JobService& jobs_;
  const JobPointer job_;
  const std::optional<SseId> last_;
  const StreamGate& streams_;
  const Options options_;
  const std::string stream_;
  std::uint64_t seq_ = 0;  ///< The client has all events up to this number.
  bool ended_ = false;
  bool progress_pending_ = false;
  Clock::time_point progress_told_;
  Clock::time_point written_;
};

}  // namespace server
