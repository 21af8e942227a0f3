/// GET /v1/events?jobs=: one client's way through the events of several jobs.
///
/// Each event has `job` in its data. Its id is that of the last event of each job, with dots
/// between, in the order of the request: with it the client goes on where it was, after a restart
/// too.
#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"
#include "server/http/stream_gate.h"
#include "server/jobs/job_service.h"
#include "server/routes/event_stream.h"

namespace server {

class JobsStream {
 public:
  /// last: Last-Event-ID as it came; one that does not fit these jobs counts as none.
  JobsStream(JobService& jobs, const std::vector<JobPointer>& watched, std::string_view last,
             const StreamGate& streams);
  JobsStream(const JobsStream&) = delete;
  JobsStream& operator=(const JobsStream&) = delete;

  /// The client has seen the end of every job: 204.
  bool is_over() const;
  /// Sends until all jobs have ended or the client has gone.
  void run(StreamWriter& writer);

 private:
  std::string format(std::size_t job, const SseEvent& event);
  bool has_ended() const;
  void wait(bool has_sent, StreamWriter& writer) const;

  const StreamGate& streams_;
  std::vector<std::string> ids_;  ///< Of the last event of each job.
  std::vector<std::unique_ptr<EventStream>> parts_;
};

}  // namespace server
