#include "server/routes/render_order.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "core/base/invalid.h"
#include "server/http/problem.h"
#include "server/pictures/image_look.h"
#include "server/routes/answers.h"
#include "server/routes/job_answers.h"
#include "server/routes/picture_answer.h"
#include "server/routes/preset_routes.h"

namespace server {
namespace {

using core::ErrorCode;

Response accepted(const RouteContext& context, const Job& job) {
  // Retry-After has whole seconds, and an estimate of more than a minute is often wrong.
  constexpr double kSoonest = 1;
  constexpr double kLatest = 60;
  const api::JobView view = context.jobs.view(job);
  const double eta = view.progress.eta_seconds.value_or(kSoonest);
  Response response = job_answer(202, job, view);
  response.headers.set("Retry-After",
                       std::to_string(std::lround(std::clamp(std::ceil(eta), kSoonest, kLatest))));
  return response;
}

/// Waits for the job, and returns its image.
Response waited_answer(const RouteContext& context, const Request& request, const JobPointer& job,
                       double wait_seconds, const core::ImageFormat& format,
                       const api::ImageQuery& look) {
  wait_for_end(*job, deadline_in(wait_seconds), request.stop_token());
  const api::JobView view = context.jobs.view(*job);
  if (!api::is_final(view.state)) {
    return accepted(context, *job);
  }
  if (view.failure) {
    return problem_answer(request, *view.failure);
  }
  if (view.state == api::JobState::kCancelled) {
    return error_answer(request, ErrorCode::kConflict, "the job was cancelled");
  }
  return picture_answer(context, request, job, format, look);
}

}  // namespace

std::optional<Response> check_order(const Request& request, const RenderOrder& order) {
  const core::ImageFormat* format = choose_format(request, order.query.format);
  if (format == nullptr) {
    return error_answer(request, unknown_format());
  }
  if (const auto refused = refused_look(*format, order.query.look)) {
    return error_answer(request, *refused);
  }
  return std::nullopt;
}

std::optional<Response> find_preset(const RouteContext& context, const Request& request,
                                    RenderOrder& order) {
  if (!api::names_stored_preset(order.query)) {
    return std::nullopt;
  }
  const std::string& name = order.query.preset;
  const auto preset = stored_preset(context.presets, name, request.access.tenant);
  if (!preset) {
    return problem_answer(request, preset.problem());
  }
  if (!*preset) {
    return error_answer(
        request, core::invalid("/preset", "no light and no preset has the name \"" + name + "\""));
  }
  order.uploads.preset_job = (*preset)->job;
  order.is_turntable = (*preset)->is_turntable;
  return std::nullopt;
}

Rendered render_order(const RouteContext& context, WaitingClients& clients, Request& request,
                      RenderOrder order) {
  auto& query = order.query;
  const core::ImageFormat& format = *choose_format(request, query.format);
  auto job = api::parse_render_job(order.job, query, order.uploads);
  if (!job) {
    return {problem_answer(request, job.problem())};
  }
  if (!job->spec.has_image) {
    return {
        error_answer(request, core::invalid("/film", "must not be null: the answer is an image"))};
  }
  if (const auto facts = context.scenes.facts(job->spec.scene, request.access)) {
    // A scene that does not exist is refused below.
    api::frame_model(job->spec, *facts, order.is_turntable);
  }
  if (!query.has_exposure && !format.high_dynamic_range) {
    query.look.auto_exposure = true;
  }
  if (auto refused = refuse_webhook(context, request, job->spec)) {
    return {*std::move(refused)};
  }
  if (!take_stream_place(context, request)) {
    return {no_stream_response(request.path)};
  }
  const auto submission = order.is_once ? JobService::Submission{.access = request.access}
                                        : submission_by_content(request.access, job->spec);
  const auto submitted = clients.enter(context.jobs, *std::move(job), submission);
  if (!submitted) {
    return {problem_answer(request, submitted.problem())};
  }
  const JobPointer& made = submitted->job;
  Wait waiting(clients, context.jobs, made);
  const double wait =
      order.is_once
          ? api::limits::kStopSeconds
          : honoured_wait(context, query.wait_seconds.value_or(context.config.wait_max_seconds));
  Response response = waited_answer(context, request, made, wait, format, query.look);
  // A stopping server keeps the job for its next start, unless no client could ask for it there.
  if ((context.ready || order.is_once) && request.stop_token().stop_requested()) {
    waiting.give_up();
  }
  response.headers.set("Location", "/v1/jobs/" + made->id());
  return {.response = std::move(response), .job = made};
}

}  // namespace server
