#include "clients/cli/job_flags.h"

#include <array>
#include <charconv>
#include <utility>

#include "api/json/limits.h"
#include "clients/cli/command.h"
#include "clients/cli/files.h"
#include "clients/cli/job_json.h"
#include "core/color/srgb.h"

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

core::Result<Json> read_job_file(const std::string& path) {
  auto text = read_file(path);
  if (!text) {
    return text.error();
  }
  if (std::string fault = nesting_fault(*text); !fault.empty()) {
    return Error{ErrorCode::kInvalidArgument, std::move(fault), path};
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

void add_denoise_option(CLI::App& app, std::string& denoise, bool is_of_batch) {
  std::vector<std::string> modes = {"off", "mixed", "full"};
  std::string words =
      "Image to write: off, mixed (denoised, mixed with the plain one where that is better), full "
      "(the denoiser's own)";
  if (is_of_batch) {
    modes.emplace_back("video");
    words += ", video (that averaged with the frames before and after it in its batch)";
  }
  app.add_option("--denoise", denoise, words)->check(CLI::IsMember(modes))->type_name("MODE");
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
  app.add_option("--crop", flags.crop, "Render only this part of the image, pixels")
      ->delimiter(',')
      ->expected(4)
      ->type_name("X,Y,W,H");
}

/// Environment and background. Pre: the app has --preset.
void add_stage_flags(CLI::App& app, JobFlags& flags) {
  auto* map = app.add_option("--environment", flags.environment,
                             "Equirectangular environment map: .hdr, .exr")
                  ->type_name("FILE");
  auto* preset = app.get_option("--preset")->excludes(map);
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
    color.push_back(core::srgb_decoded(std::stoi(text.substr(i, 2), nullptr, 16) / 255.0));
  }
  return color;
}

core::Status put_stage(const JobFlags& flags, Json& request) {
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
    put(request, "/environment/sun",
        {{"latitude", place[0]}, {"longitude", place[1]}, {"time", flags.sun[2]}});
  }
  if (flags.background) {
    const auto color = linear_color(*flags.background);
    if (!color && flags.background->find_first_of("#0123456789") != std::string::npos) {
      return Error{ErrorCode::kInvalidArgument,
                   "--background: \"" + *flags.background +
                       "\" is neither an sRGB colour as six hexadecimal digits, such as ff8000, "
                       "nor environment, transparent or blurred",
                   ""};
    }
    request["background"] =
        color ? Json{{"type", "color"}, {"color", *color}} : Json{{"type", *flags.background}};
  }
  return core::ok_status();
}

void put_view(const JobFlags& flags, Json& request) {
  const auto erase = [&request](const char* member) {
    if (const auto camera = request.find("camera");
        camera != request.end() && camera->is_object()) {
      camera->erase(member);
    }
  };
  if (flags.camera) {
    put(request, "/camera/name", *flags.camera);
    erase("index");
  }
  if (!flags.position.empty()) {
    put(request, "/camera/position", flags.position);
    put(request, "/camera/target", flags.target);
    erase("orbit");
  }
  if (!flags.orbit.empty()) {
    put(request, "/camera/orbit/theta_degrees", flags.orbit[0]);
    put(request, "/camera/orbit/phi_degrees", flags.orbit[1]);
    put(request, "/camera/orbit/radius",
        flags.orbit.size() > 2 ? Json(flags.orbit[2]) : Json("auto"));
    erase("position");
    erase("target");
  }
  if (!flags.crop.empty()) {
    put(request, "/film/crop",
        {{"x", flags.crop[0]},
         {"y", flags.crop[1]},
         {"width", flags.crop[2]},
         {"height", flags.crop[3]}});
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
  add_member_flags(app, stop_flags(), flags.members);
  app.add_option("--size", flags.size, "Width and height in pixels (960x540)")
      ->check(CLI::Validator(fault_of_size, ""))
      ->type_name("WxH");
  add_view_flags(app, flags);
  add_member_flags(app, view_flags(), flags.members);
  add_stage_flags(app, flags);
  add_member_flags(app, method_flags(), flags.members);
  app.add_option("--split", flags.split, "Split each path into N at its first hit (1)")
      ->check(within(1, limits::kSplitCount))
      ->type_name("N");
  add_set_option(app, flags.members);
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
    put(request, "/film/width", size->first);
    put(request, "/film/height", size->second);
  }
  put_view(flags, request);
  if (const core::Status put = put_stage(flags, request); !put) {
    return put.error();
  }
  if (flags.split) {
    put(request, "/estimator/splitting", {{"type", "fixed"}, {"count", *flags.split}});
  }
  put(request, flags.members);
  return request;
}

int request_fault_code(const core::Error& error, const JobFlags& flags) {
  const bool is_file =
      !error.where.empty() && (error.where == flags.job_file || error.where == flags.environment);
  return is_file ? kFailed : kWrongUsage;
}

}  // namespace cli
