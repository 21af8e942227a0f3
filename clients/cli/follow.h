/// Follows a job to its end over its event stream, through lost connections and restarts.
#pragma once

#include <functional>
#include <string>

#include "clients/cli/api_client.h"
#include "clients/cli/job_flags.h"
#include "clients/cli/sse.h"

namespace cli {

/// Percent-encoded path of a job; "latest" is the newest one of the server.
core::Result<std::string> job_path(ApiClient& client, const std::string& id);

struct Follower {
  std::function<void(const ServerEvent&)> on_event;    ///< each one, as it comes
  std::function<void(const std::string&)> on_trouble;  ///< a sentence: lost, trying again
};

/// The job as it stands at its end. Gives up when the server cannot be reached for a minute.
core::Result<Json> follow_job(ApiClient& client, const std::string& path, const Follower& follower);

/// follow_job() with a progress bar (or lines) on `out`; warnings are shown.
core::Result<Json> follow_with_progress(ApiClient& client, const std::string& path, std::FILE* out);

}  // namespace cli
