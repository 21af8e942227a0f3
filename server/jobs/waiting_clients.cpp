#include "server/jobs/waiting_clients.h"

#include <utility>

namespace server {

api::Parsed<JobService::Submitted> WaitingClients::enter(JobService& jobs, api::ParsedJob job,
                                                         const JobService::Submission& submission) {
  const core::MutexLock lock(mutex_);  // No client of an equal job leaves meanwhile.
  auto submitted = jobs.submit(std::move(job), submission);
  if (submitted) {
    const auto [waiting, is_new] = waiting_.try_emplace(submitted->job->id());
    ++waiting->second.clients;
    waiting->second.is_kept = waiting->second.is_kept || (is_new && submitted->is_replay);
  }
  return submitted;
}

void WaitingClients::leave(JobService& jobs, const JobPointer& job, bool is_answered) {
  const core::MutexLock lock(mutex_);
  const auto waiting = waiting_.find(job->id());
  waiting->second.is_kept = waiting->second.is_kept || is_answered;
  if (--waiting->second.clients > 0) {
    return;
  }
  const bool is_kept = waiting->second.is_kept;
  waiting_.erase(waiting);
  if (!is_kept) {
    static_cast<void>(jobs.cancel(job));  // Fails only for a job that has already ended.
  }
}

Wait::Wait(WaitingClients& clients, JobService& jobs, JobPointer job)
    : clients_(clients), jobs_(jobs), job_(std::move(job)) {}

Wait::~Wait() { clients_.leave(jobs_, job_, is_answered_); }

}  // namespace server
