#include "clients/cli/job_flags.h"

#include <charconv>
#include <utility>

#include "api/limits.h"
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

/// Empty when the text is a size that a film may have.
std::string fault_of_size(const std::string& text) {
  const auto size = parse_size(text);
  if (!size) {
    return '"' + text + "\" is no size; one looks like 960x540";
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

/// The member as an object, made if it is not there.
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
    return Error{ErrorCode::kInvalidArgument, "a job is a JSON object", path};
  } catch (const Json::parse_error& error) {
    return Error{ErrorCode::kBadSyntax, "is not JSON at byte " + std::to_string(error.byte), path};
  }
}

}  // namespace

void add_denoise_option(CLI::App& app, std::string& denoise) {
  app.add_option("--denoise", denoise,
                 "Picture that is written: off, mixed (denoised, with the plain one where that is "
                 "better), full (the denoiser's own)")
      ->check(CLI::IsMember({"off", "mixed", "full"}))
      ->type_name("MODE");
}

void add_job_flags(CLI::App& app, JobFlags& flags, const std::string& scene_help) {
  app.add_option("scene", flags.scene, scene_help)->type_name("SCENE");
  app.add_option("-o,--output", flags.output,
                 "Picture to write: .png .jpg .webp .exr .hdr .tif; - is stdout as PNG")
      ->type_name("FILE");
  add_denoise_option(app, flags.denoise);
  app.add_option("--spp", flags.samples_per_pixel, "Stop after N samples per pixel (256)")
      ->check(within(1, limits::kSamplesPerPixel))
      ->type_name("N");
  app.add_option("--relative-error", flags.relative_error,
                 "Stop when the relative error is at most this: 0.02, or 2%")
      ->transform(share_within(limits::kRelativeErrorMin, limits::kRelativeErrorMax))
      ->type_name("E");
  app.add_option("--seconds", flags.seconds, "Stop after so many seconds of rendering")
      ->check(above_zero(limits::kStopSeconds))
      ->type_name("S");
  app.add_option("--size", flags.size, "Width and height in pixels (960x540)")
      ->check(CLI::Validator(fault_of_size, ""))
      ->type_name("WxH");
  app.add_option("--camera", flags.camera, "Camera of the scene, by name")->type_name("NAME");
  app.add_option("--environment", flags.environment,
                 "Equirectangular map that lights the scene: .hdr, .exr")
      ->type_name("FILE");
  app.add_option("--integrator", flags.integrator, "How light is estimated (path)")->type_name("T");
  app.add_option("--sampler", flags.sampler, "Where samples come from (sobol)")->type_name("T");
  app.add_option("--light-sampler", flags.light_sampler, "How lights are chosen (tree)")
      ->type_name("T");
  app.add_option("--mis", flags.mis,
                 "Weights of light and BSDF samples: balance, power, maximum, optimal")
      ->type_name("T");
  app.add_option("--roulette", flags.roulette, "Russian roulette (throughput)")->type_name("T");
  app.add_option("--split", flags.split, "Split each path into N at its first hit (1)")
      ->check(within(1, limits::kSplitCount))
      ->type_name("N");
  app.add_option("--control-variate", flags.control_variate,
                 "Light known in closed form: none, analytic, regression")
      ->type_name("T");
  app.add_option("--adaptive", flags.adaptive, "Adaptive sampling: pilot, none")->type_name("T");
  app.add_option("--seed", flags.seed, "Random seed (0); a different seed gives different noise")
      ->check(within(0, limits::kSeed))
      ->type_name("N");
  app.add_option("--threads", flags.threads, "Threads that render (all of the machine's)")
      ->check(within(0, 1024))
      ->type_name("N");
  app.add_option("--job", flags.job_file, "Job request as JSON; flags win over it")
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
    return Error{ErrorCode::kInvalidArgument,
                 "no SCENE: neither as an argument nor in a --job file", ""};
  }
  if (flags.size) {
    const auto size = parse_size(*flags.size);
    object_at(request, "film")["width"] = size->first;
    object_at(request, "film")["height"] = size->second;
  }
  if (flags.camera) {
    object_at(request, "camera")["name"] = *flags.camera;
    object_at(request, "camera").erase("index");
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
  if (flags.seed) {
    request["seed"] = *flags.seed;
  }
  if (flags.samples_per_pixel) {
    object_at(request, "stop")["samples_per_pixel"] = *flags.samples_per_pixel;
  }
  if (flags.relative_error) {
    object_at(request, "stop")["relative_error"] = *flags.relative_error;
  }
  if (flags.seconds) {
    object_at(request, "stop")["seconds"] = *flags.seconds;
  }
  return request;
}

int request_fault_code(const core::Error& error, const JobFlags& flags) {
  const bool is_file =
      !error.where.empty() && (error.where == flags.job_file || error.where == flags.environment);
  return is_file ? kFailed : kWrongUsage;
}

}  // namespace cli
