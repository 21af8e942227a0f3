/// Clients that wait for the images of jobs, by POST /v1/render or by URL, in one place for both.
#pragma once

#include <map>
#include <string>

#include "core/base/mutex.h"
#include "server/jobs/job_service.h"

namespace server {

/// A job is cancelled when the last of its clients has left and none was answered.
class WaitingClients {
 public:
  /// Submits the job; its client waits from here to leave().
  api::Parsed<JobService::Submitted> enter(JobService& jobs, api::ParsedJob job,
                                           const JobService::Submission& submission);
  void leave(JobService& jobs, const JobPointer& job, bool is_answered);

 private:
  struct Waiting {
    int clients = 0;
    bool is_kept = false;  ///< A client was answered with it, or it is older than all of them.
  };
  core::Mutex mutex_;
  std::map<std::string, Waiting> waiting_ GUARDED_BY(mutex_);  ///< By job id.
};

/// A client's wait for a job that it has entered. Its end is an answer, unless the client gave up.
class Wait {
 public:
  /// clients and jobs must outlive it.
  Wait(WaitingClients& clients, JobService& jobs, JobPointer job);
  ~Wait();
  Wait(const Wait&) = delete;
  Wait& operator=(const Wait&) = delete;
  /// The client has left without an answer.
  void give_up() { is_answered_ = false; }

 private:
  WaitingClients& clients_;
  JobService& jobs_;
  const JobPointer job_;
  bool is_answered_ = true;
};

}  // namespace server
