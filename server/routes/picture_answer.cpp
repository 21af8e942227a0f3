#include "server/routes/picture_answer.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <limits>
#include <utility>

#include "api/answers/job_view.h"
#include "api/json/error_codes.h"
#include "api/json/values.h"
#include "core/base/build_id.h"
#include "core/base/sha256.h"
#include "core/error/pixel_error.h"
#include "core/layers/exposure.h"
#include "server/http/conditional.h"
#include "server/http/negotiation.h"
#include "server/pictures/denoised_facts.h"
#include "server/pictures/image_look.h"
#include "server/pictures/picture.h"
#include "server/routes/answers.h"
#include "server/routes/first_image_file.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

/// Prints a share, such as "0.21%".
std::string percent_text(double share) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.2f%%", 100 * share);
  return text.data();
}

std::string picture_etag(const api::JobView& view, const core::ImageFormat& format,
                         const api::ImageQuery& query, const std::string& revision) {
  const std::string text =
      view.id + "." + std::string(format.extension) + "?" + api::image_key(query);
  // Includes the state, since a finished image carries its digest.
  return make_etag("r" + revision + "-" + std::string(api::to_text(view.state)) + "-" +
                   core::sha256_hex(text.data(), text.size()).substr(0, 16));
}

core::Result<EncodedPicture> stored_look(const RouteContext& context, const Job& job,
                                         const std::string& key) {
  auto look = read_first_image(context.data.first_images_path(job.id()), key);
  if (!look && look.error().code != ErrorCode::kNotFound) {
    context.log.write(LogLevel::kWarning, "look_damaged",
                      {{"job", job.id()}, {"detail", look.error().message}});
  }
  return look;
}

/// Returns the image of an ended job that is kept under the job and `key`, or stored, or encodes
/// it, and keeps it. Errors: of encode and of the film.
template <typename Encode>
core::Result<EncodedPicture> kept_picture(const RouteContext& context, const Job& job,
                                          const std::string& key, const std::string& tenant,
                                          const Encode& encode) {
  using Made = SingleFlightCache<EncodedPicture>::Made;
  const auto kept = context.pictures.get(job.id() + key, [&]() -> core::Result<Made> {
    core::Result<EncodedPicture> made = stored_look(context, job, key);
    if (!made) {
      const auto film = context.jobs.films().film(job);
      made = film ? encode(**film) : film.error();
    }
    if (!made) {
      return made.error();
    }
    const std::uint64_t bytes = made->content->size();
    made->content = with_lease(
        std::make_shared<const std::string>(*made->content),
        context.memory.note({.bytes = bytes, .tenant = tenant}, MemoryGate::Kind::kIdle));
    return Made{std::make_shared<const EncodedPicture>(*std::move(made)), bytes};
  });
  if (!kept) {
    return kept.error();
  }
  return **kept;
}

}  // namespace

std::string kept_key(const api::JobView& view, std::string_view etag) {
  // Stored images are not those of another build, whose encoders and curves may differ.
  static const std::string build = core::linker_build_id();
  return view.film_digest + std::string(etag) + build;
}

std::vector<std::string> tone_map_names() {
  std::vector<std::string> names;
  for (const core::ToneMapEntry& entry : core::tone_maps()) {
    names.emplace_back(entry.name);
  }
  return names;
}

const core::ImageFormat* choose_format(const Request& request, std::string_view extension) {
  const auto formats = core::image_formats();
  if (!extension.empty()) {
    const auto found = std::find_if(formats.begin(), formats.end(), [&](const auto& format) {
      return format.extension == extension || (extension == "jpeg" && format.extension == "jpg") ||
             (extension == "tiff" && format.extension == "tif");
    });
    return found == formats.end() ? nullptr : &*found;
  }
  std::vector<std::string_view> offers;
  for (const core::ImageFormat& format : formats) {
    offers.push_back(format.mime);
  }
  const auto chosen = negotiate_media_type(request.headers.joined("Accept").value_or(""), offers);
  return chosen ? &formats[*chosen] : nullptr;
}

Error unknown_format() {
  std::string list;
  for (const core::ImageFormat& format : core::image_formats()) {
    list += (list.empty() ? "" : ", ") + std::string(format.mime) + " (." +
            std::string(format.extension) + ")";
  }
  return Error{api::kNotAcceptable, "images come as " + list, ""};
}

std::shared_ptr<const core::DenoisedPicture> planes_of(const DenoiseService::Pointer& made) {
  return made ? std::shared_ptr<const core::DenoisedPicture>(made, &made->picture) : nullptr;
}
std::optional<api::DenoisedView> view_of(const DenoiseService::Pointer& made,
                                         const api::JobView& job) {
  return made ? std::optional(api::promised(made->view, job)) : std::nullopt;
}

std::shared_ptr<const core::Scene> scene_for_names(const JobService& jobs, const Job& job,
                                                   const core::ImageFormat& format) {
  if (!wants_names(format, job.record().view.spec.render.film)) {
    return nullptr;
  }
  const auto view = jobs.scene_view(job);
  return view ? view->scene : nullptr;
}

namespace {

/// The image follows the job's revision and the client's Accept.
Response validated(Response response, const std::string& etag) {
  response.headers.set("ETag", etag);
  response.headers.set("Cache-Control", "no-cache");
  response.headers.add("Vary", "Accept");
  return response;
}

void set_figures(const EncodedPicture& encoded, Headers& headers) {
  if (encoded.range) {
    headers.set("X-Tessera-Range", api::number_text(static_cast<double>(encoded.range->low)) + "," +
                                       api::number_text(static_cast<double>(encoded.range->high)));
  }
  if (encoded.set_aside) {
    headers.set("X-Tessera-Set-Aside", percent_text(*encoded.set_aside));
  }
  if (encoded.exposure_stops) {
    headers.set("X-Tessera-Exposure",
                core::exposure_text(static_cast<double>(*encoded.exposure_stops)));
  }
}

void set_error(const api::JobView& view, const std::optional<api::DenoisedView>& denoised,
               const api::ImageQuery& query, Headers& headers) {
  headers.set("X-Tessera-Bias", api::bias_of(view));
  core::ErrorInterval error = view.progress.error;
  if (!core::error_is_valid(error, view.spec.render)) {
    error.low = error.high = std::numeric_limits<double>::quiet_NaN();
  }
  if (const std::string text = error_text(error); !text.empty()) {
    headers.set("X-Tessera-Error", text);
  }
  if (denoised) {
    const DenoisedFacts facts = denoised_facts(*denoised, query);
    headers.set("X-Tessera-Denoiser", facts.denoiser);
    headers.set("X-Tessera-Bias", facts.bias);
    if (!facts.error.empty()) {
      headers.set("X-Tessera-Error", facts.error);
    }
  }
}

}  // namespace

Response picture_answer(const RouteContext& context, const Request& request, const JobPointer& job,
                        const core::ImageFormat& format, const api::ImageQuery& query) {
  const api::JobView view = context.jobs.view(*job);
  const core::PixelRect crop = view.spec.render.film.area();
  const core::PixelRect rect = query.rect.value_or(crop);
  if (const auto refused = refused_part(rect, crop)) {
    return error_answer(request, *refused);
  }
  // The plain image of an ended job never changes; its film is read only to encode it.
  const bool is_kept = !view.film_digest.empty() && !view.film_is_evicted && !wants_denoised(query);
  std::shared_ptr<const core::Film> film;
  DenoiseService::Pointer denoised;
  std::string version = std::to_string(view.progress.revision);
  std::uint32_t revision = view.progress.revision;
  if (!is_kept) {
    auto found = context.jobs.films().film(*job);
    if (!found) {
      return error_answer(request, found.error());
    }
    film = *std::move(found);
    if (wants_denoised(query)) {
      auto made =
          context.denoising.get(job, *film, {query.denoise, query.revision}, MemoryGate::kPatience);
      if (!made) {
        return error_answer(request, made.error());
      }
      denoised = *std::move(made);
    }
    revision = denoised ? denoised->view.revision : film->revision();
    version = denoised ? denoised->version : std::to_string(revision);
  }
  if (query.revision && *query.revision > revision) {
    return error_answer(request,
                        Error{ErrorCode::kConflict,
                              "revision " + std::to_string(*query.revision) +
                                  " does not exist yet; the newest is " + std::to_string(revision),
                              "/revision"});
  }
  const std::string etag = picture_etag(view, format, query, version);
  if (is_not_modified(request, etag)) {
    return validated(not_modified(etag), etag);
  }
  const std::optional<api::DenoisedView> denoised_view = view_of(denoised, view);
  const auto encode = [&](const core::Film& of) {
    const Picture picture{.format = format,
                          .query = query,
                          .view = view,
                          .rect = rect,
                          .denoised = planes_of(denoised),
                          .denoised_view = denoised_view,
                          .scene = scene_for_names(context.jobs, *job, format),
                          .tenant = request.access.tenant,
                          .auto_exposure = is_kept ? job->auto_exposure() : std::nullopt};
    return PictureMaker(context.memory, context.about).make(of, picture, MemoryGate::kPatience);
  };
  core::Result<EncodedPicture> encoded =
      is_kept ? kept_picture(context, *job, kept_key(view, etag), request.access.tenant, encode)
              : encode(*film);
  if (!encoded) {
    return error_answer(request, encoded.error());
  }
  Response response = validated(bytes_response(200, format.mime, encoded->content), etag);
  response.headers.set("X-Tessera-Revision", std::to_string(revision));
  set_figures(*encoded, response.headers);
  if (const std::string ignored = ignored_look(format, query); !ignored.empty()) {
    response.headers.set("X-Tessera-Ignored", ignored);
  }
  response.headers.set("X-Tessera-Samples", api::number_text(view.progress.samples_mean));
  set_error(view, denoised_view, query, response.headers);
  return response;
}

}  // namespace server
