// The verb for batches of jobs: batch.
#include <chrono>
#include <cstdio>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/fetch.h"
#include "clients/cli/files.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/job_json.h"
#include "clients/cli/progress.h"
#include "clients/cli/submit.h"
#include "clients/cli/terminal.h"
#include "clients/cli/upload.h"
#include "clients/cli/video.h"
#include "core/base/file_names.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::chrono::milliseconds kPoll{500};

struct BatchFlags {
  ServerFlags server;
  std::string file;
  std::string output;  ///< .zip; empty: none
  std::string sheet;   ///< .png; empty: none
  std::string format = "png";
  std::string exposure;
  std::string denoise;
  VideoOptions video;  ///< without output: none
  bool wait = false;
  bool dry_run = false;
  bool json = false;

  bool waits() const { return wait || !output.empty() || !sheet.empty() || !video.output.empty(); }
};

/// Has the text the form of a batch's id (RFC 9562)?
bool is_id(std::string_view text) {
  constexpr std::string_view kForm = "xxxxxxxx-xxxx-xxxx-xxxx-xxxxxxxxxxxx";
  const auto fits = [](char c, char form) {
    return form == '-' ? c == '-' : std::isxdigit(static_cast<unsigned char>(c)) != 0;
  };
  return text.size() == kForm.size() && std::equal(text.begin(), text.end(), kForm.begin(), fits);
}

core::Result<Json> read_request(const std::string& path) {
  const auto text = read_file(path);
  if (!text) {
    return text.error();
  }
  if (std::string fault = nesting_fault(*text); !fault.empty()) {
    return Error{ErrorCode::kInvalidArgument, std::move(fault), path};
  }
  Json request = Json::parse(*text, nullptr, false);
  if (!request.is_object() || !request.contains("template")) {
    return Error{ErrorCode::kBadSyntax,
                 R"(a batch is JSON: {"template": job, "matrix": {"variant": ["a", "b"]}})", path};
  }
  return request;
}

/// Uploads the model if the template names it by its file.
core::Status upload_model(ApiClient& client, Json& request) {
  Json& job = request["template"];
  const std::string scene = job.is_object() ? text_at(job, "scene") : "";
  const auto file = model_file(scene);
  if (!file) {
    return file.error();
  }
  if (!*file) {
    return core::ok_status();
  }
  const auto id = upload_scene(client, **file);
  if (!id) {
    return id.error();
  }
  job["scene"] = *id;
  return core::ok_status();
}

/// Waits until all jobs have ended and returns the final batch.
core::Result<Json> wait_for_end(ApiClient& client, const std::string& path) {
  const bool shows = is_terminal(stderr);
  while (true) {
    const auto reply = client.get(path);
    if (!reply) {
      return reply.error();
    }
    Json batch = parse_object(reply->body);
    const bool ended = is_final_state(text_at(batch, "state"));
    if (shows) {
      std::fprintf(stderr, "\r%3.0f%%  %.0f of %zu images%s",
                   100 * number_at(object_in(batch, "progress"), "fraction", 0),
                   number_at(object_in(batch, "counts"), "finished", 0),
                   batch.contains("jobs") ? batch["jobs"].size() : std::size_t{0},
                   ended ? "\n" : "");
      std::fflush(stderr);
    }
    if (ended) {
      return batch;
    }
    std::this_thread::sleep_for(kPoll);
  }
}

core::Status download(ApiClient& client, const std::string& path, const std::string& output) {
  const auto reply = client.get(path);
  if (!reply) {
    return reply.error();
  }
  return write_file(output, reply->body);
}

core::Status fetch_pictures(ApiClient& client, const BatchFlags& flags, const std::string& path) {
  std::string look = flags.denoise.empty() ? "" : "&denoise=" + flags.denoise;
  look += flags.exposure.empty() ? "" : "&exposure=" + core::percent_encode(flags.exposure);
  if (!flags.output.empty()) {
    const std::string query = "?format=" + core::percent_encode(flags.format) + look;
    if (auto got = download(client, path + "/archive.zip" + query, flags.output); !got) {
      return got;
    }
  }
  return flags.sheet.empty()
             ? core::ok_status()
             : download(client, path + "/sheet.png" + (look.empty() ? "" : "?" + look.substr(1)),
                        flags.sheet);
}

/// Writes a video of the finished images in the order of the batch.
core::Status make_video(ApiClient& client, const BatchFlags& flags, const Json& batch) {
  std::vector<std::string> paths;
  for (const Json& job : batch.contains("jobs") ? batch["jobs"] : Json::array()) {
    if (text_at(job, "state") == "finished") {
      // A white background, since a video has no alpha.
      paths.push_back("/v1/jobs/" + core::percent_encode(text_at(job, "id")) +
                      "/image.png?background=ffffff" +
                      (flags.denoise.empty() ? "" : "&denoise=" + flags.denoise));
    }
  }
  // All frames get the automatic exposure of the first.
  std::string exposure = flags.exposure;
  return write_video(flags.video, paths.size(), [&](std::size_t i) -> core::Result<std::string> {
    const auto reply = client.get(
        paths[i] + (exposure.empty() ? "" : "&exposure=" + core::percent_encode(exposure)));
    if (!reply) {
      return reply.error();
    }
    exposure = exposure == "auto" ? reply->exposure : exposure;
    return reply->body;
  });
}

/// Prints how much the error changes from frame to frame, if the server has measured it.
core::Status print_flicker(ApiClient& client, const std::string& path) {
  const auto reply = client.get(path);
  if (!reply) {
    return reply.error();
  }
  const Json batch = parse_object(reply->body);
  const Json& flicker = object_in(batch, "flicker");
  if (flicker.contains("relative")) {
    std::fprintf(stderr, "flicker %s (%s to %s)\n",
                 error_text(number_at(flicker, "relative", 0)).c_str(),
                 error_text(number_at(flicker, "low", 0)).c_str(),
                 error_text(number_at(flicker, "high", 0)).c_str());
  }
  return core::ok_status();
}

void print_batch(const BatchFlags& flags, const Json& batch) {
  if (flags.json) {
    std::printf("%s\n", batch.dump(2).c_str());
    return;
  }
  for (const Json& job : batch.contains("jobs") ? batch["jobs"] : Json::array()) {
    std::printf("%s  %-9s  %s\n", text_at(job, "id").c_str(), text_at(job, "state").c_str(),
                text_at(job, "name").c_str());
  }
}

int follow(ApiClient& client, const BatchFlags& flags, const std::string& path) {
  const auto ended = wait_for_end(client, path);
  if (!ended) {
    return complain("batch", ended.error());
  }
  print_batch(flags, *ended);
  if (const auto fetched = fetch_pictures(client, flags, path); !fetched) {
    return complain("batch", fetched.error());
  }
  if (!flags.video.output.empty()) {
    if (const auto made = make_video(client, flags, *ended); !made) {
      return complain("batch", made.error());
    }
    if (flags.denoise == "video") {
      if (const auto printed = print_flicker(client, path); !printed) {
        return complain("batch", printed.error());
      }
    }
  }
  return text_at(*ended, "state") == "finished" ? kDone : kFailed;
}

int submit(ApiClient& client, const BatchFlags& flags) {
  auto request = read_request(flags.file);
  if (!request) {
    return complain("batch", request.error());
  }
  if (const auto uploaded = upload_model(client, *request); !uploaded) {
    return complain("batch", uploaded.error());
  }
  const auto reply =
      client.post(flags.dry_run ? "/v1/batches?dry_run=1" : "/v1/batches", request->dump(),
                  "application/json", {{"Idempotency-Key", idempotency_key()}});
  if (!reply) {
    return complain("batch", reply.error());
  }
  const Json batch = parse_object(reply->body);
  if (flags.dry_run) {
    for (const Json& name : batch.contains("names") ? batch["names"] : Json::array()) {
      std::printf("%s\n", name.get<std::string>().c_str());
    }
    return kDone;
  }
  const std::string id = text_at(batch, "id");
  if (!flags.waits()) {
    std::printf("%s\n", flags.json ? batch.dump(2).c_str() : id.c_str());
    return kDone;
  }
  std::fprintf(stderr, "%s\n", id.c_str());
  return follow(client, flags, "/v1/batches/" + core::percent_encode(id));
}

int run(const BatchFlags& flags) {
  if (!flags.video.output.empty()) {
    // Before anything renders.
    if (const auto found = find_ffmpeg(); !found) {
      return complain("batch", found.error());
    }
  }
  auto client = ApiClient::connect(flags.server.url, flags.server.key);
  if (!client) {
    return complain("batch", client.error());
  }
  if (is_id(flags.file) && flags.dry_run) {
    std::fprintf(stderr, "tessera batch: --dry-run needs a FILE: this batch exists already\n");
    return kWrongUsage;
  }
  return is_id(flags.file) ? follow(**client, flags, "/v1/batches/" + flags.file)
                           : submit(**client, flags);
}

}  // namespace

int batch(const Args& args) {
  CLI::App app(
      "Submits a batch of jobs, given by a template and a matrix of values, and prints its id. "
      "With --wait, -o, --sheet or --video, waits until all jobs have ended.",
      "tessera batch");
  BatchFlags flags;
  app.add_option("file", flags.file,
                 "JSON with template, matrix and name, whose scene may be a model file; or the id "
                 "of a batch")
      ->required()
      ->type_name("FILE");
  app.add_flag("--wait", flags.wait,
               "Wait until all jobs have ended; exit code 1 unless all finished");
  app.add_option("-o,--output", flags.output, "Write a zip of all images to FILE")
      ->type_name("FILE");
  app.add_option("--format", flags.format, "Format of the images in the zip")
      ->check(CLI::IsMember({"png", "jpg", "webp", "avif", "exr", "hdr", "tif"}))
      ->type_name("FORMAT")
      ->capture_default_str();
  app.add_option("--sheet", flags.sheet, "Write all images on one sheet to FILE (PNG)")
      ->type_name("FILE");
  app.add_option("--video", flags.video.output,
                 "Write a video (.mp4, .webm) with one frame per image; needs ffmpeg")
      ->type_name("FILE");
  app.add_option("--fps", flags.video.frames_per_second, "Frames per second of the video")
      ->check(CLI::Range(0.01, 1000.0))
      ->type_name("N")
      ->capture_default_str();
  add_exposure_option(app, flags.exposure);
  add_denoise_option(app, flags.denoise, true);
  app.add_flag("--dry-run", flags.dry_run, "Only validate the batch and print the jobs' names");
  app.add_flag("--json", flags.json, "Print the batch as JSON");
  add_server_flags(app, flags.server);
  return parse_and_run(app, args, [&] { return run(flags); });
}

}  // namespace cli
