// Assets: files named by the hash of their content.

#include <mutex>
#include <shared_mutex>
#include <string>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/error_codes.h"
#include "api/json/errors.h"
#include "api/requests.h"
#include "server/http/conditional.h"
#include "server/http/file_response.h"
#include "server/http/text.h"
#include "server/routes/answers.h"
#include "server/routes/asset_upload.h"
#include "server/routes/context.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

Response upload(const RouteContext& context, Request& request, const std::string& expected_id) {
  std::string type = media_type(request.header("Content-Type").value_or(""));
  if (type.starts_with("multipart/")) {
    return error_answer(request, ErrorCode::kUnsupportedFormat,
                        "the body is a form, not a file; send the file itself, as with curl "
                        "--data-binary @FILE");
  }
  const auto stored = store_asset(
      context, request.access,
      {.id = expected_id,
       .declared_bytes = request.body_reader->declared_bytes().value_or(0),
       .media_type = std::move(type),
       .read = [&](const BodyReader::Sink& sink) { return request.body_reader->read(sink); }});
  if (!stored) {
    return error_answer(request, stored.error());
  }
  Response response =
      json_response(stored->was_kept ? 200 : 201, api::asset_json(stored->id, stored->bytes));
  response.headers.set("Location", "/v1/assets/" + stored->id);
  return response;
}

Response create_asset(const RouteContext& context, Request& request) {
  return upload(context, request, {});
}

Response put(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("sha256"));
  if (!api::is_sha256(id)) {
    return error_answer(
        request, Error{ErrorCode::kInvalidArgument,
                       "\"" + id + "\" is not a sha256 (64 lower-case hex digits)", "/sha256"});
  }
  return upload(context, request, id);
}

Response get_asset(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("sha256"));
  if (const auto found = context.assets.find(id, request.access); !found) {
    return error_answer(request, found.error());
  }
  if (const core::Status whole = context.assets.check(id); !whole) {
    return error_answer(request, whole.error());
  }
  Response response =
      file_response(request, FileSource{.path = context.assets.path_of(id),
                                        .content_type = "application/octet-stream",
                                        .etag = make_etag(id),
                                        .cache_control = "public, max-age=31536000, immutable"});
  if (response.status == 416) {
    Response problem =
        error_answer(request, api::kRangeNotSatisfiable, "the range lies outside the asset");
    if (const auto range = response.headers.find("Content-Range")) {
      problem.headers.set("Content-Range", *range);
    }
    return problem;
  }
  return response;
}

Response remove_asset(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("sha256"));
  if (const auto found = context.assets.find(id, request.access); !found) {
    return error_answer(request, found.error());
  }
  if (!precondition_holds(request, make_etag(id))) {
    return error_answer(request, api::kPreconditionFailed, "If-Match does not match the content");
  }
  // No request can refer to the asset between the check and its deletion.
  const std::unique_lock<std::shared_mutex> naming(context.scenes.names_mutex());
  const auto in_use = [&](const std::optional<std::string>& tenant) {
    return context.jobs.index().needs_asset(id, tenant);
  };
  if (const auto removed = context.assets.remove(id, request.access, in_use); !removed) {
    return error_answer(request, removed.error());
  }
  return empty_response();
}

}  // namespace

void add_asset_handlers(const RouteContext& context, HandlerTable& table) {
  const BodyPolicy body = BodyPolicy::stream(context.config.upload_bytes_max);
  table["createAsset"] = {.handler = &create_asset, .body = body};
  table["putAsset"] = {.handler = &put, .body = body};
  table["getAsset"] = {.handler = &get_asset};
  table["deleteAsset"] = {.handler = &remove_asset};
}

}  // namespace server
