#include "api/queries/render_query.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <nlohmann/json.hpp>

#include "api/answers/server_view.h"
#include "api/json/limits.h"
#include "api/json/query_rows.h"
#include "api/json/schemas.h"
#include "api/queries/look_rows.h"
#include "core/camera/framing.h"
#include "core/settings/choices.h"

namespace api {
namespace {

/// The query, with the look as its rows read it.
struct Reading : ImageReading {
  RenderQuery render;
};

void read_size(const std::string& text, Reading& out, const std::string& pointer, Faults& faults) {
  const std::size_t by = text.find('x');
  if (by == std::string::npos) {
    faults.add(pointer, shown(Json(text)) + " is not WIDTHxHEIGHT, such as 800x600");
    return;
  }
  const auto side = [&](std::string_view part) {
    return read_integer(number_in_query(std::string(part)), {1, limits::kFilmSide}, pointer,
                        faults);
  };
  const auto width = side(std::string_view(text).substr(0, by));
  const auto height = side(std::string_view(text).substr(by + 1));
  if (width && height) {
    out.render.size = {static_cast<int>(*width), static_cast<int>(*height)};
  }
}

// Reads a share, or a percentage with its sign.
void read_error(const std::string& text, Reading& out, const std::string& pointer, Faults& faults) {
  const bool is_percent = text.ends_with('%');
  const double unit = is_percent ? 100 : 1;
  const Json number = number_in_query(text.substr(0, text.size() - (is_percent ? 1 : 0)));
  if (!number.is_number()) {
    faults.add(pointer, shown(Json(text)) + " is not a share or a percentage, such as 0.03 or 3%");
    return;
  }
  if (const auto share =
          read_number(number_json(number.get<double>() / unit),
                      {limits::kRelativeErrorMin, limits::kRelativeErrorMax}, pointer, faults)) {
    out.render.relative_error = share;
  }
}

void read_format(const std::string& text, Reading& out, const std::string& pointer,
                 Faults& faults) {
  read_extension(text, out.render.format, pointer, faults);
}

const auto& render_table() {
  static constexpr auto kTable = std::tuple_cat(
      std::tuple{
          text(
              "scene", [](auto& s) -> auto& { return s.render.scene; },
              {1, limits::kNameCharacters},
              "Id of an uploaded scene or name of a built-in one, instead of an upload."),
          ParameterField<Reading>{"size", "Width and height in pixels: 800x600.", &read_size,
                                  [](const Reading&) {
                                    Json schema = text_schema();
                                    schema["pattern"] = "^[0-9]+x[0-9]+$";
                                    schema["example"] = "800x600";
                                    return schema;
                                  }},
          ParameterField<Reading>{
              "error",
              "Render until the relative error is at most this, as a share or a percentage: 0.03 "
              "or 3%. A percent sign after a digit at the end of a value need not be encoded. "
              "Without error, seconds, samples and a `stop` in the job: until 3%, at most 10 "
              "seconds.",
              &read_error,
              [](const Reading&) {
                Json schema = text_schema();
                schema["example"] = "3%";
                return schema;
              }},
          number(
              "seconds", [](auto& s) -> auto& { return s.render.seconds; },
              {0, limits::kStopSeconds, true}, "Render at most this many seconds."),
          number(
              "samples", [](auto& s) -> auto& { return s.render.samples; },
              {1, limits::kSamplesPerPixel}, "Render at most this many samples per pixel."),
          text(
              "preset", [](auto& s) -> auto& { return s.render.preset; },
              {1, limits::kNameCharacters},
              "Studio light instead of the scene's environment: studio, tent or rim; or the name "
              "of a stored preset, into which job and query are merged."),
          choice(
              "ground", [](auto& s) -> auto& { return s.render.ground; }, &core::grounds,
              "Ground under the model."),
          number(
              "theta", [](auto& s) -> auto& { return s.render.theta_degrees; },
              {-limits::kAngleDegrees, limits::kAngleDegrees},
              "Degrees that the camera is turned about the model, counter-clockwise seen from "
              "above; 0 is in front (+z)."),
          number(
              "phi", [](auto& s) -> auto& { return s.render.phi_degrees; },
              {0, limits::kPhiDegrees},
              "Degrees of the camera from above: 0 looks down, 90 is level."),
          text(
              "variant", [](auto& s) -> auto& { return s.render.variant; },
              {1, limits::kNameCharacters}, "Variant of the materials."),
          ParameterField<Reading>{"format", "Format of the image; by Accept if absent.",
                                  &read_format, [](const Reading&) { return extension_schema(); }},
          number(
              "wait", [](auto& s) -> auto& { return s.render.wait_seconds; },
              {0, limits::kWaitSeconds},
              "Seconds to wait for the image (at most --max-wait, 25 by default); then 202."),
      },
      look_rows());
  return kTable;
}

/// Returns the angle in [0, 360): one image has one job, also of a turntable that does not end.
double within_a_turn(double degrees) {
  const double rest = std::fmod(degrees, 360.0);
  const double turned = rest < 0 ? rest + 360 : rest;
  return turned < 360 ? turned : 0;
}

/// Returns the query as a merge patch of the job request.
Json patch_of(const RenderQuery& query, const RenderUploads& uploads) {
  Json patch = Json::object();
  if (query.size) {
    patch["film"] = {{"width", (*query.size)[0]}, {"height", (*query.size)[1]}};
  }
  if (query.relative_error) {
    patch["stop"]["relative_error"] = number_json(*query.relative_error);
  }
  if (query.seconds) {
    patch["stop"]["seconds"] = number_json(*query.seconds);
  }
  if (query.samples) {
    patch["stop"]["samples_per_pixel"] = *query.samples;
  }
  if (!query.preset.empty() && !names_stored_preset(query)) {
    patch["environment"]["preset"] = query.preset;
  }
  if (uploads.environment_asset) {
    patch["environment"]["asset"] = *uploads.environment_asset;
  }
  if (query.ground) {
    patch["ground"]["type"] = core::row_of(core::grounds(), *query.ground).name;
  }
  if (query.theta_degrees) {
    patch["camera"]["orbit"]["theta_degrees"] = number_json(within_a_turn(*query.theta_degrees));
  }
  if (query.phi_degrees) {
    patch["camera"]["orbit"]["phi_degrees"] = number_json(*query.phi_degrees);
  }
  if (query.variant) {
    patch["variant"] = *query.variant;
  }
  return patch;
}

}  // namespace

bool names_stored_preset(const RenderQuery& query) {
  const auto lights = core::environment_presets();
  return !query.preset.empty() &&
         std::none_of(lights.begin(), lights.end(),
                      [&query](const auto& light) { return light.name == query.preset; });
}

Parsed<RenderQuery> parse_render_query(QueryParams query, std::span<const std::string> tone_maps) {
  Reading reading;
  reading.tone_maps.assign(tone_maps.begin(), tone_maps.end());
  Faults faults;
  read_query(render_table(), query, reading, faults);
  if (!faults.empty()) {
    return faults.problem();
  }
  reading.render.look = std::move(reading.query);
  reading.render.has_exposure = std::any_of(
      query.begin(), query.end(), [](const auto& each) { return each.first == "exposure"; });
  return std::move(reading.render);
}

Parsed<ParsedJob> parse_render_job(std::string_view job, const RenderQuery& query,
                                   const RenderUploads& uploads) {
  Json request = Json::object();
  if (!job.empty()) {
    auto parsed = parse_json(job, static_cast<std::size_t>(limits::kBodyBytes));
    if (!parsed) {
      return parsed.problem();
    }
    request = *std::move(parsed);
    if (!request.is_object()) {
      return parse_job(job);  // which refuses it
    }
  }
  const auto refused = [](std::string why) {
    return make_problem(core::ErrorCode::kInvalidArgument, {{"/scene", std::move(why)}});
  };
  const int scenes = (uploads.scene.empty() ? 0 : 1) + (query.scene.empty() ? 0 : 1) +
                     (request.contains("scene") ? 1 : 0);
  if (scenes > 1) {
    return refused("is given more than once: upload a scene, or name one");
  }
  if (scenes == 0) {
    return refused(
        "is required: send a file as the body or as the part `scene` of a form, or name one");
  }
  if (!request.contains("scene")) {
    request["scene"] = uploads.scene.empty() ? query.scene : uploads.scene;
  }
  if (!uploads.preset_job.empty()) {
    Json from_preset = Json::parse(uploads.preset_job);
    from_preset.merge_patch(request);
    request = std::move(from_preset);
  }
  request.merge_patch(patch_of(query, uploads));
  if (!request.contains("stop")) {
    request["stop"] = {{"relative_error", kRenderError}, {"seconds", kRenderSeconds}};
  }
  return parse_job(dump(request));
}

void frame_model(JobSpec& spec, const core::SceneSummary& scene, bool is_turntable) {
  const core::CameraSettings& camera = spec.camera;
  const core::FilmSettings& film = spec.render.film;
  const bool has_camera =
      camera.is_placed() || camera.name || camera.index || !scene.cameras.empty();
  if (!spec.orbit && has_camera) {
    return;
  }
  core::CameraOrbit orbit = spec.orbit.value_or(core::CameraOrbit{});
  const bool is_automatic = !orbit.radius_m && !orbit.target && !camera.up;
  if (is_automatic && !scene.extremes.empty() &&
      camera.type.value_or(core::CameraType::kPerspective) == core::CameraType::kPerspective) {
    const auto frame = is_turntable ? core::turning_framing : core::nearest_framing;
    const core::Framing framing =
        frame(camera, orbit, scene.extremes, film.width, film.height, kRenderMargin);
    if (framing.distance_m > 0) {
      orbit.radius_m = framing.distance_m;
      orbit.target = scene.origin + framing.target;
      spec.orbit = orbit;
    }
  }
}

Json render_parameters(const Capabilities& capabilities) {
  Reading defaults;
  defaults.tone_maps = capabilities.tone_maps;
  return query_parameters(render_table(), defaults);
}

}  // namespace api
