#include "server/routes/render_drake.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <shared_mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/json/errors.h"
#include "api/json/limits.h"
#include "api/queries/drake_form.h"
#include "core/base/sha256.h"
#include "core/image_io/image_io.h"
#include "core/scene_io/split_gltf.h"
#include "server/http/form_data.h"
#include "server/http/text.h"
#include "server/routes/answers.h"
#include "server/routes/picture_answer.h"
#include "server/routes/render_order.h"
#include "server/routes/scene_upload.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

struct SentDrake {
  MemoryGate::Lease lease;  ///< of the body, then of the scene's parts
  api::DrakeForm form;
  core::SplitGltf scene;
};

/// The protocol has 16 fields; forms of its later versions may have more.
constexpr std::size_t kParts = 64;

api::Parsed<SentDrake> read_drake_form(const RouteContext& context, const Request& request) {
  const auto refused = [](std::string pointer, std::string detail) {
    return api::from_error(
        Error{ErrorCode::kInvalidArgument, std::move(detail), std::move(pointer)});
  };
  const std::string content_type(request.header("Content-Type").value_or(""));
  if (media_type(content_type) != "multipart/form-data") {
    return api::from_error(
        Error{ErrorCode::kUnsupportedFormat, "expected a form (multipart/form-data)", ""});
  }
  auto upload = read_body(context, request);
  if (!upload) {
    return api::from_error(upload.error());
  }
  const std::string_view body(reinterpret_cast<const char*>(upload->content.data()),
                              upload->content.size());
  const auto parts = parse_form_data(body, content_type, kParts);
  if (!parts) {
    return api::from_error(parts.error());
  }
  std::vector<std::pair<std::string, std::string>> fields;
  std::optional<std::string_view> scene;
  for (const FormPart& part : *parts) {
    if (part.name == "scene") {
      scene = part.content(body);
    } else {
      // Longer texts are none of the protocol's.
      fields.emplace_back(part.name, part.content(body).substr(0, 1024));
    }
  }
  auto form = api::parse_drake_form(fields);
  if (!form) {
    return form.problem();
  }
  if (!scene) {
    return refused("/scene", "is required: a glTF file");
  }
  if (core::sha256_hex(scene->data(), scene->size()) != form->scene_sha256) {
    return refused("/scene_sha256", "the scene has another hash: it was cut or changed on its way");
  }
  // Its parts together are no longer than the text; to join them takes as much again.
  if (auto room = upload->lease.grow(2 * scene->size()); !room) {
    return api::from_error(room.error());
  }
  auto split = core::split_gltf(*scene, /*turns_z_up=*/true);
  if (!split) {
    return api::from_error(split.error());
  }
  return SentDrake{
      .lease = std::move(upload->lease), .form = *std::move(form), .scene = *std::move(split)};
}

/// Returns an image of values in [0, 1] (PNG) or of any (TIFF).
Response image_answer(const Request& request, core::FloatImage image, std::string_view extension) {
  const core::ImageFormat& format = *choose_format(request, extension);
  core::EncodeOptions options;
  options.is_color = false;
  const auto bytes = core::encode_image(image, format, options);
  if (!bytes) {
    return error_answer(request, bytes.error());
  }
  return bytes_response(200, format.mime,
                        std::make_shared<const std::string>(
                            reinterpret_cast<const char*>(bytes->data()), bytes->size()));
}

core::FloatImage depth_image(const api::DrakeForm& form,
                             const std::vector<core::FirstSurface>& surfaces) {
  core::FloatImage image{form.width, form.height, {"Z"}, {}};
  image.values.reserve(surfaces.size());
  for (const core::FirstSurface& seen : surfaces) {
    // ImageTraits<PixelType::kDepth32F>: kTooFar is infinite, kTooClose is 0.
    const double depth = seen.depth_m >= *form.max_depth   ? std::numeric_limits<double>::infinity()
                         : seen.depth_m <= *form.min_depth ? 0
                                                           : seen.depth_m;
    image.values.push_back(static_cast<float>(depth));
  }
  return image;
}

/// Drake's scenes have the labels as colours of their materials, not to be converted.
core::FloatImage label_image(const api::DrakeForm& form,
                             const SceneService::VisibleSurfaces& seen) {
  core::FloatImage image{form.width, form.height, {"R", "G", "B"}, {}};
  image.values.reserve(3 * seen.surfaces.size());
  for (const core::FirstSurface& surface : seen.surfaces) {
    const core::Rgb color = surface.material < 0
                                ? core::Rgb(1)
                                : seen.base_colors[static_cast<std::size_t>(surface.material)];
    image.values.insert(image.values.end(), {color.r, color.g, color.b});
  }
  return image;
}

Response look(const RouteContext& context, const Request& request, const SentDrake& sent) {
  const api::DrakeForm& form = sent.form;
  core::CameraSettings camera;
  camera.type = core::CameraType::kPinhole;
  camera.index = 0;
  camera.fx_px = form.focal_x;
  camera.fy_px = form.focal_y;
  camera.cx_px = form.center_x;
  camera.cy_px = form.center_y;
  core::FilmSettings film;
  film.width = form.width;
  film.height = form.height;
  const auto seen = context.scenes.first_surfaces(
      sent.scene, camera, film, {.access = request.access, .stop = request.stop_token()});
  if (!seen) {
    return error_answer(request, seen.error());
  }
  return form.image_type == "depth"
             ? image_answer(request, depth_image(form, seen->surfaces), "tif")
             : image_answer(request, label_image(form, *seen), "png");
}

/// Data sets have more images than a disk has room for their films. What another request uses
/// stays.
void forget(const RouteContext& context, const Request& request, const Rendered& rendered,
            const std::string& scene) {
  if (rendered.job) {
    static_cast<void>(context.jobs.remove(rendered.job));
  }
  const std::unique_lock<std::shared_mutex> naming(context.scenes.names_mutex());
  static_cast<void>(
      context.scenes.remove(scene, request.access, [&](const std::optional<std::string>& tenant) {
        return context.jobs.index().needs_scene(scene, tenant);
      }));
}

Response render_color(const RouteContext& context, WaitingClients& clients, Request& request,
                      api::RenderQuery query, SentDrake sent) {
  RenderOrder order{.query = std::move(query), .job = api::drake_job(sent.form), .is_once = true};
  order.query.format = "png";
  order.query.size.reset();
  if (order.query.preset.empty()) {
    order.query.preset = "tent";  // The camera may be anywhere.
  }
  if (auto refused = check_order(request, order)) {
    return *std::move(refused);
  }
  if (auto refused = find_preset(context, request, order)) {
    return *std::move(refused);
  }
  sent.scene = core::join_buffers(std::move(sent.scene));
  std::vector<SceneService::SideFile> sides;
  for (const auto& [name, bytes] : sent.scene.files) {
    sides.push_back(
        {.name = name, .content = {reinterpret_cast<const char*>(bytes->data()), bytes->size()}});
  }
  const auto added = context.scenes.add_with_sides(
      {std::move(sent.scene.document), std::move(sent.lease)}, sides,
      {.access = request.access, .name = "Drake", .stop = request.stop_token()});
  if (auto refused = refused_scene(request, added)) {
    return *std::move(refused);
  }
  order.uploads.scene = added->id;
  Rendered rendered = render_order(context, clients, request, std::move(order));
  forget(context, request, rendered, added->id);
  rendered.response.headers.remove("Location");
  return std::move(rendered.response);
}

}  // namespace

Response render_drake(const RouteContext& context, WaitingClients& clients, Request& request) {
  // Also of depths and labels, so that a client finds a misspelt one with its first image.
  auto query = api::parse_render_query(request.query_params, tone_map_names());
  if (!query) {
    return problem_answer(request, query.problem());
  }
  auto sent = read_drake_form(context, request);
  if (!sent) {
    return problem_answer(request, sent.problem());
  }
  return sent->form.image_type == "color"
             ? render_color(context, clients, request, *std::move(query), *std::move(sent))
             : look(context, request, *sent);
}

}  // namespace server
