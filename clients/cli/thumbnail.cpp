// A small image of a model file, for file managers and lists.
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "api/json/limits.h"
#include "clients/cli/command.h"
#include "clients/cli/files.h"
#include "clients/cli/sibling.h"
#include "clients/cli/upload.h"

namespace cli {
namespace {

constexpr const char* kVerb = "thumbnail";

struct Flags {
  std::string file;
  std::string output;
  int size_px = 256;
  double seconds = 0.5;
  std::string side() const { return std::to_string(size_px) + "x" + std::to_string(size_px); }
  std::string limit() const {
    char text[32];
    std::snprintf(text, sizeof text, "%.9g", seconds);
    return text;
  }
};

/// Three quarters from the front, a little from above, whatever cameras the file has.
constexpr std::string_view kTheta = "30";
constexpr std::string_view kPhi = "70";

/// Renders an uploaded scene; returns its image. job: receives the job's path once there is one.
core::Result<std::string> rendered(ApiClient& client, const std::string& scene, const Flags& flags,
                                   std::string& job) {
  auto reply = client.post("/v1/render?preset=thumbnail&format=png&wait=60&size=" + flags.side() +
                               "&seconds=" + flags.limit() + "&theta=" + std::string(kTheta) +
                               "&phi=" + std::string(kPhi),
                           Json{{"scene", scene}}.dump(), "application/json");
  if (!reply) {
    return reply.error();
  }
  job = reply->location;
  if (reply->status != 200) {
    return core::Error{core::ErrorCode::kUnavailable, "the server is busy; try again later", ""};
  }
  // Refused if the time was too short for samples that a denoiser can compare.
  auto denoised = client.get(job + "/image.png?denoise=mixed&exposure=auto");
  return denoised ? std::move(denoised->body) : std::move(reply->body);
}

/// As the preset, without a server: file managers may run this without a network.
int render_here(const Flags& flags) {
  if (flags.output != "-" && std::freopen(flags.output.c_str(), "wb", stdout) == nullptr) {
    return complain(kVerb, {core::ErrorCode::kInternal, std::strerror(errno), flags.output});
  }
  std::vector<std::string> words = {"tessera",
                                    "render",
                                    flags.file,
                                    "--output",
                                    "-",
                                    "--size",
                                    flags.side(),
                                    "--seconds",
                                    flags.limit(),
                                    "--relative-error",
                                    "0.05",
                                    "--orbit",
                                    std::string(kTheta) + "," + std::string(kPhi),
                                    "--preset",
                                    "tent",
                                    "--background",
                                    "transparent",
                                    "--exposure",
                                    "auto",
                                    "--denoise",
                                    "mixed"};
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  return execute_sibling(argv.data());
}

int run(const ServerFlags& server, const Flags& flags) {
  auto connected = ApiClient::connect(server.url, server.key);
  if (!connected) {
    return complain(kVerb, connected.error());
  }
  ApiClient& client = **connected;
  const auto scene = upload_scene(client, flags.file);
  if (!scene) {
    const bool is_alone =
        scene.error().code == core::ErrorCode::kUnavailable && client.last().status == 0;
    return is_alone ? render_here(flags) : complain(kVerb, scene.error());
  }
  const bool is_new = client.last().status == 201;
  std::string job;
  const auto image = rendered(client, *scene, flags, job);
  // Kept, they would fill the server. What cannot be deleted is in use by others.
  if (!job.empty()) {
    (void)client.post(job + "/cancel", "", "application/json");
    (void)client.remove(job);
  }
  if (is_new) {
    (void)client.remove("/v1/scenes/" + *scene);
  }
  if (!image) {
    return complain(kVerb, image.error());
  }
  const core::Status written = write_file(flags.output, *image);
  return written ? kDone : complain(kVerb, written.error());
}

}  // namespace

int thumbnail(const Args& args) {
  CLI::App app(
      "Renders a small image of a model, framed and lit by the server's preset thumbnail, on a "
      "transparent background. The server keeps neither model nor image. Without a server, this "
      "program renders it.",
      "tessera thumbnail");
  ServerFlags server;
  Flags flags;
  add_server_flags(app, server);
  app.add_option("file", flags.file, "A .glb, .gltf or .zip file")->required()->type_name("FILE");
  app.add_option("-o,--output", flags.output, "PNG file; - is stdout")
      ->required()
      ->type_name("FILE");
  app.add_option("--size", flags.size_px, "Width and height in pixels")
      ->check(CLI::Range(1, static_cast<int>(api::limits::kFilmSide)))
      ->capture_default_str()
      ->type_name("PIXELS");
  app.add_option("--seconds", flags.seconds, "Render at most this long, besides loading")
      ->check(above_zero(static_cast<double>(api::limits::kStopSeconds)))
      ->capture_default_str()
      ->type_name("SECONDS");
  return parse_and_run(app, args, [&] { return run(server, flags); });
}

}  // namespace cli
