// Batches: submit, list, get, cancel, retry, delete; images of their jobs.

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "api/batch.h"
#include "api/json/error_codes.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "core/base/sha256.h"
#include "server/http/conditional.h"
#include "server/http/file_response.h"
#include "server/pictures/image_look.h"
#include "server/routes/answers.h"
#include "server/routes/batch_pictures.h"
#include "server/routes/context.h"
#include "server/routes/picture_answer.h"
#include "server/routes/webhook_address.h"
#include "server/routes/with_query.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

std::string id_of(const Request& request) { return std::string(request.path_param("id")); }

Response batch_answer(int status, const api::BatchView& batch) {
  Response response = json_response(status, api::batch_json(batch));
  response.headers.set("Cache-Control", "no-cache");
  response.compressible = true;
  return response;
}

Response view_answer(const RouteContext& context, const Request& request, int status) {
  const auto batch = context.batches.view(id_of(request), request.access);
  return batch ? batch_answer(status, *batch) : error_answer(request, batch.error());
}

Response create_batch(const RouteContext& context, Request& request) {
  const auto dry_run = api::parse_batch_submit_query(request.query_params);
  if (!dry_run) {
    return problem_answer(request, dry_run.problem());
  }
  auto parsed = api::parse_batch(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  if (parsed->webhook) {
    if (auto fault = webhook_address_fault(context.config, parsed->webhook->url)) {
      return error_answer(request,
                          Error{ErrorCode::kInvalidArgument, *std::move(fault), "/webhook/url"});
    }
  }
  for (const api::BatchJob& job : parsed->jobs) {
    const auto& webhook = job.job.spec.webhook;
    if (auto fault = webhook ? webhook_address_fault(context.config, webhook->url) : std::nullopt) {
      return error_answer(
          request, Error{ErrorCode::kInvalidArgument, *std::move(fault), "/template/webhook/url"});
    }
  }
  if (*dry_run) {
    const auto refused = context.batches.check(*parsed, request.access);
    return refused ? problem_answer(request, *refused)
                   : json_response(200, api::batch_dry_run_json(*parsed));
  }
  const auto key = idempotency_key(request);
  if (!key) {
    return error_answer(request, key.error());
  }
  const auto submitted =
      context.batches.submit(*std::move(parsed), request.access, *key,
                             core::sha256_hex(request.body.data(), request.body.size()));
  if (!submitted) {
    return problem_answer(request, submitted.problem());
  }
  Response response = batch_answer(submitted->is_replay ? 200 : 201, submitted->batch);
  response.headers.set("Location", "/v1/batches/" + submitted->batch.id);
  return response;
}

Response list_batches(const RouteContext& context, Request& request, const api::ListQuery& query) {
  const auto before = page_start(query.cursor);
  if (!before) {
    return error_answer(request, before.error());
  }
  const auto page = context.batches.list(*before, query.limit, request.access);
  if (!page) {
    return error_answer(request, page.error());
  }
  const auto next =
      page->next ? std::optional<std::string>(std::to_string(*page->next)) : std::nullopt;
  return list_answer(request, api::batch_list_json(page->batches, next), next);
}

Response get_batch(const RouteContext& context, Request& request) {
  return view_answer(context, request, 200);
}

/// Returns the batch after the requested change.
Response changed(const RouteContext& context, Request& request, int status,
                 Verdict (BatchService::*change)(std::string_view, const Access&)) {
  const Verdict done = (context.batches.*change)(id_of(request), request.access);
  return done ? view_answer(context, request, status) : problem_answer(request, done.problem());
}

Response remove_batch(const RouteContext& context, Request& request) {
  const Verdict done = context.batches.remove(id_of(request), request.access);
  return done ? empty_response() : problem_answer(request, done.problem());
}

const core::ImageFormat& format_of(std::string_view extension) {
  const auto formats = core::image_formats();
  const auto found = std::find_if(formats.begin(), formats.end(), [&](const auto& format) {
    return format.extension == extension;
  });
  CHECK(found != formats.end());
  return *found;
}

/// Returns the jobs that have a film. Errors: why there is no archive.
core::Result<std::vector<JobPointer>> pictured(const std::vector<JobPointer>& jobs) {
  std::vector<JobPointer> found;
  std::string evicted;
  for (const JobPointer& job : jobs) {
    const JobRecord record = job->record();
    if (!api::is_final(record.view.state)) {
      return Error{ErrorCode::kConflict, "job \"" + record.view.spec.name + "\" has not ended", ""};
    }
    if (record.film == FilmPlace::kEvicted) {
      evicted += (evicted.empty() ? "" : ", ") + record.view.spec.name;
    } else if (record.film == FilmPlace::kOnDisk && record.view.spec.has_image) {
      found.push_back(job);
    }
  }
  if (!evicted.empty()) {
    return Error{api::kGone, "evicted to make room for others: " + evicted, ""};
  }
  return found.empty() ? core::Result<std::vector<JobPointer>>(
                             Error{ErrorCode::kConflict, "no job of the batch has an image", ""})
                       : found;
}

/// Archives with at most so many pixels are complete before they are sent: 4 to 10 s of work,
/// which proxies wait for.
constexpr double kMadeFirstPixels = 100e6;

double pixels_of(const std::vector<JobPointer>& jobs) {
  double pixels = 0;
  for (const JobPointer& job : jobs) {
    const core::PixelRect crop = job->record().view.spec.render.film.area();
    pixels += static_cast<double>(crop.width) * crop.height;
  }
  return pixels;
}

std::string archive_etag(const Request& request, const std::vector<JobPointer>& jobs) {
  std::string content;
  for (const auto& [name, value] : request.query_params) {
    content += name + "=" + value + "&";
  }
  for (const JobPointer& job : jobs) {
    const api::JobView view = job->record().view;
    content += "\n" + job->id() + " " + std::to_string(view.progress.revision) + " " +
               std::string(api::to_text(view.state)) + " " + view.spec.name;
  }
  return make_etag("z-" + core::sha256_hex(content.data(), content.size()).substr(0, 16));
}

Response archive(const RouteContext& context, Request& request,
                 const api::BatchPicturesQuery& query) {
  const core::ImageFormat& format = format_of(query.format);
  if (const auto refused = refused_look(format, query.look)) {
    return error_answer(request, *refused);
  }
  const auto jobs = context.batches.jobs(id_of(request), request.access);
  if (!jobs) {
    return error_answer(request, jobs.error());
  }
  auto found = pictured(*jobs);
  if (!found) {
    return error_answer(request, found.error());
  }
  const std::string etag = archive_etag(request, *found);
  if (is_not_modified(request, etag)) {
    return not_modified(etag);
  }
  const BatchPictures pictures(context, query.look);
  // Makes the first image before the status is sent, so that errors common to all images get one.
  const auto first = pictures.picture(found->front(), format, query.look);
  if (!first) {
    return error_answer(request, first.error());
  }
  Response response;
  if (pixels_of(*found) <= kMadeFirstPixels) {
    auto file = pictures.archive_file(*found, *first, format, context.data.path());
    if (!file) {
      return error_answer(request, file.error());
    }
    response = file_response(
        request, *std::move(file),
        {.path = {}, .content_type = "application/zip", .etag = etag, .cache_control = "no-cache"});
  } else {
    response = stream_response(
        "application/zip", [pictures, &format, first = *first,
                            jobs_with_picture = *std::move(found)](StreamWriter& writer) {
          // An error is logged, and seen by the client as an archive without a directory.
          static_cast<void>(pictures.write_archive(
              jobs_with_picture, first, format,
              [&writer](std::string_view piece) { return writer.write(piece); }));
        });
  }
  response.headers.set("Content-Disposition",
                       "attachment; filename=\"batch-" + id_of(request).substr(0, 8) + ".zip\"");
  return response;
}

Response sheet(const RouteContext& context, Request& request,
               const api::BatchPicturesQuery& query) {
  const auto jobs = context.batches.jobs(id_of(request), request.access);
  if (!jobs) {
    return error_answer(request, jobs.error());
  }
  const core::ImageFormat& png = format_of("png");
  auto made = BatchPictures(context, query.look).sheet(*jobs, png);
  if (!made) {
    return error_answer(request, made.error());
  }
  Response response =
      bytes_response(200, png.mime, std::make_shared<const std::string>(*std::move(made)));
  response.headers.set("Cache-Control", "no-cache");
  return ranged(request, std::move(response));
}

}  // namespace

void add_batch_handlers(HandlerTable& table) {
  const auto archive_query = [](api::QueryParams query) {
    return api::parse_archive_query(std::move(query), tone_map_names());
  };
  const auto sheet_query = [](api::QueryParams query) {
    return api::parse_sheet_query(std::move(query), tone_map_names());
  };
  table["createBatch"] = {
      .handler = &create_batch,
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
  table["listBatches"] = {.handler = with_query(&api::parse_batch_list_query, &list_batches)};
  table["getBatch"] = {.handler = &get_batch};
  table["cancelBatch"] = {.handler = [](const RouteContext& context, Request& request) {
    return changed(context, request, 200, &BatchService::cancel);
  }};
  table["retryBatch"] = {.handler = [](const RouteContext& context, Request& request) {
    return changed(context, request, 202, &BatchService::retry);
  }};
  table["deleteBatch"] = {.handler = &remove_batch};
  table["getBatchArchive"] = {.handler = with_query(archive_query, &archive)};
  table["getBatchSheet"] = {.handler = with_query(sheet_query, &sheet)};
}

}  // namespace server
