/// Answers that show a job, and requests that wait for one.
#pragma once

#include <chrono>
#include <optional>
#include <stop_token>

#include "api/answers/job_view.h"
#include "api/job/job_spec.h"
#include "server/http/message.h"
#include "server/jobs/job.h"
#include "server/routes/context.h"

namespace server {

using WaitClock = std::chrono::steady_clock;

/// Returns the job as JSON, with its ETag.
Response job_answer(int status, const Job& job, const api::JobView& view);

/// Returns the answer to a job whose webhook may not be called; empty if it may, or has none.
std::optional<Response> refuse_webhook(const RouteContext& context, const Request& request,
                                       const api::JobSpec& spec);

/// Returns the submission that gets the job of an equal request, if there is one
/// (JobService::Submission::is_by_content).
JobService::Submission submission_by_content(const Access& access, const api::JobSpec& spec);

/// Returns the time to wait, which gateways in front of the server must outlast.
double honoured_wait(const RouteContext& context, double asked_seconds);
WaitClock::time_point deadline_in(double seconds);
/// Counts a waiting request as a stream from here on. Returns false if no stream is free.
bool take_stream_place(const RouteContext& context, const Request& request);
/// Waits until the job is final, or until the deadline.
void wait_for_end(const Job& job, WaitClock::time_point deadline, const std::stop_token& stop);

}  // namespace server
