#include <cstdio>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"

namespace cli {
namespace {

/// Every event as a line of JSON: {"event": "progress", "data": {...}}.
core::Result<Json> follow_as_json(ApiClient& client, const std::string& path) {
  Follower follower;
  follower.on_event = [](const ServerEvent& event) {
    const Json line = {{"event", event.type}, {"data", parse_object(event.data)}};
    std::printf("%s\n", line.dump().c_str());
    std::fflush(stdout);
  };
  follower.on_trouble = [](const std::string& text) { std::fprintf(stderr, "%s\n", text.c_str()); };
  return follow_job(client, path, follower);
}

int run(const ServerFlags& server, const std::string& id, bool json) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("watch", client.error());
  }
  const auto path = job_path(**client, id);
  if (!path) {
    return complain("watch", path.error());
  }
  const auto job = json ? follow_as_json(**client, *path) : follow_with_progress(**client, *path, stdout);
  if (!job) {
    return complain("watch", job.error());
  }
  if (!json) {
    std::printf("%s\n", closing_text(*job).c_str());
  }
  return exit_code_of(*job);
}

}  // namespace

int watch(const Args& args) {
  CLI::App app("Follows a job until it ends. Exit code 0 if it finished, 1 if it failed or was cancelled.",
               "tessera watch");
  ServerFlags server;
  std::string id = "latest";
  bool json = false;
  app.add_option("id", id, "Job; without one the newest")->type_name("ID");
  app.add_flag("--json", json, "Print every event as a line of JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return run(server, id, json); });
}

}  // namespace cli
