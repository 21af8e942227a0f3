/// GET /v1/events?jobs=: sends the events of several jobs to one client.
///
/// Each event has `job` in its data. Its id joins the ids of the last event of each job with dots,
/// in the order of the request: with it a client resumes, even after a restart.
#pragma once

#include <cstddef>
#include <memory>
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
  /// last: Last-Event-ID as received; ignored if it does not fit these jobs.
  JobsStream(JobService& jobs, const std::vector<JobPointer>& watched, std::string_view last,
             const StreamGate& streams);
  JobsStream(const JobsStream&) = delete;
  JobsStream& operator=(const JobsStream&) = delete;

  /// Returns whether the client has the end of every job: 204.
  bool is_over() const;
  /// Sends until all jobs have ended or the client has disconnected.
  void run(StreamWriter& writer);

 private:
  std::string format(std::size_t job, const SseEvent& event);
  bool has_ended() const;
  void wait(bool has_sent, StreamWriter& writer) const;

  const StreamGate& streams_;
  std::vector<std::string> ids_;  ///< Id of the last event of each job.
  std::vector<std::unique_ptr<EventStream>> parts_;
};

}  // namespace server
