#include "server/routes/preset_routes.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/queries/render_query.h"
#include "core/base/url_signature.h"
#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/job_answers.h"
#include "server/routes/picture_answer.h"
#include "server/store/key_table.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::string_view kPublic = "public";

Response no_preset(const Request& request, std::string_view name) {
  return error_answer(request, ErrorCode::kNotFound,
                      "no preset has the name \"" + std::string(name) + "\"");
}

/// Returns the presets that the request may see, its own first.
core::Result<std::vector<PresetRow>> visible_presets(const RouteContext& context,
                                                     const Access& access) {
  auto rows = context.presets.list(access.tenant);
  if (rows) {
    std::erase_if(*rows, [&](const PresetRow& row) { return !access.sees(row.tenant); });
  }
  return rows;
}

/// The first of this name, or the end.
auto named(const std::vector<PresetRow>& rows, std::string_view name) {
  return std::find_if(rows.begin(), rows.end(),
                      [name](const PresetRow& row) { return row.name == name; });
}

Response put(const RouteContext& context, Request& request) {
  const std::string name(request.path_param("name"));
  if (!api::is_preset_name(name)) {
    return error_answer(
        request, Error{ErrorCode::kInvalidArgument,
                       "a name has 1 to 64 letters, digits, '.', '_' and '-', and is not that of a "
                       "built-in light",
                       "/name"});
  }
  const auto preset = api::parse_preset(request.body);
  if (!preset) {
    return problem_answer(request, preset.problem());
  }
  if (preset->priority > request.access.priority_max) {
    return error_answer(request,
                        Error{ErrorCode::kInvalidArgument,
                              "is more than " + std::to_string(request.access.priority_max) +
                                  ", the highest priority that this key allows",
                              "/job/priority"});
  }
  const auto replaced = context.presets.put({.name = name,
                                             .body = request.body,
                                             .is_public = preset->is_public,
                                             .tenant = request.access.tenant},
                                            unix_now());
  if (!replaced) {
    return error_answer(request, replaced.error());
  }
  Response response = json_response(*replaced ? 200 : 201, api::preset_json(name, *preset));
  response.headers.set("Location", "/v1/presets/" + name);
  return response;
}

Response get(const RouteContext& context, Request& request) {
  const std::string_view name = request.path_param("name");
  const auto rows = visible_presets(context, request.access);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  const auto found = named(*rows, name);
  const std::string& tenant = found == rows->end() ? request.access.tenant : found->tenant;
  const auto preset = stored_preset(context.presets, name, tenant);
  if (!preset) {
    return problem_answer(request, preset.problem());
  }
  return *preset ? json_response(200, api::preset_json(name, **preset)) : no_preset(request, name);
}

Response list(const RouteContext& context, Request& request) {
  const auto rows = visible_presets(context, request.access);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  std::map<std::string, api::Preset> presets;
  for (const PresetRow& row : *rows) {
    auto preset = api::parse_preset(row.body);
    if (!preset) {
      return problem_answer(request, preset.problem());
    }
    presets.try_emplace(row.name, *std::move(preset));
  }
  presets.insert(api::ready_presets().begin(), api::ready_presets().end());
  return json_response(200, api::preset_list_json(presets));
}

Response remove(const RouteContext& context, Request& request) {
  const std::string_view name = request.path_param("name");
  const auto rows = visible_presets(context, request.access);
  if (!rows) {
    return error_answer(request, rows.error());
  }
  const auto found = named(*rows, name);
  if (found == rows->end()) {
    return no_preset(request, name);
  }
  const auto removed = context.presets.remove(name, found->tenant);
  if (!removed) {
    return error_answer(request, removed.error());
  }
  return *removed ? empty_response() : no_preset(request, name);
}

Response create_key(const RouteContext& context, Request& request) {
  const SigningKeyRow row = make_signing_key(request.access.tenant, unix_now());
  if (const auto stored = context.presets.insert_key(row); !stored) {
    return error_answer(request, stored.error());
  }
  Response response = json_response(201, api::signing_key_json({.id = row.id, .key = row.key}));
  response.headers.set("Cache-Control", "no-store");
  return response;
}

Response list_keys(const RouteContext& context, Request& request) {
  const auto rows = context.presets.keys();
  if (!rows) {
    return error_answer(request, rows.error());
  }
  std::vector<api::SigningKeyRowView> own;
  for (const SigningKeyRow& row : *rows) {
    if (request.access.sees(row.tenant)) {
      own.push_back({.id = row.id, .tenant = row.tenant, .created_at = row.created_at});
    }
  }
  return json_response(200, api::signing_key_list_json(own));
}

Response remove_key(const RouteContext& context, Request& request) {
  const std::string_view id = request.path_param("id");
  const auto rows = context.presets.keys();
  if (!rows) {
    return error_answer(request, rows.error());
  }
  const auto found = std::find_if(rows->begin(), rows->end(), [&](const SigningKeyRow& row) {
    return row.id == id && request.access.sees(row.tenant);
  });
  if (found == rows->end()) {
    return error_answer(request, ErrorCode::kNotFound,
                        "no signing key has the id \"" + std::string(id) + "\"");
  }
  if (const auto removed = context.presets.remove_key(id); !removed) {
    return error_answer(request, removed.error());
  }
  return empty_response();
}

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

api::Problem no_preset_problem(std::string_view name) {
  return api::make_problem(ErrorCode::kNotFound,
                           "no preset has the name \"" + std::string(name) + "\"");
}

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
  for (const SigningKeyRow& row : *keys) {
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
    return problem_answer(request, *view.failure);
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

Response picture(const RouteContext& context, Request& request) {
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
  api::frame_model(made->job.spec, *facts);
  if (auto refused = refuse_webhook(context, request, made->job.spec)) {
    return *std::move(refused);
  }
  if (!take_stream_place(context, request)) {
    return busy(request, "too many streams are open");
  }
  const auto submission = submission_by_content(request.access, made->job.spec);
  const auto submitted = context.jobs.submit(std::move(made->job), submission);
  if (!submitted) {
    // What is too much now may be little later.
    return submitted.problem().status == 429 ? busy(request, submitted.problem().detail)
                                             : problem_answer(request, submitted.problem());
  }
  const JobPointer& job = submitted->job;
  api::JobView view = context.jobs.view(*job);
  if (!api::is_final(view.state)) {
    view = first_view(context, request, job, granted->preset.deadline_seconds);
  }
  return image_of(context, request, job, *format, view);
}

}  // namespace

api::Parsed<std::optional<api::Preset>> stored_preset(PresetTable& presets, std::string_view name,
                                                      const std::string& tenant) {
  using Found = api::Parsed<std::optional<api::Preset>>;
  const auto row = presets.find(name, tenant);
  if (!row) {
    return api::from_error(row.error());
  }
  if (!*row) {
    const auto ready = api::ready_presets();
    const auto found = ready.find(std::string(name));
    return Found(found == ready.end() ? std::nullopt : std::optional(found->second));
  }
  auto preset = api::parse_preset((*row)->body);
  return preset ? Found(*std::move(preset)) : Found(preset.problem());
}

void add_preset_handlers(HandlerTable& table) {
  table["putPreset"] = {
      .handler = &put,
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
  table["getPreset"] = {.handler = &get};
  table["deletePreset"] = {.handler = &remove};
  table["listPresets"] = {.handler = &list};
  table["createSigningKey"] = {.handler = &create_key};
  table["listSigningKeys"] = {.handler = &list_keys};
  table["deleteSigningKey"] = {.handler = &remove_key};
  table["getPicture"] = {.handler = &picture};
}

}  // namespace server
