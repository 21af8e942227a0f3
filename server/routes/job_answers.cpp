#include "server/routes/job_answers.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "api/answers/job_text.h"
#include "core/base/sha256.h"
#include "server/routes/answers.h"
#include "server/routes/webhook_address.h"

namespace server {

using core::Error;
using core::ErrorCode;

Response job_answer(int status, const Job& job, const api::JobView& view) {
  const Job::SpecText spec = job.spec_text();
  const bool is_current = spec.version == view.spec_version;  // false: changed since
  Response response =
      json_response(status, is_current ? api::job_json(view, *spec.text) : api::job_json(view));
  response.headers.set("ETag", api::job_etag(view));
  response.headers.set("Cache-Control", "no-cache");
  response.compressible = true;
  return response;
}

std::optional<Response> refuse_webhook(const RouteContext& context, const Request& request,
                                       const api::JobSpec& spec) {
  const auto fault =
      spec.webhook ? webhook_address_fault(context.config, spec.webhook->url) : std::nullopt;
  return fault ? std::optional(error_answer(
                     request, Error{ErrorCode::kInvalidArgument, *fault, "/webhook/url"}))
               : std::nullopt;
}

JobService::Submission submission_by_content(const Access& access, const api::JobSpec& spec) {
  const std::string text = api::spec_json(spec);
  const std::string hash = core::sha256_hex(text.data(), text.size());
  return {.access = access, .key = hash, .body_hash = hash, .is_by_content = true};
}

double honoured_wait(const RouteContext& context, double asked_seconds) {
  return std::min(asked_seconds, context.config.wait_max_seconds);
}

WaitClock::time_point deadline_in(double seconds) {
  return WaitClock::now() + std::chrono::microseconds(std::llround(seconds * 1e6));
}

bool take_stream_place(const RouteContext& context, const Request& request) {
  StreamSlot slot = context.streams.try_enter(request.access.tenant);
  const bool has_place = static_cast<bool>(slot);
  if (has_place && request.place != nullptr) {
    *request.place = std::move(slot);
  }
  return has_place;
}

void wait_for_end(const Job& job, WaitClock::time_point deadline, const std::stop_token& stop) {
  while (!api::is_final(job.state()) && WaitClock::now() < deadline && !stop.stop_requested()) {
    const std::uint64_t seen = job.log().last_seq();
    if (!api::is_final(job.state())) {
      job.log().wait_after(seen, EventLog::Wake::kDurable, deadline, stop);
    }
  }
}

}  // namespace server
