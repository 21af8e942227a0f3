// The verbs that show or change jobs: show, pause, resume, cancel, retry, extend, delete.
#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/follow.h"
#include "clients/cli/job_json.h"
#include "clients/cli/member_flags.h"
#include "clients/cli/progress.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

/// Sends a request for each job in turn; a job in the response is printed with its state.
using Ask = std::function<core::Result<Reply>(ApiClient&, const std::string& path)>;
int each_job(const char* verb, const ServerFlags& server, const std::vector<std::string>& ids,
             const Ask& ask) {
  auto client = ApiClient::connect(server.url, server.key);
  if (!client) {
    return complain(verb, client.error());
  }
  int code = kDone;
  for (const std::string& id : ids) {
    const auto path = job_path(**client, id);
    const auto reply = path ? ask(**client, *path) : core::Result<Reply>(path.error());
    if (!reply) {
      code = complain(verb, reply.error());
      continue;
    }
    const Json job = parse_object(reply->body);
    std::printf("%s %s\n", text_at(job, "id", id).c_str(),
                text_at(job, "state", "deleted").c_str());
  }
  return code;
}

int steering_verb(const char* verb, const char* words, const Args& args, const Ask& ask) {
  CLI::App app(words, std::string("tessera ") + verb);
  ServerFlags server;
  std::vector<std::string> ids;
  app.add_option("id", ids, "Jobs")->required()->type_name("ID...");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return each_job(verb, server, ids, ask); });
}

core::Result<Reply> set_paused(ApiClient& client, const std::string& path, bool is_paused) {
  return client.patch(path, Json{{"paused", is_paused}}.dump(), "application/json");
}

void line(const char* name, const std::string& value) {
  if (!value.empty()) {
    std::printf("%-10s %s\n", name, value.c_str());
  }
}

std::string whole(double value) { return std::to_string(std::llround(value)); }

std::string size_text(const Json& spec) {
  const Json& film = object_in(spec, "film");
  if (film.empty()) {
    return "none";
  }
  return whole(number_at(film, "width", 0)) + "x" + whole(number_at(film, "height", 0));
}

/// Returns the stop rules of the job as text.
std::string stop_text(const Json& spec) {
  std::string text;
  for (const auto& rule : object_in(spec, "stop").items()) {
    if (!rule.value().is_null()) {
      text += (text.empty() ? "" : ", ") + rule.key() + " " + rule.value().dump();
    }
  }
  return text;
}

/// Returns how far the search radius of sppm has shrunk; empty for other integrators.
std::string radius_text(const Json& job) {
  const double ratio = number_at(object_in(job, "statistics"), "radius_ratio", 0);
  return ratio > 0 ? error_text(ratio) + " of the first sample's" : "";
}

void print_job(const Json& job) {
  const Json& spec = object_in(job, "spec");
  const ProgressFacts facts = facts_of(job);
  line("job", text_at(job, "id"));
  line("name", text_at(spec, "name"));
  line("scene", text_at(spec, "scene"));
  line("variant", text_at(spec, "variant"));
  line("size", size_text(spec));
  line("integrator", text_at(object_in(spec, "integrator"), "type"));
  line("stop", stop_text(spec));
  line("state", is_final_state(facts.state) ? closing_text(job) : progress_text(facts));
  line("radius", radius_text(job));
  line("digest", text_at(job, "film_digest"));
  if (const auto warnings = job.find("warnings"); warnings != job.end() && warnings->is_array()) {
    for (const Json& warning : *warnings) {
      line("warning", warning.is_string() ? warning.get<std::string>() : "");
    }
  }
}

int show_job(const ServerFlags& server, const std::string& id, bool as_json) {
  return with_job("show", server, id, [as_json](ApiClient& client, const std::string& path) {
    const auto job = get_json(client, path);
    if (!job) {
      return core::Status(job.error());
    }
    if (as_json) {
      std::printf("%s\n", job->dump(2).c_str());
    } else {
      print_job(*job);
    }
    return core::ok_status();
  });
}

struct ExtendFlags {
  ServerFlags server;
  std::string id;
  MemberValues rules;
};

int extend_job(const ExtendFlags& flags) {
  if (flags.rules.empty()) {
    complain("extend", Error{ErrorCode::kInvalidArgument,
                             "give at least one of --samples, --relative-error, --denoised-error, "
                             "--meter-error, --light-not-found, --seconds or --cpu-seconds",
                             ""});
    return kWrongUsage;
  }
  Json request = Json::object();
  put(request, flags.rules);
  const std::string body = request.dump();
  return each_job("extend", flags.server, {flags.id},
                  [&](ApiClient& client, const std::string& path) {
                    return client.post(path + "/extend", body, "application/json");
                  });
}

}  // namespace

int show(const Args& args) {
  CLI::App app("Shows a job: its request, progress and error.", "tessera show");
  ServerFlags server;
  std::string id = "latest";
  bool as_json = false;
  app.add_option("id", id, "Job (the newest)")->type_name("ID");
  app.add_flag("--json", as_json, "Print the job as JSON");
  add_server_flags(app, server);
  return parse_and_run(app, args, [&] { return show_job(server, id, as_json); });
}

int pause_jobs(const Args& args) {
  return steering_verb(
      "pause", "Pauses jobs; their images so far are kept.", args,
      [](ApiClient& client, const std::string& path) { return set_paused(client, path, true); });
}

int resume_jobs(const Args& args) {
  return steering_verb(
      "resume", "Resumes paused jobs.", args,
      [](ApiClient& client, const std::string& path) { return set_paused(client, path, false); });
}

int cancel(const Args& args) {
  return steering_verb("cancel", "Cancels jobs; their images so far are kept.", args,
                       [](ApiClient& client, const std::string& path) {
                         return client.post(path + "/cancel", "", "application/json");
                       });
}

int retry(const Args& args) {
  return steering_verb("retry",
                       "Queues failed jobs again, from their last checkpoints, and doubted ones, "
                       "whose images may be wrong, from their beginning.",
                       args, [](ApiClient& client, const std::string& path) {
                         return client.post(path + "/retry", "", "application/json");
                       });
}

int delete_jobs(const Args& args) {
  return steering_verb(
      "delete", "Deletes jobs that have ended, with their files.", args,
      [](ApiClient& client, const std::string& path) { return client.remove(path); });
}

int extend(const Args& args) {
  CLI::App app(
      "Extends a finished job to more samples, a lower error or more time; all rules count from "
      "the beginning of the job.",
      "tessera extend");
  ExtendFlags flags;
  app.add_option("id", flags.id, "Job")->required()->type_name("ID");
  add_member_flags(app, stop_flags(), flags.rules, /*has_standards=*/false);
  add_server_flags(app, flags.server);
  return parse_and_run(app, args, [&] { return extend_job(flags); });
}

}  // namespace cli
