#include "server/routes/picture_by_url.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/queries/render_query.h"
#include "core/base/url_signature.h"
#include "server/http/problem.h"
#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/job_answers.h"
#include "server/routes/picture_answer.h"
#include "server/routes/preset_routes.h"
#include "server/store/key_table.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::string_view kPublic = "public";

/// A job that fails is not tried again for so long, however many visitors come; they get its
/// failure. Who has mended the cause deletes or retries the job.
constexpr double kFailedSeconds = 300;

/// Returns the part of the URL that the signature covers: the last three segments of its path, as
/// they were sent, and its query.
std::string_view signed_part(const Request& request) {
  constexpr int kSegments = 3;
  const std::string_view target = request.target;
  std::size_t begin = std::min(target.find('?'), target.size());
  for (int i = 0; i < kSegments; ++i) {
    begin = target.rfind('/', begin - 1);
  }
  return target.substr(begin);
}

/// The preset that a URL may use.
struct Granted {
  std::string tenant;
  api::Preset preset;
};

/// Problems: 403 for a signature that no key makes; 404.
api::Parsed<Granted> grant(const RouteContext& context, const Request& request) {
  const std::string_view signature = request.path_param("signature");
  const std::string_view name = request.path_param("preset");
  if (signature == kPublic) {
    const auto row = context.presets.find_public(name);
    if (!row) {
      return api::from_error(row.error());
    }
    if (!*row) {
      return no_preset_problem(name);
    }
    auto preset = api::parse_preset((*row)->body);
    return preset ? api::Parsed<Granted>({.tenant = (*row)->tenant, .preset = *std::move(preset)})
                  : api::Parsed<Granted>(preset.problem());
  }
  const auto forged = [] {
    return api::make_problem(ErrorCode::kForbidden, "the signature is not that of this URL");
  };
  if (signature.size() != core::kSignatureSize) {
    return forged();
  }
  const auto keys = context.presets.keys();
  if (!keys) {
    return api::from_error(keys.error());
  }
  for (const SigningKeyRow& row : **keys) {
    if (!is_same_secret(core::url_signature(row.key, signed_part(request)), signature)) {
      continue;
    }
    auto preset = stored_preset(context.presets, name, row.tenant);
    if (!preset) {
      return preset.problem();
    }
    return *preset ? api::Parsed<Granted>({.tenant = row.tenant, .preset = **std::move(preset)})
                   : api::Parsed<Granted>(no_preset_problem(name));
  }
  return forged();
}

Response busy(const Request& request, std::string why) {
  return error_answer(request, ErrorCode::kUnavailable, std::move(why));
}

/// Every pixel has a sample, or there will be no more.
bool has_image(const api::JobView& view) {
  return api::is_final(view.state) || view.progress.samples_min > 0;
}

/// Waits for the end of the job, and at most that long.
api::JobView first_view(const RouteContext& context, const Request& request, const JobPointer& job,
                        double seconds) {
  wait_for_end(*job, deadline_in(honoured_wait(context, seconds)), request.stop_token());
  return context.jobs.view(*job);
}

/// Returns the image of the job as it is: final and immutable, or of complete passes and not to be
/// stored.
Response image_of(const RouteContext& context, const Request& request, const JobPointer& job,
                  const core::ImageFormat& format, const api::JobView& view) {
  if (view.failure) {
    Response response = problem_answer(request, *view.failure);
    const double age = unix_now() - view.finished_at_unix_seconds.value_or(0);
    const double left = std::clamp(kFailedSeconds - age, 1.0, kFailedSeconds);
    response.headers.set("Retry-After", std::to_string(std::lround(std::ceil(left))));
    return response;
  }
  if (view.state == api::JobState::kCancelled) {
    return busy(request, "the job of the image was cancelled");
  }
  if (!has_image(view)) {
    return busy(request, "the image is not rendered yet");
  }
  api::ImageQuery look;
  look.auto_exposure = !format.high_dynamic_range;
  Response response = picture_answer(context, request, job, format, look);
  if (response.status == 200 || response.status == 304) {
    response.headers.set("Cache-Control", api::is_final(view.state)
                                              ? "public, max-age=31536000, immutable"
                                              : "no-store");
    response.headers.remove("Vary");  // The URL alone names the image.
  }
  return response;
}

}  // namespace

Response picture_by_url(const RouteContext& context, const UrlVisitors& shared, Request& request) {
  const auto granted = grant(context, request);
  if (!granted) {
    return problem_answer(request, granted.problem());
  }
  request.access = context.guard.access_of_tenant(granted->tenant);
  const auto url = api::parse_picture_url(request.path_param("scene"), request.path_param("view"),
                                          request.query_params);
  if (!url) {
    return problem_answer(request, url.problem());
  }
  auto made = api::parse_picture_job(granted->preset, *url);
  if (!made) {
    return problem_answer(request, made.problem());
  }
  if (request.path_param("signature") == kPublic) {
    if (!made->is_size_listed) {
      return error_answer(request, ErrorCode::kForbidden,
                          "this size is not among the sizes of the preset");
    }
    // Each angle is an image to render: the number of those that anybody may ask for is limited.
    if (!made->is_view_listed) {
      return error_answer(
          request, ErrorCode::kForbidden,
          "angles of public images are whole degrees, or those of the preset's orbit");
    }
  }
  const core::ImageFormat* format = choose_format(request, url->format);
  if (format == nullptr) {
    return error_answer(request, unknown_format());
  }
  const auto facts = context.scenes.facts(url->scene, request.access);
  if (!facts) {  // Images of a deleted scene are gone, too.
    return error_answer(request, Error{facts.error().code, facts.error().message, "/scene"});
  }
  api::frame_model(made->job.spec, *facts, granted->preset.is_turntable);
  if (auto refused = refuse_webhook(context, request, made->job.spec)) {
    return *std::move(refused);
  }
  auto submission = submission_by_content(request.access, made->job.spec);
  submission.failed_seconds = kFailedSeconds;
  const auto known = context.jobs.find_equal(submission);
  if (!known) {
    return error_answer(request, known.error());
  }
  if (*known && api::is_final((*known)->state())) {
    return image_of(context, request, *known, *format, context.jobs.view(**known));
  }
  if (!take_stream_place(context, request)) {
    return no_stream_response(request.path);
  }
  const auto submitted = shared.started.enter(
      granted->tenant, std::string(request.path_param("preset")), *known != nullptr,
      [&] { return shared.clients.enter(context.jobs, std::move(made->job), submission); });
  if (!submitted) {
    // What is too much now may be little later.
    return submitted.problem().status == 429 ? busy(request, submitted.problem().detail)
                                             : problem_answer(request, submitted.problem());
  }
  const JobPointer& job = submitted->job;
  const Wait waiting(shared.clients, context.jobs, job);
  const api::JobView view = first_view(context, request, job, granted->preset.deadline_seconds);
  return image_of(context, request, job, *format, view);
}

}  // namespace server
