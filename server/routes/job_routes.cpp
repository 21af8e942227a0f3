// Jobs: submit, list, get, change, cancel, extend, delete.

#include <algorithm>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "api/answers/dry_run.h"
#include "api/answers/job_view.h"
#include "api/job/picture_origin.h"
#include "api/json/error_codes.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/requests.h"
#include "core/base/sha256.h"
#include "core/base/text.h"
#include "core/image_io/image_texts.h"
#include "server/http/conditional.h"
#include "server/http/problem.h"
#include "server/http/text.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/job_answers.h"
#include "server/routes/with_query.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

/// Part of an image file before its pixels: a job request and a few lines.
constexpr std::size_t kPictureHeadBytes = std::size_t{2} << 20U;

/// Waits until the ETag differs from `known`, or until the deadline.
void wait_for_change(const JobService& jobs, const Job& job, std::string_view known,
                     WaitClock::time_point deadline, const std::stop_token& stop) {
  while (WaitClock::now() < deadline && !stop.stop_requested()) {
    const std::uint64_t seen = job.log().last_seq();
    const api::JobView view = jobs.view(job);
    if (!etag_matches_weakly(known, api::job_etag(view)) || api::is_final(view.state)) {
      return;
    }
    job.log().wait_after(seen, EventLog::Wake::kAnything, deadline, stop);
  }
}

Response dry_run(const RouteContext& context, const Request& request, api::ParsedJob parsed) {
  auto checked = context.jobs.check(std::move(parsed), request.access);
  if (!checked) {
    return problem_answer(request, checked.problem());
  }
  const auto cost =
      context.jobs.estimate(checked->job.spec, request.access.tenant, request.stop_token());
  if (!cost) {
    return error_answer(request, cost.error());
  }
  return json_response(200, api::dry_run_json({.job = checked->job, .cost = *cost}));
}

Response submitted_answer(const RouteContext& context, const Request& request,
                          const JobService::Submitted& submitted) {
  const Job& job = *submitted.job;
  const auto asked = api::prefer_wait_seconds(request.headers.joined("Prefer").value_or(""));
  const auto wait = asked ? std::optional(honoured_wait(context, *asked)) : std::nullopt;
  // The job exists already: without a free stream the Prefer header is ignored.
  const bool waits = wait && take_stream_place(context, request);
  int status = submitted.is_replay ? 200 : 201;
  if (waits) {
    wait_for_end(job, deadline_in(*wait), request.stop_token());
  }
  const api::JobView view = context.jobs.view(job);
  if (wait && !submitted.is_replay) {
    status = api::is_final(view.state) ? 201 : 202;
  }
  Response response = job_answer(status, job, view);
  response.headers.set("Location", "/v1/jobs/" + job.id());
  if (waits) {
    response.headers.set("Preference-Applied", "wait=" + api::number_text(*wait));
  }
  return response;
}

/// PUT: the client chooses the id, so that a repeated request creates one job.
Response put(const RouteContext& context, Request& request) {
  std::string id(request.path_param("id"));
  if (!api::is_uuid(id)) {
    return error_answer(request,
                        Error{ErrorCode::kInvalidArgument, "\"" + id + "\" is not a UUID", "/id"});
  }
  auto parsed = api::parse_job(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  if (auto refused = refuse_webhook(context, request, parsed->spec)) {
    return std::move(*refused);
  }
  const auto submitted = context.jobs.submit(
      std::move(*parsed), {.access = request.access,
                           .body_hash = core::sha256_hex(request.body.data(), request.body.size()),
                           .id = core::in_lower_case(id)});
  if (!submitted) {
    return problem_answer(request, submitted.problem());
  }
  return submitted_answer(context, request, *submitted);
}

/// The job request in the body, and the body's hash.
struct Asked {
  api::Parsed<api::ParsedJob> job;
  std::string hash;
};

/// Keeps only the head of an image file, which contains the job request.
Asked read_picture(const RouteContext& context, Request& request) {
  std::string head;
  core::Sha256 hash;
  const bool is_complete = request.body_reader->read([&](std::string_view piece) {
    hash.add(piece.data(), piece.size());
    head.append(piece.substr(0, kPictureHeadBytes - std::min(head.size(), kPictureHeadBytes)));
    return true;
  });
  if (!is_complete) {
    return {api::from_error(body_cut_short()), {}};
  }
  const auto texts = core::read_image_texts(std::as_bytes(std::span(head)));
  if (!texts) {
    return {api::from_error(texts.error()), {}};
  }
  return {api::parse_picture_origin(*texts, context.about.build.arithmetic), hash.hex()};
}

Asked read_job(const RouteContext& context, Request& request, bool from_image) {
  if (from_image != (request.body_reader != nullptr)) {
    return {api::make_problem(
                ErrorCode::kUnsupportedFormat,
                from_image ? "with from=image the body is an image: send image/png or image/x-exr"
                           : "an image is taken with ?from=image only; send application/json"),
            {}};
  }
  return from_image ? read_picture(context, request)
                    : Asked{api::parse_job(request.body),
                            core::sha256_hex(request.body.data(), request.body.size())};
}

Response create_job(const RouteContext& context, Request& request, const api::SubmitQuery& query) {
  Asked asked = read_job(context, request, query.from_image);
  auto& parsed = asked.job;
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  if (query.dry_run) {
    return dry_run(context, request, std::move(*parsed));
  }
  if (auto refused = refuse_webhook(context, request, parsed->spec)) {
    return std::move(*refused);
  }
  JobService::Submission submission;
  submission.access = request.access;
  auto key = idempotency_key(request);
  if (!key) {
    return error_answer(request, key.error());
  }
  if (!key->empty()) {
    submission.key = *std::move(key);
    submission.body_hash = asked.hash;
  }
  const auto submitted = context.jobs.submit(std::move(*parsed), submission);
  if (!submitted) {
    return problem_answer(request, submitted.problem());
  }
  return submitted_answer(context, request, *submitted);
}

Response list_jobs(const RouteContext& context, Request& request, const api::ListQuery& query) {
  JobQuery wanted;
  wanted.limit = query.limit;
  wanted.stored = query.job_class != api::ListQuery::Class::kPreview;
  wanted.previews = query.job_class != api::ListQuery::Class::kNormal;
  wanted.title = query.name;
  const auto before = page_start(query.cursor);
  if (!before) {
    return error_answer(request, before.error());
  }
  wanted.before = *before;
  for (const api::JobState state : query.states) {
    wanted.states.emplace_back(api::to_text(state));
  }
  for (const api::LabelFilter& label : query.labels) {
    wanted.labels.emplace_back(label.key, label.value);
  }
  const auto page = context.jobs.index().list(std::move(wanted), request.access);
  if (!page) {
    return error_answer(request, page.error());
  }
  const auto next =
      page->next ? std::optional<std::string>(std::to_string(*page->next)) : std::nullopt;
  return list_answer(request, api::job_list_json(page->jobs, page->damaged, next), next);
}

Response get_job(const RouteContext& context, Request& request, const JobPointer& job,
                 const api::WaitQuery& query) {
  const auto known = request.headers.joined("If-None-Match");
  if (query.wait_seconds > 0) {
    if (!take_stream_place(context, request)) {
      return no_stream_response(request.path);
    }
    const auto deadline = deadline_in(honoured_wait(context, query.wait_seconds));
    if (known) {
      wait_for_change(context.jobs, *job, *known, deadline, request.stop_token());
    } else {
      wait_for_end(*job, deadline, request.stop_token());
    }
  }
  const api::JobView view = context.jobs.view(*job);
  const std::string etag = api::job_etag(view);
  Response response =
      is_not_modified(request, etag) ? not_modified(etag) : job_answer(200, *job, view);
  if (honoured_wait(context, query.wait_seconds) < query.wait_seconds) {
    response.headers.set("Preference-Applied",
                         "wait=" + api::number_text(context.config.wait_max_seconds));
  }
  return response;
}

Response patch(const RouteContext& context, Request& request, const JobPointer& job) {
  std::optional<std::vector<std::uint32_t>> versions;
  if (const auto if_match = request.headers.joined("If-Match");
      if_match && trim(*if_match) != "*") {
    versions.emplace();
    for (const std::string_view etag : split_list(*if_match)) {
      if (const auto version = api::etag_spec_version(etag)) {
        versions->push_back(*version);
      }
    }
    if (versions->empty()) {
      return error_answer(request, api::kPreconditionFailed,
                          "If-Match does not match an ETag of this job");
    }
  }
  const auto patched = context.jobs.patch(job, request.body, versions, request.access);
  if (!patched) {
    return problem_answer(request, patched.problem());
  }
  return job_answer(200, *job, context.jobs.view(*job));
}

Response cancel(const RouteContext& context, Request& request, const JobPointer& job) {
  if (const auto cancelled = context.jobs.cancel(job); !cancelled) {
    return problem_answer(request, cancelled.problem());
  }
  return job_answer(200, *job, context.jobs.view(*job));
}

Response retry(const RouteContext& context, Request& request, const JobPointer& job) {
  if (const auto retried = context.jobs.retry(job); !retried) {
    return problem_answer(request, retried.problem());
  }
  return job_answer(202, *job, context.jobs.view(*job));
}

Response extend(const RouteContext& context, Request& request, const JobPointer& job) {
  const auto extended = context.jobs.extend(job, request.body);
  if (!extended) {
    return problem_answer(request, extended.problem());
  }
  return job_answer(202, *job, context.jobs.view(*job));
}

Response remove_job(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("id"));
  const auto removed = context.jobs.remove(id, request.access);
  return removed ? empty_response() : problem_answer(request, removed.problem());
}

}  // namespace

void add_job_handlers(const RouteContext& context, HandlerTable& table) {
  const BodyPolicy json = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes));
  table["createJob"] = {
      .handler = with_query(&api::parse_submit_query, &create_job),
      .body = BodyPolicy::json_or_picture(json.limit_bytes, context.config.upload_bytes_max)};
  table["putJob"] = {.handler = &put, .body = json};
  table["listJobs"] = {.handler = with_query(&api::parse_job_list_query, &list_jobs)};
  table["getJob"] = {.handler = with_query(&api::parse_wait_query, &get_job)};
  table["patchJob"] = {.of_job = &patch, .body = json};
  table["cancelJob"] = {.of_job = &cancel};
  table["retryJob"] = {.of_job = &retry};
  table["extendJob"] = {.of_job = &extend, .body = json};
  table["deleteJob"] = {.handler = &remove_job};
}

}  // namespace server
