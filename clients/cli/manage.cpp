// The verbs that look after jobs: jobs, cancel, health.
#include <algorithm>
#include <cstdio>
#include <vector>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"

namespace cli {
namespace {

struct ListFlags {
  std::vector<std::string> states;
  std::vector<std::string> labels;
  std::string name;
  int limit = 20;
  bool previews = false;
  bool json = false;
};

void print_table(const Json& list) {
  std::printf("%-36s  %-9s  %5s  %8s  %10s  %9s  %s\n", "ID", "STATE", "DONE", "SAMPLES", "ERROR",
              "TIME", "SCENE");
  for (const Json& job : list) {
    const ProgressFacts facts = facts_of(job);
    const Json& spec = object_in(job, "spec");
    const std::string name = text_at(spec, "name");
    const std::string scene = text_at(spec, "scene");
    std::printf("%-36s  %-9s  %3d %%  %8.0f  %10s  %9s  %s\n", text_at(job, "id").c_str(),
                facts.state.c_str(), static_cast<int>(facts.fraction * 100),
                facts.samples_per_pixel, error_text(facts.relative_error).c_str(),
                duration_text(facts.elapsed_seconds).c_str(),
                name.empty() ? scene.substr(0, 24).c_str() : name.c_str());
  }
}

int list_jobs(const ServerFlags& server, const ListFlags& flags) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("jobs", client.error());
  }
  Json all = Json::array();
  std::string cursor;
  do {
    const int left = flags.limit - static_cast<int>(all.size());
    std::string path = std::string("/v1/jobs?") + (flags.previews ? "" : "class=normal&") +
                       "limit=" + std::to_string(std::min(left, 200));
    for (const std::string& state : flags.states) {
      path += "&state=" + encode_url(state);
    }
    for (const std::string& label : flags.labels) {
      path += "&label=" + encode_url(label);
    }
    path += flags.name.empty() ? "" : "&name=" + encode_url(flags.name);
    path += cursor.empty() ? "" : "&cursor=" + encode_url(cursor);
    const auto reply = (*client)->get(path);
    if (!reply) {
      return complain("jobs", reply.error());
    }
    Json page = parse_object(reply->body);
    for (Json& job : page["jobs"]) {
      all.push_back(std::move(job));
    }
    cursor = text_at(page, "next");
  } while (!cursor.empty() && static_cast<int>(all.size()) < flags.limit);
  if (flags.json) {
    std::printf("%s\n", Json{{"jobs", all}}.dump(2).c_str());
  } else if (all.empty()) {
    std::fprintf(stderr, "no jobs\n");
  } else {
    print_table(all);
  }
  return kDone;
}

int cancel_jobs(const ServerFlags& server, const std::vector<std::string>& ids) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("cancel", client.error());
  }
  int code = kDone;
  for (const std::string& id : ids) {
    const auto path = job_path(**client, id);
    const auto reply = path ? (*client)->post(*path + "/cancel", "", "application/json")
                            : core::Result<Reply>(path.error());
    if (!reply) {
      code = complain("cancel", reply.error());
      continue;
    }
    const Json job = parse_object(reply->body);
    std::printf("%s %s\n", text_at(job, "id", id).c_str(), text_at(job, "state").c_str());
  }
  return code;
}

}  // namespace

int jobs(const Args& args) {
  CLI::App app("Lists the jobs of a server, newest first.", "tessera jobs");
  ServerFlags server;
  ListFlags flags;
  app.add_option("--state", flags.states,
                 "Only queued, loading, rendering, paused, finished, failed, cancelled")
      ->type_name("STATE")
      ->allow_extra_args(false);
  app.add_option("--label", flags.labels, "Only with this label: KEY or KEY=VALUE")
      ->type_name("LABEL")
      ->allow_extra_args(false);
  app.add_option("--name", flags.name, "Only with this in its name, small letters or large")
      ->type_name("TEXT");
  app.add_flag("--previews", flags.previews, "The small pictures of those who place a camera, too");
  app.add_option("--limit", flags.limit, "At most so many")
      ->check(CLI::Range(1, 100000).description(""))
      ->type_name("N")
      ->capture_default_str();
  app.add_flag("--json", flags.json, "Print the jobs as JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return list_jobs(server, flags); });
}

int cancel(const Args& args) {
  CLI::App app("Cancels jobs; what has been rendered is kept.", "tessera cancel");
  ServerFlags server;
  std::vector<std::string> ids;
  app.add_option("id", ids, "Jobs")->required()->type_name("ID...");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return cancel_jobs(server, ids); });
}

int health(const Args& args) {
  CLI::App app("Asks a server whether it is ready for requests.", "tessera health");
  ServerFlags server;
  bool insecure = false;
  add_server_flags(app, server);
  app.add_flag("--insecure", insecure, "Take any certificate, and send no key");
  return parse_and_run(app, args, [&] {
    auto client = insecure ? ApiClient::connect(server.url, "", ApiClient::Certificates::kAnyTaken)
                           : ApiClient::connect(server.url, server.key);
    const auto reply = client ? (*client)->get("/readyz") : core::Result<Reply>(client.error());
    if (!reply) {
      return complain("health", reply.error());
    }
    std::printf("ready\n");
    return kDone;
  });
}

}  // namespace cli
