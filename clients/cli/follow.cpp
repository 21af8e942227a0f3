#include "clients/cli/follow.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "clients/cli/job_json.h"
#include "clients/cli/progress.h"
#include "core/base/file_names.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;
using Clock = std::chrono::steady_clock;

// The server pings every 15 s: after three missing pings the connection counts as lost.
constexpr std::chrono::seconds kSilenceMax{45};
constexpr std::chrono::seconds kGiveUpAfter{60};

/// Follows one connection. Returns true if the job has ended.
core::Result<bool> follow_once(ApiClient& client, const std::string& path, const Follower& follower,
                               EventParser& parser) {
  ApiClient::Headers headers = {{"Accept", "text/event-stream"}};
  if (!parser.last_id().empty()) {
    headers.emplace("Last-Event-ID", parser.last_id());
  }
  bool ended = false;
  const auto status =
      client.stream(path + "/events", headers, kSilenceMax, [&](std::string_view piece) {
        for (const ServerEvent& event : parser.feed(piece)) {
          follower.on_event(event);
          ended = ended || event.type == "end";
        }
        return !ended;
      });
  parser.restart();
  if (!status) {
    return status.error();
  }
  return ended || *status == 204;
}

}  // namespace

core::Result<Json> get_json(ApiClient& client, const std::string& path) {
  auto reply = client.get(path);
  if (!reply) {
    return reply.error();
  }
  return parse_object(reply->body);
}

core::Result<std::string> job_path(ApiClient& client, const std::string& id) {
  if (id != "latest") {
    return "/v1/jobs/" + core::percent_encode(id);
  }
  auto reply = client.get("/v1/jobs?class=normal&limit=1");
  if (!reply) {
    return reply.error();
  }
  const Json list = parse_object(reply->body);
  const auto jobs = list.find("jobs");
  if (jobs == list.end() || !jobs->is_array() || jobs->empty()) {
    return Error{ErrorCode::kNotFound, "the server at " + client.url() + " has no jobs", ""};
  }
  return "/v1/jobs/" + text_at(jobs->front(), "id");
}

int with_job(const char* verb, const ServerFlags& server, const std::string& id,
             const std::function<core::Status(ApiClient& client, const std::string& path)>& run) {
  const auto client = ApiClient::connect(server.url, server.key);
  const auto path = client ? job_path(**client, id) : core::Result<std::string>(client.error());
  const auto status = path ? run(**client, *path) : core::Status(path.error());
  return status ? kDone : complain(verb, status.error());
}

core::Result<Json> follow_job(ApiClient& client, const std::string& path,
                              const Follower& follower) {
  EventParser parser;
  auto last_contact = Clock::now();
  bool told = false;
  while (true) {
    const std::string before = parser.last_id();
    const auto ended = follow_once(client, path, follower, parser);
    if (ended && *ended) {
      return get_json(client, path);
    }
    if (!ended && ended.error().code != ErrorCode::kUnavailable) {
      return ended.error();
    }
    if (ended) {
      last_contact = Clock::now();  // the stream ended early: the server is shutting down
    } else if (Clock::now() - last_contact > kGiveUpAfter || parser.last_id().empty()) {
      return ended.error();
    }
    told = told && parser.last_id() == before;
    if (!told) {
      follower.on_trouble("connection lost; trying again");
      told = true;
    }
    const auto pause =
        std::chrono::milliseconds(std::clamp(parser.retry_ms().value_or(1000), 100, 10000));
    std::this_thread::sleep_for(pause);
  }
}

core::Result<Json> follow_with_progress(ApiClient& client, const std::string& path,
                                        std::FILE* out) {
  ProgressPrinter printer(out);
  Json job = Json::object();
  Follower follower;
  follower.on_event = [&](const ServerEvent& event) {
    const Json data = parse_object(event.data);
    if (event.type == "warning") {
      printer.say("warning: " + text_at(data, "message"));
    } else if (event.type == "snapshot" || event.type == "progress" || event.type == "state") {
      job.update(data);
      if (!is_final_state(text_at(job, "state"))) {
        printer.show(facts_of(job));
      }
    }
  };
  follower.on_trouble = [&](const std::string& text) { printer.say(text); };
  return follow_job(client, path, follower);
}

}  // namespace cli
