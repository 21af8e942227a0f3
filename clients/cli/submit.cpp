#include "clients/cli/submit.h"

#include <cstdio>
#include <random>
#include <vector>

#include "api/json/limits.h"
#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/fetch.h"
#include "clients/cli/files.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"
#include "clients/cli/shown.h"
#include "clients/cli/upload.h"
#include "core/base/file_names.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

struct SubmitFlags {
  ServerFlags server;
  JobFlags job;
  std::string name;
  std::vector<std::string> labels;
  std::optional<int> priority;
  bool wait = false;
};

core::Status add_labels(const std::vector<std::string>& labels, Json& request) {
  for (const std::string& label : labels) {
    const auto equals = label.find('=');
    if (equals == std::string::npos || equals == 0) {
      return Error{ErrorCode::kInvalidArgument, "a label must be KEY=VALUE", label};
    }
    request["labels"][label.substr(0, equals)] = label.substr(equals + 1);
  }
  return core::ok_status();
}

/// The image of --output.
PictureQuery picture_of(const JobFlags& flags) {
  return {.layer = {},
          .exposure = flags.exposure,
          .tone_map = {},
          .denoise = flags.denoise,
          .fireflies = flags.fireflies,
          .look = flags.look};
}

core::Result<Json> request_of(const SubmitFlags& flags) {
  auto request = make_request(flags.job);
  if (!request) {
    return request.error();
  }
  if (!flags.name.empty()) {
    (*request)["name"] = flags.name;
  }
  if (flags.priority) {
    (*request)["priority"] = *flags.priority;
  }
  if (const auto labels = add_labels(flags.labels, *request); !labels) {
    return labels.error();
  }
  if (!flags.job.output.empty()) {
    if (const auto name = check_picture_name(flags.job.output); !name) {
      return name.error();
    }
    if (const auto look = check_look(picture_of(flags.job), flags.job.output); !look) {
      return look.error();
    }
  }
  return request;
}

/// Uploads files and replaces them by their ids.
core::Status upload_files(ApiClient& client, const SubmitFlags& flags, Json& request) {
  const auto file = model_file(flags.job.scene);
  if (!file) {
    return file.error();
  }
  if (*file) {
    const auto id = upload_scene(client, **file, flags.job.strict);
    if (!id) {
      return id.error();
    }
    request["scene"] = *id;
    if (text_at(request, "name").empty()) {
      request["name"] = (*file)->substr((*file)->find_last_of('/') + 1);
    }
  } else if (!extension_of(flags.job.scene).empty()) {
    return Error{ErrorCode::kNotFound, "there is no such file", flags.job.scene};
  }
  if (!flags.job.environment.empty()) {
    const auto id = upload_asset(client, flags.job.environment);
    if (!id) {
      return id.error();
    }
    request["environment"]["asset"] = *id;
  }
  return core::ok_status();
}

core::Result<Json> post_job(ApiClient& client, const Json& request) {
  const ApiClient::Headers headers = {{"Idempotency-Key", idempotency_key()}};
  auto reply = client.post("/v1/jobs", request.dump(), "application/json", headers);
  if (!reply && reply.error().code == ErrorCode::kUnavailable) {
    reply = client.post("/v1/jobs", request.dump(), "application/json", headers);
  }
  if (!reply) {
    return reply.error();
  }
  return parse_object(reply->body);
}

/// Follows the job to its end and downloads the image if requested.
int wait_for(ApiClient& client, const SubmitFlags& flags, const std::string& path,
             const Json& told) {
  const auto ended = follow_with_progress(client, path, stderr);
  if (!ended) {
    return complain("submit", ended.error());
  }
  std::fprintf(stderr, "%s\n", shown(closing_text(*ended)).c_str());
  tell_warnings(*ended, told);
  if (flags.job.json) {
    std::printf("%s\n", ended->dump(2).c_str());
  }
  const int code = exit_code_of(*ended);
  if (code == kDone && !flags.job.output.empty()) {
    const auto fetched = fetch_picture(client, path, picture_of(flags.job), flags.job.output);
    return fetched ? kDone : complain("submit", fetched.error());
  }
  return code;
}

int run(const SubmitFlags& flags) {
  auto request = request_of(flags);
  if (!request) {
    complain("submit", request.error());
    return request_fault_code(request.error(), flags.job);
  }
  if (flags.job.threads != 0) {
    std::fprintf(stderr, "note: --threads has no effect; it is for `tessera render`\n");
  }
  auto client = ApiClient::connect(flags.server.url, flags.server.key);
  if (!client) {
    return complain("submit", client.error());
  }
  if (const auto uploaded = upload_files(**client, flags, *request); !uploaded) {
    return complain("submit", uploaded.error());
  }
  const auto job = post_job(**client, *request);
  if (!job) {
    return complain("submit", job.error());
  }
  tell_warnings(*job);
  const std::string id = text_at(*job, "id");
  if (flags.wait || !flags.job.output.empty()) {
    if (!flags.job.json && flags.job.output != "-") {
      std::printf("%s\n", id.c_str());
      if (std::fflush(stdout) != 0) {
        std::fprintf(stderr, "tessera submit: the job is %s\n", id.c_str());
      }
    }
    return wait_for(**client, flags, "/v1/jobs/" + core::percent_encode(id),
                    job->value("warnings", Json()));
  }
  std::printf("%s\n", flags.job.json ? job->dump(2).c_str() : id.c_str());
  if (std::fflush(stdout) != 0) {
    std::fprintf(stderr, "tessera submit: the job is %s\n", id.c_str());
  }
  return kDone;
}

}  // namespace

std::string idempotency_key() {
  std::random_device device;
  char text[40];
  std::snprintf(text, sizeof text, "cli-%08x%08x%08x", device(), device(), device());
  return text;
}

int submit(const Args& args) {
  CLI::App app(
      "Submits a job and prints its id. With --wait or -o, waits until the job has finished.",
      "tessera submit");
  SubmitFlags flags;
  add_job_flags(app, flags.job,
                "Built-in scene, scene id, a .glb, .gltf or .zip file, or a folder with a model");
  app.add_flag("--wait", flags.wait,
               "Wait until the job has ended; exit code 1 if it did not finish");
  app.add_option("--name", flags.name, "Display name of the job")->type_name("TEXT");
  app.add_option("--label", flags.labels, "Label for finding the job; may be repeated")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  app.add_option("--priority", flags.priority, "-100 to 100; higher is served first")
      ->check(within(-api::limits::kPriority, api::limits::kPriority))
      ->type_name("N");
  add_server_flags(app, flags.server);
  return parse_and_run(app, args, [&] { return run(flags); });
}

}  // namespace cli
