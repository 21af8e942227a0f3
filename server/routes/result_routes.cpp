// Results of a job: image, pixels, convergence.

#include <algorithm>
#include <chrono>
#include <string>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/error_codes.h"
#include "api/requests.h"
#include "core/error/pixel_error.h"
#include "core/image_io/image_io.h"
#include "core/layers/exposure.h"
#include "server/http/file_response.h"
#include "server/http/text.h"
#include "server/pictures/denoised_facts.h"
#include "server/pictures/image_look.h"
#include "server/pictures/objects.h"
#include "server/pictures/picture.h"
#include "server/pictures/pixel_view.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/routes/picture_answer.h"
#include "server/routes/with_query.h"

namespace server {
namespace {

using core::ErrorCode;

constexpr std::string_view kMultipart = "multipart/x-mixed-replace";
constexpr std::string_view kBoundary = "tessera-picture";
/// Interval between the images of a stream, and the inverse of the largest share of a thread's time
/// spent on them.
constexpr std::chrono::milliseconds kPicturePace{500};
constexpr int kPictureShare = 5;

bool wants_stream(const Request& request, const api::ImageQuery& query) {
  if (query.stream) {
    return true;
  }
  const auto accept = request.headers.joined("Accept").value_or("");
  const auto types = split_list(accept);
  const auto names = [&types](const auto& fits) {
    return std::any_of(types.begin(), types.end(),
                       [&](std::string_view type) { return fits(media_type(type)); });
  };
  // Generated clients accept all types that the operation documents, and expect one image.
  return names([](const std::string& type) { return type == kMultipart; }) &&
         !names([](const std::string& type) { return type.starts_with("image/"); });
}

std::string exposure_line(std::optional<float> stops) {
  return stops ? "\r\nX-Tessera-Exposure: " + core::exposure_text(static_cast<double>(*stops)) : "";
}

/// Sends one image after another until the job has ended, in the form that browsers show in an
/// <img>.
class PictureStream {
 public:
  PictureStream(const RouteContext& context, JobPointer job, const core::ImageFormat& format,
                api::ImageQuery query)
      : jobs_(context.jobs),
        denoising_(context.denoising),
        maker_(context.memory, context.about),
        job_(std::move(job)),
        format_(format),
        query_(std::move(query)) {}

  void run(StreamWriter& writer) {
    using Clock = std::chrono::steady_clock;
    bool alive = writer.write(delimiter());
    while (alive && !writer.client_gone() && !writer.stopping()) {
      // In this order, events after this number are seen in the next pass.
      const std::uint64_t seq = job_->log().last_seq();
      const bool is_final = job_->is_at_rest();
      const auto begin = Clock::now();
      alive = send_if_new(writer, is_final);
      if (is_final && !may_come_) {
        writer.write("--\r\n");
        return;
      }
      const auto pace =
          std::max<Clock::duration>(kPicturePace, (Clock::now() - begin) * kPictureShare);
      job_->log().wait_after(job_->log().last_seq(), EventLog::Wake::kDurable, Clock::now() + pace,
                             writer.stop_token());
      job_->log().wait_after(seq, EventLog::Wake::kAnything, Clock::now() + kPicturePace,
                             writer.stop_token());
    }
  }

 private:
  static std::string delimiter() { return "--" + std::string(kBoundary); }

  bool send_if_new(StreamWriter& writer, bool is_final) {
    const auto film = jobs_.films().film(*job_);
    may_come_ = !film && film.error().code == ErrorCode::kUnavailable;
    if (!film || (*film)->revision() == sent_) {
      return true;
    }
    DenoiseService::Pointer denoised;
    if (wants_denoised(query_)) {
      auto made = denoising_.get(job_, **film, {query_.denoise}, MemoryGate::kPatience);
      if (!made) {
        return !is_final;
      }
      denoised = *std::move(made);
    }
    const std::uint32_t revision = denoised ? denoised->view.revision : (*film)->revision();
    if (revision == sent_) {
      return true;
    }
    const api::JobView view = jobs_.view(*job_);
    const Picture picture{.format = format_,
                          .query = query_,
                          .view = view,
                          .rect = query_.rect.value_or((*film)->crop()),
                          .denoised = planes_of(denoised),
                          .denoised_view = view_of(denoised, view),
                          .scene = scene_for_names(jobs_, *job_, format_),
                          .tenant = job_->tenant()};
    // Only the last image waits for memory; others are retried in the next pass.
    const auto encoded = maker_.make(
        **film, picture, is_final ? MemoryGate::kPatience : std::chrono::milliseconds(0));
    if (!encoded) {
      return encoded.error().code == ErrorCode::kUnavailable && !is_final;
    }
    sent_ = revision;
    const std::string head = "\r\nContent-Type: " + std::string(format_.mime) +
                             "\r\nContent-Length: " + std::to_string(encoded->content->size()) +
                             "\r\nX-Tessera-Revision: " + std::to_string(revision) +
                             exposure_line(encoded->exposure_stops) + "\r\n\r\n";
    // Sends the next delimiter at once: browsers show an image when they have received it.
    return writer.write(head) && writer.write(*encoded->content) &&
           writer.write("\r\n" + delimiter());
  }

  JobService& jobs_;
  DenoiseService& denoising_;
  const PictureMaker maker_;
  const JobPointer job_;
  const core::ImageFormat& format_;
  const api::ImageQuery query_;
  std::uint32_t sent_ = 0;
  bool may_come_ = false;  ///< The film could not be read now; it is asked for again.
};

Response stream_pictures(const RouteContext& context, const Request& request, const JobPointer& job,
                         const api::ImageQuery& query) {
  const core::ImageFormat* format = choose_format(request, request.path_param("format"));
  for (const core::ImageFormat& each : core::image_formats()) {
    if (request.path_param("format").empty() && each.extension == "jpg") {
      format = &each;  // Accept describes the multipart response, not its parts.
    }
  }
  if (format == nullptr) {
    return error_answer(request, unknown_format());
  }
  if (const auto refused = refused_look(*format, query)) {
    return error_answer(request, *refused);
  }
  const core::PixelRect crop = job->record().view.spec.render.film.area();
  if (const auto refused = refused_part(query.rect.value_or(crop), crop)) {
    return error_answer(request, *refused);
  }
  if (const auto there = context.jobs.films().film(*job);
      !there && there.error().code == api::kGone) {
    return error_answer(request, there.error());
  }
  auto stream = std::make_shared<PictureStream>(context, job, *format, query);
  std::string type(kMultipart);
  type.append("; boundary=").append(kBoundary);
  return stream_response(std::move(type), [stream](StreamWriter& writer) { stream->run(writer); });
}

Response image(const RouteContext& context, Request& request, const JobPointer& job,
               const api::ImageQuery& query) {
  const core::ImageFormat* format = choose_format(request, request.path_param("format"));
  if (wants_stream(request, query)) {
    return stream_pictures(context, request, job, query);
  }
  if (format == nullptr) {
    return error_answer(request, unknown_format());
  }
  if (const auto refused = refused_look(*format, query)) {
    return error_answer(request, *refused);
  }
  Response response = picture_answer(context, request, job, *format, query);
  if (response.status != 200) {
    return response;
  }
  return ranged(request, std::move(response));
}

Response pixel(const RouteContext& context, Request& request, const JobPointer& job) {
  const auto film = context.jobs.films().film(*job);
  if (!film) {
    return error_answer(request, film.error());
  }
  const core::PixelRect crop = (*film)->crop();
  const auto column = parse_decimal(request.path_param("x"));
  const auto row = parse_decimal(request.path_param("y"));
  const auto inside = [](const std::optional<std::uint64_t>& value, int first, int count) {
    return value && *value >= static_cast<std::uint64_t>(first) &&
           *value < static_cast<std::uint64_t>(first) + static_cast<std::uint64_t>(count);
  };
  if (!inside(column, crop.x, crop.width) || !inside(row, crop.y, crop.height)) {
    return error_answer(request, ErrorCode::kNotFound,
                        "no such pixel; the film has x from " + std::to_string(crop.x) + " to " +
                            std::to_string(crop.x + crop.width - 1) + " and y from " +
                            std::to_string(crop.y) + " to " +
                            std::to_string(crop.y + crop.height - 1));
  }
  const int x = static_cast<int>(*column);
  const int y = static_cast<int>(*row);
  core::PixelRect window;
  window.x = std::max(crop.x, x - core::kErrorWindow);
  window.y = std::max(crop.y, y - core::kErrorWindow);
  window.width = std::min(crop.x + crop.width, x + core::kErrorWindow + 1) - window.x;
  window.height = std::min(crop.y + crop.height, y + core::kErrorWindow + 1) - window.y;
  return json_response(
      200, api::pixel_json(pixel_view((*film)->snapshot(window), job->record().view.spec, x, y)));
}

Response convergence(const RouteContext& context, Request& /*request*/, const JobPointer& job) {
  auto points = context.jobs.films().points(*job);
  const core::RenderSettings render = job->record().view.spec.render;
  for (core::ConvergencePoint& point : points) {
    if (!core::error_is_valid(point.error, render)) {
      point.error = core::unknown_error();
    }
  }
  return json_response(200, api::convergence_json(points));
}

Response job_objects(const RouteContext& context, ObjectsMaker& maker, Request& request,
                     const JobPointer& job) {
  const auto film = context.jobs.films().film(*job);
  if (!film) {
    return error_answer(request, film.error());
  }
  const auto view = context.jobs.scene_view(*job);
  if (!view) {
    return error_answer(request, view.error());
  }
  const auto made = maker.make(**film, *view, job->record().view.spec);
  return made ? json_response(200, api::objects_json(*made)) : error_answer(request, made.error());
}

}  // namespace

void add_result_handlers(HandlerTable& table) {
  const auto image_query = [](api::QueryParams query) {
    return api::parse_image_query(std::move(query), tone_map_names());
  };
  table["getImage"] = {.handler = with_query(image_query, &image, Needs::kImage)};
  table["getPixel"] = {.of_job = &pixel, .needs = Needs::kImage};
  table["getObjects"] = {
      .of_job = [maker = std::make_shared<ObjectsMaker>()](
                    const RouteContext& context, Request& request,
                    const JobPointer& job) { return job_objects(context, *maker, request, job); },
      .needs = Needs::kImage};
  table["getConvergence"] = {.of_job = &convergence};
}

}  // namespace server
