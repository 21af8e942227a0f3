#include "clients/cli/job_flags.h"

#include <array>
#include <charconv>
#include <cmath>
#include <utility>

#include "api/json/limits.h"
#include "clients/cli/command.h"
#include "clients/cli/files.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;
namespace limits = api::limits;

std::optional<std::pair<int, int>> parse_size(const std::string& text) {
  const auto x = text.find_first_of("xX");
  if (x == std::string::npos) {
    return std::nullopt;
  }
  int width = 0;
  int height = 0;
  const char* begin = text.data();
  const char* end = begin + text.size();
  const auto first = std::from_chars(begin, begin + x, width);
  const auto second = std::from_chars(begin + x + 1, end, height);
  const bool good = first.ec == std::errc() && first.ptr == begin + x && second.ec == std::errc() &&
                    second.ptr == end;
  return good ? std::optional(std::pair(width, height)) : std::nullopt;
}

/// Returns empty if the text is a valid film size.
std::string fault_of_size(const std::string& text) {
  const auto size = parse_size(text);
  if (!size) {
    return '"' + text + "\" is not a size such as 960x540";
  }
  const auto [width, height] = *size;
  constexpr auto kSide = static_cast<int>(limits::kFilmSide);
  for (const int side : {width, height}) {
    if (side < 1 || side > kSide) {
      return std::to_string(side) + " is outside [1, " + std::to_string(kSide) + "]";
    }
  }
  const std::int64_t pixels = std::int64_t{width} * height;
  return pixels <= limits::kFilmPixels
             ? ""
             : text + " are " + std::to_string(pixels) + " pixels; at most " +
                   std::to_string(limits::kFilmPixels) + " are allowed";
}

/// Returns the member as an object, adding it if it is missing.
Json& object_at(Json& request, const char* key) {
  Json& member = request[key];
  if (!member.is_object()) {
    member = Json::object();
  }
  return member;
}

core::Result<Json> read_job_file(const std::string& path) {
  auto text = read_file(path);
  if (!text) {
    return text.error();
  }
  try {
    Json request = Json::parse(*text);
    if (request.is_object()) {
      return request;
    }
    return Error{ErrorCode::kInvalidArgument, "a job must be a JSON object", path};
  } catch (const Json::parse_error& error) {
    return Error{ErrorCode::kBadSyntax, "is not JSON at byte " + std::to_string(error.byte), path};
  }
}

}  // namespace

void add_fireflies_option(CLI::App& app, std::string& fireflies) {
  app.add_option("--fireflies", fireflies,
                 "set_aside: single bright pixels are scaled down to their neighbours (the default "
                 "of .png, .jpg, .webp and .avif); keep: all light as sampled")
      ->check(CLI::IsMember({"set_aside", "keep"}))
      ->type_name("MODE");
}

void add_denoise_option(CLI::App& app, std::string& denoise) {
  app.add_option("--denoise", denoise,
                 "Image to write: off, mixed (denoised, mixed with the plain one where that is "
                 "better), full (the denoiser's own)")
      ->check(CLI::IsMember({"off", "mixed", "full"}))
      ->type_name("MODE");
}

CLI::Option* add_exposure_option(CLI::App& app, std::string& exposure) {
  const CLI::Validator stops = within(-limits::kExposureStops, limits::kExposureStops);
  const auto fault = [stops](std::string text) {
    return text == "auto" ? std::string() : stops(text);
  };
  return app
      .add_option(
          "--exposure", exposure,
          "Exposure in stops, or auto, which fits the image; only for .png, .jpg, .webp and .avif")
      ->check(CLI::Validator(fault, ""))
      ->type_name("STOPS");
}

namespace {

/// Camera, size and crop.
void add_view_flags(CLI::App& app, JobFlags& flags) {
  app.add_option("--camera", flags.camera, "Name of the scene's camera")->type_name("NAME");
  auto* position =
      app.add_option("--position", flags.position, "Camera position, metres; requires --target")
          ->delimiter(',')
          ->expected(3)
          ->type_name("X,Y,Z");
  auto* target = app.add_option("--target", flags.target, "Point that the camera looks at, metres")
                     ->delimiter(',')
                     ->expected(3)
                     ->type_name("X,Y,Z");
  position->needs(target);
  target->needs(position);
  app.add_option("--orbit", flags.orbit,
                 "Camera orbit around the scene: degrees from the front, degrees from above, and "
                 "distance in metres (whole scene in view)")
      ->delimiter(',')
      ->expected(2, 3)
      ->type_name("THETA,PHI[,R]")
      ->excludes(position);
  app.add_option("--fov", flags.fov_degrees, "Vertical field of view, degrees")
      ->check(above_zero(180))
      ->type_name("D");
  app.add_option("--aperture", flags.aperture_radius_m,
                 "Lens radius for depth of field, metres (0)")
      ->check(CLI::NonNegativeNumber)
      ->type_name("M");
  app.add_option("--focus", flags.focus_distance_m, "Focus distance, metres")
      ->check(CLI::PositiveNumber)
      ->type_name("M");
  app.add_option("--shutter", flags.shutter_seconds,
                 "Seconds that the shutter is open, which blurs animated motion (0)")
      ->check(within(0, 1'000'000))
      ->type_name("S");
  app.add_option("--variant", flags.variant, "Name of the scene's material variant")
      ->type_name("NAME");
  app.add_option("--crop", flags.crop, "Render only this part of the image, pixels")
      ->delimiter(',')
      ->expected(4)
      ->type_name("X,Y,W,H");
  app.add_option("--rotation", flags.environment_rotation_degrees,
                 "Rotation of the environment, counter-clockwise seen from above, degrees")
      ->type_name("D");
  app.add_option("--intensity", flags.environment_intensity,
                 "Multiplier of the environment's light (1)")
      ->type_name("I");
  app.add_flag("--transparent", flags.is_transparent,
               "Transparent background: the environment (white without --environment) lights the "
               "scene but is not visible");
  app.add_flag("--opaque-glass", flags.has_opaque_glass,
               "Glass before a transparent background shows the environment instead of letting "
               "what is behind the image through");
}

/// Environment, background and ground.
void add_stage_flags(CLI::App& app, JobFlags& flags) {
  auto* map = app.add_option("--environment", flags.environment,
                             "Equirectangular environment map: .hdr, .exr")
                  ->type_name("FILE");
  auto* preset =
      app.add_option("--preset", flags.preset, "Procedural studio light: studio, tent, rim")
          ->type_name("NAME")
          ->excludes(map);
  app.add_option("--sun", flags.sun,
                 "Sun and sky at a location (degrees north and east) and a time such as "
                 "2026-06-21T12:00:00+02:00")
      ->delimiter(',')
      ->expected(3)
      ->type_name("LAT,LON,TIME")
      ->excludes(map)
      ->excludes(preset);
  app.add_option("--background", flags.background,
                 "environment, transparent, blurred, or an sRGB colour as six hexadecimal digits")
      ->type_name("TYPE");
  app.add_option(
         "--ground", flags.ground,
         "catcher (shows only shadows and reflections on a transparent background), sweep, none")
      ->type_name("TYPE");
  app.add_option("--ground-height", flags.ground_height,
                 "Height (y) of the ground, metres (the model's lowest point)")
      ->type_name("M");
  app.add_option("--ground-reflection", flags.ground_reflection,
                 "Weight of a smooth coat on the ground: 0 is diffuse, 1 reflects the model")
      ->type_name("0..1");
  app.add_option("--shadow", flags.shadow,
                 "Colour of the shadow on a catcher: neutral (none), physical")
      ->type_name("TYPE");
  app.add_option("--shadow-strength", flags.shadow_strength, "Strength of that shadow (1)")
      ->type_name("0..1");
  app.add_option("--shadow-softness", flags.shadow_softness,
                 "Sine of the angle by which lights are widened for that shadow (0)")
      ->type_name("0..1");
}

/// Converts six hexadecimal digits of sRGB to linear Rec.709; empty if they are invalid.
std::optional<Json> linear_color(const std::string& text) {
  const bool is_hex =
      text.size() == 6 && text.find_first_not_of("0123456789abcdefABCDEF") == std::string::npos;
  if (!is_hex) {
    return std::nullopt;
  }
  Json color = Json::array();
  for (std::size_t i = 0; i < 6; i += 2) {
    const double s = std::stoi(text.substr(i, 2), nullptr, 16) / 255.0;
    // IEC 61966-2-1
    color.push_back(s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4));
  }
  return color;
}

core::Status put_stage(const JobFlags& flags, Json& request) {
  if (flags.preset) {
    object_at(request, "environment")["preset"] = *flags.preset;
  }
  if (!flags.sun.empty()) {
    std::array<double, 2> place{};
    for (std::size_t i = 0; i < 2; ++i) {
      const std::string& text = flags.sun[i];
      const auto read = std::from_chars(text.data(), text.data() + text.size(), place[i]);
      if (read.ec != std::errc() || read.ptr != text.data() + text.size()) {
        return Error{ErrorCode::kInvalidArgument,
                     "--sun: \"" + text + "\" is not an angle in degrees", ""};
      }
    }
    object_at(request, "environment")["sun"] = {
        {"latitude", place[0]}, {"longitude", place[1]}, {"time", flags.sun[2]}};
  }
  if (flags.background) {
    const auto color = linear_color(*flags.background);
    request["background"] =
        color ? Json{{"type", "color"}, {"color", *color}} : Json{{"type", *flags.background}};
  }
  if (flags.ground) {
    object_at(request, "ground")["type"] = *flags.ground;
  }
  if (flags.ground_height) {
    object_at(request, "ground")["height"] = *flags.ground_height;
  }
  if (flags.ground_reflection) {
    object_at(request, "ground")["reflection"] = *flags.ground_reflection;
  }
  if (flags.has_opaque_glass) {
    object_at(request, "background")["through_glass"] = false;
  }
  if (flags.shadow) {
    object_at(object_at(request, "ground"), "shadow")["color"] = *flags.shadow;
  }
  if (flags.shadow_strength) {
    object_at(object_at(request, "ground"), "shadow")["strength"] = *flags.shadow_strength;
  }
  if (flags.shadow_softness) {
    object_at(object_at(request, "ground"), "shadow")["softness"] = *flags.shadow_softness;
  }
  return core::ok_status();
}

void put_view(const JobFlags& flags, Json& request) {
  if (flags.camera) {
    object_at(request, "camera")["name"] = *flags.camera;
    object_at(request, "camera").erase("index");
  }
  if (!flags.position.empty()) {
    object_at(request, "camera")["position"] = flags.position;
    object_at(request, "camera")["target"] = flags.target;
    object_at(request, "camera").erase("orbit");
  }
  if (!flags.orbit.empty()) {
    Json& orbit = object_at(object_at(request, "camera"), "orbit");
    orbit["theta_degrees"] = flags.orbit[0];
    orbit["phi_degrees"] = flags.orbit[1];
    orbit["radius"] = flags.orbit.size() > 2 ? Json(flags.orbit[2]) : Json("auto");
    object_at(request, "camera").erase("position");
    object_at(request, "camera").erase("target");
  }
  const auto put_number = [&](const char* object, const char* member,
                              const std::optional<double>& value) {
    if (value) {
      object_at(request, object)[member] = *value;
    }
  };
  put_number("camera", "vertical_fov_degrees", flags.fov_degrees);
  put_number("camera", "aperture_radius", flags.aperture_radius_m);
  put_number("camera", "focus_distance", flags.focus_distance_m);
  put_number("environment", "rotation_degrees", flags.environment_rotation_degrees);
  put_number("environment", "intensity", flags.environment_intensity);
  if (flags.variant) {
    request["variant"] = *flags.variant;
  }
  if (flags.shutter_seconds) {
    request["shutter_seconds"] = *flags.shutter_seconds;
  }
  if (!flags.crop.empty()) {
    object_at(request, "film")["crop"] = {{"x", flags.crop[0]},
                                          {"y", flags.crop[1]},
                                          {"width", flags.crop[2]},
                                          {"height", flags.crop[3]}};
  }
  if (flags.is_transparent) {
    object_at(request, "environment")["visible"] = false;
  }
}

}  // namespace

void add_job_flags(CLI::App& app, JobFlags& flags, const std::string& scene_help) {
  app.add_option("scene", flags.scene, scene_help)->type_name("SCENE");
  app.add_option("-o,--output", flags.output,
                 "Image to write: .png .jpg .webp .avif .exr .hdr .tif; - is stdout as PNG")
      ->type_name("FILE");
  add_exposure_option(app, flags.exposure);
  add_denoise_option(app, flags.denoise);
  add_fireflies_option(app, flags.fireflies);
  add_look_options(app, flags.look);
  app.add_option("--samples,--spp", flags.samples_per_pixel, "Stop after N samples per pixel (256)")
      ->check(within(1, limits::kSamplesPerPixel))
      ->type_name("N");
  app.add_option("--relative-error", flags.relative_error,
                 "Stop when the relative error is at most E: 0.02, or 2%")
      ->transform(share_within(limits::kRelativeErrorMin, limits::kRelativeErrorMax))
      ->type_name("E");
  app.add_option("--denoised-error", flags.denoised_error,
                 "Stop when the relative error of the denoised image (mixed) is at most E")
      ->transform(share_within(limits::kRelativeErrorMin, limits::kRelativeErrorMax))
      ->type_name("E");
  app.add_option("--meter-error", flags.meter_error,
                 "Stop when the interval of every meter point is at most E of its reading wide")
      ->transform(share_within(limits::kRelativeErrorMin, limits::kRelativeErrorMax))
      ->type_name("E");
  app.add_option("--light-not-found", flags.light_not_found,
                 "Stop when at most this fraction of the light may be missing: 0.02, or 2%; "
                 "error targets end the job only then")
      ->transform(share_within(limits::kRelativeErrorMin, limits::kRelativeErrorMax))
      ->type_name("F");
  app.add_option("--seconds", flags.seconds, "Stop after S seconds of rendering")
      ->check(above_zero(limits::kStopSeconds))
      ->type_name("S");
  app.add_option("--cpu-seconds", flags.cpu_seconds,
                 "Stop after S CPU seconds of rendering, summed over all threads")
      ->check(above_zero(limits::kStopCpuSeconds))
      ->type_name("S");
  app.add_option("--size", flags.size, "Width and height in pixels (960x540)")
      ->check(CLI::Validator(fault_of_size, ""))
      ->type_name("WxH");
  add_view_flags(app, flags);
  add_stage_flags(app, flags);
  app.add_option("--integrator", flags.integrator, "Algorithm that traces light paths (path)")
      ->type_name("T");
  app.add_option("--sampler", flags.sampler, "Sequence of sample points (sobol)")->type_name("T");
  app.add_option("--light-sampler", flags.light_sampler, "Light selection (tree)")->type_name("T");
  app.add_option("--mis", flags.mis, "MIS weighting: balance, power, maximum, optimal")
      ->type_name("T");
  app.add_option("--roulette", flags.roulette, "Russian roulette (throughput)")->type_name("T");
  app.add_option("--split", flags.split, "Split each path into N at its first hit (1)")
      ->check(within(1, limits::kSplitCount))
      ->type_name("N");
  app.add_option("--control-variate", flags.control_variate,
                 "Control variate: none, analytic, regression")
      ->type_name("T");
  app.add_option("--adaptive", flags.adaptive, "Adaptive sampling: pilot, none")->type_name("T");
  app.add_flag("--spectral", flags.is_spectral, "Paths carry wavelengths instead of colours");
  app.add_option("--seed", flags.seed, "Random seed (0); a different seed gives different noise")
      ->check(within(0, limits::kSeed))
      ->type_name("N");
  app.add_flag("--strict", flags.strict,
               "Refuse a scene file with faults, which are otherwise mended with a warning");
  app.add_option("--threads", flags.threads, "Render threads (as many as the machine has)")
      ->check(within(0, 1024))
      ->type_name("N");
  app.add_option("--job", flags.job_file, "Job request as JSON; flags override it")
      ->type_name("FILE");
  app.add_flag("--json", flags.json, "Print the result as JSON on stdout");
}

core::Result<Json> make_request(const JobFlags& flags) {
  Json request = Json::object();
  if (!flags.job_file.empty()) {
    auto read = read_job_file(flags.job_file);
    if (!read) {
      return read.error();
    }
    request = *std::move(read);
  }
  if (!flags.scene.empty()) {
    request["scene"] = flags.scene;
  }
  if (!request.contains("scene")) {
    return Error{ErrorCode::kInvalidArgument, "no SCENE: give it as an argument or in a --job file",
                 ""};
  }
  if (flags.size) {
    const auto size = parse_size(*flags.size);
    object_at(request, "film")["width"] = size->first;
    object_at(request, "film")["height"] = size->second;
  }
  put_view(flags, request);
  if (const core::Status put = put_stage(flags, request); !put) {
    return put.error();
  }
  if (flags.integrator) {
    object_at(request, "integrator")["type"] = *flags.integrator;
  }
  if (flags.sampler) {
    object_at(request, "sampler")["type"] = *flags.sampler;
  }
  if (flags.light_sampler) {
    object_at(request, "light_sampler")["type"] = *flags.light_sampler;
  }
  if (flags.mis) {
    object_at(object_at(request, "estimator"), "mis")["type"] = *flags.mis;
  }
  if (flags.roulette) {
    object_at(object_at(request, "estimator"), "roulette")["type"] = *flags.roulette;
  }
  if (flags.split) {
    object_at(request, "estimator")["splitting"] = {{"type", "fixed"}, {"count", *flags.split}};
  }
  if (flags.control_variate) {
    object_at(object_at(request, "estimator"), "control_variate")["type"] = *flags.control_variate;
  }
  if (flags.adaptive) {
    object_at(request, "adaptive")["type"] = *flags.adaptive;
  }
  if (flags.is_spectral) {
    request["spectral"] = true;
  }
  if (flags.seed) {
    request["seed"] = *flags.seed;
  }
  if (flags.samples_per_pixel) {
    object_at(request, "stop")["samples_per_pixel"] = *flags.samples_per_pixel;
  }
  if (flags.relative_error) {
    object_at(request, "stop")["relative_error"] = *flags.relative_error;
  }
  if (flags.denoised_error) {
    object_at(request, "stop")["denoised_error"] = *flags.denoised_error;
  }
  if (flags.meter_error) {
    object_at(request, "stop")["meter_error"] = *flags.meter_error;
  }
  if (flags.light_not_found) {
    object_at(request, "stop")["light_not_found"] = *flags.light_not_found;
  }
  if (flags.seconds) {
    object_at(request, "stop")["seconds"] = *flags.seconds;
  }
  if (flags.cpu_seconds) {
    object_at(request, "stop")["cpu_seconds"] = *flags.cpu_seconds;
  }
  return request;
}

int request_fault_code(const core::Error& error, const JobFlags& flags) {
  const bool is_file =
      !error.where.empty() && (error.where == flags.job_file || error.where == flags.environment);
  return is_file ? kFailed : kWrongUsage;
}

}  // namespace cli
