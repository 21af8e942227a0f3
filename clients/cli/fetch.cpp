#include "clients/cli/fetch.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>

#include "api/json/limits.h"
#include "clients/cli/command.h"
#include "clients/cli/files.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/terminal.h"
#include "core/base/file_names.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::array<std::string_view, 9> kExtensions = {"png", "jpg", "jpeg", "webp", "avif",
                                                         "exr", "hdr", "tif",  "tiff"};

std::string format_of(const std::string& output) {
  std::string extension = output == "-" ? "png" : extension_of(output);
  if (extension == "jpeg" || extension == "tiff") {
    extension.erase(3);
    return extension == "jpe" ? "jpg" : extension;
  }
  return extension;
}

int run(const ServerFlags& server, const std::string& id, const PictureQuery& query,
        const std::string& output) {
  if (const auto name = check_picture_name(output); !name) {
    complain("fetch", name.error());
    return kWrongUsage;
  }
  if (const auto look = check_look(query, output); !look) {
    complain("fetch", look.error());
    return kWrongUsage;
  }
  return with_job("fetch", server, id, [&](ApiClient& client, const std::string& path) {
    return fetch_picture(client, path, query, output);
  });
}

int run_film(const ServerFlags& server, const std::string& id, const std::string& output) {
  return with_job("fetch", server, id, [&](ApiClient& client, const std::string& path) {
    const auto reply = client.get(path + "/film");
    return reply ? write_file(output, reply->body) : core::Status(reply.error());
  });
}

}  // namespace

core::Status check_look(const PictureQuery& query, const std::string& output) {
  constexpr std::array<std::string_view, 3> kLinear = {"exr", "hdr", "tif"};
  const std::string format = format_of(output);
  const bool is_linear = std::find(kLinear.begin(), kLinear.end(), format) != kLinear.end();
  if (const auto look = check_look_flags(query.look, format, is_linear); !look || !is_linear) {
    return look;
  }
  const bool plain =
      query.tone_map.empty() || query.tone_map == "srgb" || query.tone_map == "linear";
  const bool usual = query.exposure.empty() || (query.exposure != "auto" &&
                                                std::strtod(query.exposure.c_str(), nullptr) == 0);
  if (plain && usual) {
    return core::ok_status();
  }
  return Error{ErrorCode::kInvalidArgument,
               "is for .png, .jpg, .webp and .avif; ." + format + " is linear",
               plain ? "--exposure" : "--tonemap"};
}

core::Status check_picture_name(const std::string& output) {
  if (output == "-" && is_terminal(stdout)) {
    return Error{ErrorCode::kInvalidArgument,
                 "stdout is a terminal; redirect the image, as in `-o - > image.png`", "-"};
  }
  const std::string extension = extension_of(output);
  if (output == "-" ||
      std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end()) {
    return core::ok_status();
  }
  return Error{ErrorCode::kInvalidArgument,
               "unknown format; the name must end in .png .jpg .webp .avif .exr .hdr or .tif",
               output};
}

core::Status fetch_picture(ApiClient& client, const std::string& path, const PictureQuery& query,
                           const std::string& output) {
  std::string parameters;
  const auto add = [&parameters](const std::string& name, const std::string& value) {
    parameters += (parameters.empty() ? "?" : "&") + name + "=" + core::percent_encode(value);
  };
  if (!query.layer.empty()) {
    add("layer", query.layer);
  }
  if (!query.exposure.empty()) {
    add("exposure", query.exposure);
  }
  if (!query.tone_map.empty()) {
    add("tonemap", query.tone_map);
  }
  if (!query.denoise.empty()) {
    add("denoise", query.denoise);
  }
  if (!query.fireflies.empty()) {
    add("fireflies", query.fireflies);
  }
  const auto number = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", value);
    return std::string(text);
  };
  if (query.look.white_balance_k) {
    add("white_balance", number(*query.look.white_balance_k));
  }
  if (query.look.contrast != 1) {
    add("contrast", number(query.look.contrast));
  }
  if (query.look.bits != 8) {
    add("bits", std::to_string(query.look.bits));
  }
  const auto reply = client.get(path + "/image." + format_of(output) + parameters);
  if (!reply) {
    return reply.error();
  }
  return write_file(output, reply->body);
}

int fetch(const Args& args) {
  CLI::App app(
      "Downloads a job's image (partial if still rendering), or the film of a finished job.",
      "tessera fetch");
  ServerFlags server;
  std::string id = "latest";
  std::string output;
  PictureQuery query;
  bool film = false;
  app.add_option("id", id, "Job (the newest)")->type_name("ID");
  app.add_option("-o,--output", output,
                 "File to write: .png .jpg .webp .avif .exr .hdr .tif; - is stdout as PNG")
      ->required()
      ->type_name("FILE");
  app.add_option("--layer", query.layer,
                 "beauty albedo normal depth alpha samples variance error denoised denoised_error "
                 "denoise_bias denoise_bias_error (default for EXR: all except denoised ones)")
      ->type_name("L");
  add_exposure_option(app, query.exposure);
  app.add_option("--tonemap", query.tone_map,
                 "Tone map: khronos-neutral (default) srgb linear aces agx; only for .png, .jpg, "
                 ".webp, .avif")
      ->type_name("T");
  add_denoise_option(app, query.denoise, true);
  add_fireflies_option(app, query.fireflies);
  add_look_options(app, query.look);
  app.add_flag("--film", film, "Download the raw film instead (input for `merge`)")
      ->excludes("--layer", "--exposure", "--tonemap", "--denoise", "--fireflies",
                 "--white-balance", "--contrast", "--bits");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] {
    return film ? run_film(server, id, output) : run(server, id, query, output);
  });
}

}  // namespace cli
