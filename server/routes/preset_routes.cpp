#include "server/routes/preset_routes.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/json/errors.h"
#include "api/json/limits.h"
#include "server/jobs/submissions.h"
#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

Response no_preset(const Request& request, std::string_view name) {
  return problem_answer(request, no_preset_problem(name));
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
  const auto preset = api::parse_new_preset(request.body);
  if (!preset) {
    return problem_answer(request, preset.problem());
  }
  if (const Verdict allowed = priority_allowed(preset->priority, request.access, "/job/priority");
      !allowed) {
    return problem_answer(request, allowed.problem());
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

Response get_preset(const RouteContext& context, Request& request) {
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

Response list_presets(const RouteContext& context, Request& request) {
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

Response remove_preset(const RouteContext& context, Request& request) {
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
  for (const SigningKeyRow& row : **rows) {
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
  const auto found = std::find_if((*rows)->begin(), (*rows)->end(), [&](const SigningKeyRow& row) {
    return row.id == id && request.access.sees(row.tenant);
  });
  if (found == (*rows)->end()) {
    return error_answer(request, ErrorCode::kNotFound,
                        "no signing key has the id \"" + std::string(id) + "\"");
  }
  if (const auto removed = context.presets.remove_key(id); !removed) {
    return error_answer(request, removed.error());
  }
  return empty_response();
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
  table["getPreset"] = {.handler = &get_preset};
  table["deletePreset"] = {.handler = &remove_preset};
  table["listPresets"] = {.handler = &list_presets};
  table["createSigningKey"] = {.handler = &create_key};
  table["listSigningKeys"] = {.handler = &list_keys};
  table["deleteSigningKey"] = {.handler = &remove_key};
}

}  // namespace server
