// The verbs that manage jobs: jobs, cancel, retry, drain, health.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <string>
#include <thread>
#include <vector>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"
#include "clients/cli/shown.h"
#include "core/base/file_names.h"

namespace cli {
namespace {

constexpr std::chrono::milliseconds kDrainPoll{500};

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
              "TIME", "NAME");
  for (const Json& job : list) {
    const ProgressFacts facts = facts_of(job);
    const Json& spec = object_in(job, "spec");
    const std::string name = text_at(spec, "name");
    const std::string scene = text_at(spec, "scene");
    std::printf("%-36s  %-9s  %4d%%  %8.0f  %10s  %9s  %s\n", text_at(job, "id").c_str(),
                facts.state.c_str(), static_cast<int>(facts.fraction * 100),
                facts.samples_per_pixel,
                (error_text(facts.relative_error) + (facts.is_unreliable ? "?" : "")).c_str(),
                duration_text(facts.elapsed_seconds).c_str(),
                shown(name.empty() ? scene.substr(0, 24) : name).c_str());
  }
}

int list_jobs(const ServerFlags& server, const ListFlags& flags) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("jobs", client.error());
  }
  Json all = Json::array();
  Json damaged = Json::array();
  std::string cursor;
  do {
    const int left = flags.limit - static_cast<int>(all.size());
    std::string path = std::string("/v1/jobs?") + (flags.previews ? "class=all&" : "") +
                       "limit=" + std::to_string(std::min(left, 200));
    for (const std::string& state : flags.states) {
      path += "&state=" + core::percent_encode(state);
    }
    for (const std::string& label : flags.labels) {
      path += "&label=" + core::percent_encode(label);
    }
    path += flags.name.empty() ? "" : "&name=" + core::percent_encode(flags.name);
    path += cursor.empty() ? "" : "&cursor=" + core::percent_encode(cursor);
    const auto reply = (*client)->get(path);
    if (!reply) {
      return complain("jobs", reply.error());
    }
    Json page = parse_object(reply->body);
    for (Json& job : page["jobs"]) {
      all.push_back(std::move(job));
    }
    for (Json& id : page["damaged"]) {
      damaged.push_back(std::move(id));
    }
    cursor = text_at(page, "next");
  } while (!cursor.empty() && static_cast<int>(all.size()) < flags.limit);
  if (flags.json) {
    std::printf("%s\n", Json{{"jobs", all}, {"damaged", damaged}}.dump(2).c_str());
  } else if (all.empty()) {
    std::fprintf(stderr, "no jobs\n");
  } else {
    print_table(all);
  }
  for (const Json& id : damaged) {
    std::fprintf(stderr, "tessera jobs: the record of %s is damaged; `tessera delete` removes it\n",
                 shown(id.get<std::string>()).c_str());
  }
  return kDone;
}

int drain_server(const ServerFlags& server, bool ends, bool waits) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain("drain", client.error());
  }
  auto reply =
      ends ? (*client)->remove("/v1/drain") : (*client)->put("/v1/drain", "", "application/json");
  while (true) {
    if (!reply) {
      return complain("drain", reply.error());
    }
    const Json state = parse_object(reply->body);
    if (!waits || number_at(state, "running", 0) == 0) {
      std::printf("%s\n", state.dump().c_str());
      return kDone;
    }
    std::this_thread::sleep_for(kDrainPoll);
    reply = (*client)->get("/v1/drain");
  }
}

}  // namespace

int jobs(const Args& args) {
  CLI::App app("Lists the jobs of a server, newest first.", "tessera jobs");
  ServerFlags server;
  ListFlags flags;
  app.add_option(
         "--state", flags.states,
         "Only jobs in this state: queued, loading, rendering, paused, finished, failed, cancelled")
      ->type_name("STATE")
      ->allow_extra_args(false);
  app.add_option("--label", flags.labels, "Only jobs with this label: KEY or KEY=VALUE")
      ->type_name("LABEL")
      ->allow_extra_args(false);
  app.add_option("--name", flags.name, "Only jobs whose name contains TEXT (case-insensitive)")
      ->type_name("TEXT");
  app.add_flag("--previews", flags.previews, "Include camera-preview jobs");
  app.add_option("--limit", flags.limit, "Maximum number of jobs to list")
      ->check(CLI::Range(1, 100000).description(""))
      ->type_name("N")
      ->capture_default_str();
  app.add_flag("--json", flags.json, "Print the jobs as JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return list_jobs(server, flags); });
}

int drain(const Args& args) {
  CLI::App app("Makes a server refuse new jobs, while running ones continue.", "tessera drain");
  ServerFlags server;
  bool ends = false;
  bool waits = false;
  app.add_flag("--end", ends, "Accept jobs again");
  app.add_flag("--wait", waits, "Wait until no job is running")->excludes("--end");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return drain_server(server, ends, waits); });
}

int health(const Args& args) {
  CLI::App app("Checks whether a server is ready for requests.", "tessera health");
  ServerFlags server;
  bool insecure = false;
  add_server_flags(app, server);
  app.add_flag("--insecure", insecure, "Accept any certificate, and send no key");
  return parse_and_run(app, args, [&] {
    auto client = insecure ? ApiClient::connect(server.url, "", ApiClient::Certificates::kAnyTaken)
                           : ApiClient::connect(server.url, server.key);
    const auto reply = client ? (*client)->get("/readyz") : core::Result<Reply>(client.error());
    if (!reply) {
      return complain("health", reply.error());
    }
    std::fputs(reply->body.c_str(), stdout);
    return kDone;
  });
}

}  // namespace cli
