/// Follows a job to its end over its event stream, across lost connections and restarts.
#pragma once

#include <functional>
#include <string>

#include "clients/cli/api_client.h"
#include "clients/cli/command.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/sse.h"

namespace cli {

/// Returns the percent-encoded path of a job; "latest" is the newest job of the server.
core::Result<std::string> job_path(ApiClient& client, const std::string& id);

/// Returns the JSON object at a path.
core::Result<Json> get_json(ApiClient& client, const std::string& path);

/// Connects, finds the path of a job and runs with them. Returns the exit code, and complains about
/// the error of any of these as `verb`.
int with_job(const char* verb, const ServerFlags& server, const std::string& id,
             const std::function<core::Status(ApiClient& client, const std::string& path)>& run);

struct Follower {
  std::function<void(const ServerEvent&)> on_event;  ///< called for each event
  std::function<void(const std::string&)>
      on_trouble;  ///< called with a sentence: connection lost, retrying
};

/// Returns the job after it has ended. Gives up when the server is unreachable for a minute.
core::Result<Json> follow_job(ApiClient& client, const std::string& path, const Follower& follower);

/// Runs follow_job() with a progress bar (or lines) on `out`, and shows warnings.
core::Result<Json> follow_with_progress(ApiClient& client, const std::string& path, std::FILE* out);

}  // namespace cli
