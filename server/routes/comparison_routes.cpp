// Comparisons of two jobs, or of a job and an image.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "api/answers/job_view.h"
#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/requests.h"
#include "core/compare/comparison.h"
#include "core/film/film.h"
#include "core/image_io/image_io.h"
#include "core/integrators/registry.h"
#include "server/http/conditional.h"
#include "server/http/file_response.h"
#include "server/observe/clock.h"
#include "server/observe/turns.h"
#include "server/routes/answers.h"
#include "server/routes/context.h"
#include "server/store/comparison_store.h"
#include "server/store/uuid.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

/// Ends of the maps' scales.
constexpr float kZScale = 5;

Error too_many_pixels(int width, int height) {
  return Error{ErrorCode::kTooLarge,
               "an image of " + std::to_string(width) + " by " + std::to_string(height) +
                   " pixels; " + std::to_string(api::limits::kComparisonPixels) +
                   " can be compared",
               ""};
}

bool is_too_large(int width, int height) {
  return std::int64_t{width} * height > api::limits::kComparisonPixels;
}

/// Memory per pixel of each side: the picture, the copy of the film or file that it is made from,
/// tables of sums, and half of the maps. Measured by tests/stress/memory --measure: 84.
constexpr std::uint64_t kSideBytes = 100;

core::Status take_side(MemoryGate::Lease& lease, int width, int height) {
  if (is_too_large(width, height)) {
    return too_many_pixels(width, height);
  }
  return lease.grow(static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) *
                    kSideBytes);
}

struct Side {
  std::string id;
  api::DenoiseShow denoise = api::DenoiseShow::kOff;
  const char* where;
};

core::Result<core::Picture> picture_of_job(const RouteContext& context, const Side& side,
                                           const Request& request, MemoryGate::Lease& lease) {
  const auto job = context.jobs.find(side.id, request.access);
  if (!job) {
    return job.error();
  }
  if (!(*job)->record().view.spec.has_image) {
    return Error{ErrorCode::kConflict, "the job renders no image: its film is null", ""};
  }
  const auto film = context.jobs.films().final_film(**job, request.stop_token());
  if (!film) {
    return film.error();
  }
  const core::PixelRect crop = (*film)->crop();
  if (auto room = take_side(lease, crop.width, crop.height); !room) {
    return room.error();
  }
  if ((*film)->sample_counts().min == 0) {
    return Error{ErrorCode::kConflict, "the job ended before every pixel had a sample", ""};
  }
  if (side.denoise != api::DenoiseShow::kOff) {
    const auto made = context.denoising.get(*job, **film, {side.denoise}, MemoryGate::kPatience);
    if (!made) {
      return made.error();
    }
    const auto mode =
        api::is_full(side.denoise) ? core::DenoiseMode::kFull : core::DenoiseMode::kMixed;
    return core::picture_of((*made)->picture.planes(mode), crop.width, crop.height);
  }
  core::Picture picture = core::picture_of((*film)->snapshot());
  if (!core::halves_show_error((*job)->record().view.spec.render)) {
    picture.half_difference.clear();  // The halves are dependent: no valid error.
  }
  return picture;
}

core::Result<core::Picture> picture_of_asset(const RouteContext& context, const std::string& id,
                                             const Request& request, MemoryGate::Lease& lease) {
  const auto bytes = context.assets.find(id, request.access);
  if (auto room = bytes ? lease.grow(*bytes) : core::Status(bytes.error()); !room) {
    return room.error();
  }
  const auto content = context.assets.read(id, request.access);
  if (!content) {
    return content.error();
  }
  const auto header = core::read_image_header(**content);
  if (!header) {
    return header.error();
  }
  if (auto room = take_side(lease, header->width, header->height); !room) {
    return room.error();
  }
  const auto image = core::decode_image(**content, {});
  if (!image) {
    return image.error();
  }
  return core::picture_of(*image);
}

core::Result<core::Picture> find_picture(const RouteContext& context, const Side& side,
                                         const Request& request, MemoryGate::Lease& lease) {
  auto picture = api::is_uuid(side.id) ? picture_of_job(context, side, request, lease)
                                       : picture_of_asset(context, side.id, request, lease);
  if (!picture) {
    Error error = picture.error();
    error.where = error.code == ErrorCode::kUnavailable ? "" : side.where;
    return error;
  }
  return picture;
}

template <typename Color>
core::Result<std::string> png(int width, int height, const Color& color) {
  const auto columns = static_cast<std::size_t>(width);
  const core::ImageRows image = {
      width,
      height,
      {"R", "G", "B"},
      [&color, columns, row = std::vector<float>(3 * columns)](int y) mutable {
        for (std::size_t x = 0; x < columns; ++x) {
          const core::Rgb c = color(static_cast<std::size_t>(y) * columns + x);
          std::copy_n(std::array{c.r, c.g, c.b}.begin(), 3, &row[3 * x]);
        }
        return static_cast<const float*>(row.data());
      }};
  core::EncodeOptions options;
  options.is_color = false;  // Already display values.
  return core::encode_rows(image, core::image_formats().front(), options);
}

core::Result<ComparisonMaps> make_maps(const core::Comparison& result,
                                       const core::Picture& reference) {
  // Relative as in relmse, but signed; the square root maps one part in a hundred to a tenth of the
  // scale.
  const auto difference = [&](std::size_t i) {
    const float y = core::luminance(reference.values[i]);
    const float relative = core::luminance(result.difference[i]) / std::sqrt(y * y + 0.01F);
    return core::signed_color(std::copysign(std::sqrt(std::abs(relative)), relative));
  };
  const auto z = [&](std::size_t i) { return core::signed_color(result.z[i] / kZScale); };
  const auto flip = [&](std::size_t i) { return core::heat_color(result.flip_map[i]); };
  ComparisonMaps maps;
  const auto add = [&](const char* name, core::Result<std::string> content) -> core::Status {
    if (!content) {
      return content.error();
    }
    maps[name] = std::move(*content);
    return core::ok_status();
  };
  const int width = reference.width;
  const int height = reference.height;
  for (const auto& status :
       {add("difference.png", png(width, height, difference)), add("z.png", png(width, height, z)),
        add("flip.png", png(width, height, flip))}) {
    if (!status) {
      return status.error();
    }
  }
  return maps;
}

/// Refuses a comparison that does not fit into an idle server: both sides, and the film that one of
/// them is made from.
core::Status check_memory(const RouteContext& context, const std::vector<std::string>& sides,
                          const Request& request) {
  std::uint64_t pictures = 0;
  std::uint64_t film = 0;
  for (const std::string& id : sides) {
    const auto job = job_or_asset(context.jobs, id, request.access);
    if (!job || !*job) {
      continue;  // find_picture() reports the error; files are measured when they are read.
    }
    const core::RenderSettings render = (*job)->record().view.spec.render;
    const core::FilmShape shape = core::film_shape(render);
    const core::PixelRect crop = shape.crop();
    pictures += static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height) *
                kSideBytes;
    film = std::max<std::uint64_t>(film, shape.bytes());
  }
  return context.memory.check(pictures + film, "the comparison");
}

Response create_comparison(const RouteContext& context, Turns& turns, Request& request) {
  const auto parsed = api::parse_comparison(request.body);
  if (!parsed) {
    return problem_answer(request, parsed.problem());
  }
  if (!api::is_uuid(parsed->a) && !api::is_uuid(parsed->b)) {
    return error_answer(request,
                        Error{ErrorCode::kInvalidArgument, "one of the two must be a job", "/a"});
  }
  if (const core::Status fits = check_memory(context, {parsed->a, parsed->b}, request); !fits) {
    return error_answer(request, fits.error());
  }
  const auto held = turns.take(request.access.tenant, request.stop_token());
  if (!held) {
    return error_answer(request, held.error());
  }
  auto lease = context.memory.take({.tenant = request.access.tenant}, "the comparison");
  if (!lease) {
    return error_answer(request, lease.error());
  }
  const auto a = find_picture(context, {parsed->a, parsed->a_denoise, "/a"}, request, *lease);
  if (!a) {
    return error_answer(request, a.error());
  }
  const auto b = find_picture(context, {parsed->b, parsed->b_denoise, "/b"}, request, *lease);
  if (!b) {
    return error_answer(request, b.error());
  }
  const auto result = core::compare_pictures(*a, *b);
  if (!result) {
    return error_answer(request, result.error());
  }
  const auto maps = make_maps(*result, *b);
  if (!maps) {
    return error_answer(request, maps.error());
  }
  const api::ComparisonView view = {.id = make_uuid(),
                                    .a = parsed->a,
                                    .b = parsed->b,
                                    .mse = result->mse,
                                    .relmse = result->relmse,
                                    .flip = result->flip,
                                    .bias = result->bias,
                                    .bias_low = result->bias_low,
                                    .bias_high = result->bias_high,
                                    .z_mean = result->z_mean,
                                    .z_variance = result->z_variance,
                                    .z_share_above_3 = result->z_share_above_3};
  const std::string body = api::comparison_json(view);
  const ComparisonStore::Row row = {
      .id = view.id, .body = body, .tenant = request.access.tenant, .created_at = unix_now()};
  if (const auto stored = context.comparisons.insert(row, *maps); !stored) {
    return error_answer(request, stored.error());
  }
  Response response = json_response(201, body);
  response.headers.set("Location", "/v1/comparisons/" + view.id);
  return response;
}

Response get_comparison(const RouteContext& context, Request& request) {
  auto body = context.comparisons.find(request.path_param("id"), request.access);
  return body ? json_response(200, std::move(*body)) : error_answer(request, body.error());
}

Response map(const RouteContext& context, Request& request) {
  const std::string id(request.path_param("id"));
  const std::string name(request.path_param("map"));
  if (const auto body = context.comparisons.find(id, request.access); !body) {
    return error_answer(request, body.error());
  }
  if (name != "difference.png" && name != "z.png" && name != "flip.png") {
    return error_answer(request, ErrorCode::kNotFound,
                        "the maps are difference.png, z.png and flip.png");
  }
  auto file = context.comparisons.open_map(id, name);
  const auto bytes =
      file ? file_bytes(file->get(), name) : core::Result<std::uint64_t>(file.error());
  if (!bytes) {
    return error_answer(request, bytes.error());
  }
  return file_response(request, FileBody(file->release(), 0, *bytes),
                       FileSource{.path = {},
                                  .content_type = "image/png",
                                  .etag = make_etag(id + "-" + name),
                                  .cache_control = "private, max-age=31536000, immutable"});
}

}  // namespace

void add_comparison_handlers(HandlerTable& table) {
  const auto turns = std::make_shared<Turns>(1);
  table["createComparison"] = {
      .handler = [turns](const RouteContext& context,
                         Request& request) { return create_comparison(context, *turns, request); },
      .body = BodyPolicy::json(static_cast<std::uint64_t>(api::limits::kBodyBytes))};
  table["getComparison"] = {.handler = &get_comparison};
  table["getComparisonMap"] = {.handler = &map};
}

}  // namespace server
