/// Derives the options of the job service from the configuration.
#pragma once

#include <functional>
#include <map>
#include <string>

#include "api/answers/server_view.h"
#include "core/base/result.h"
#include "server/config/about.h"
#include "server/config/config.h"
#include "server/jobs/job_service.h"

namespace server {

/// At least 1.
int render_threads(const Config& config);
/// As core::Converters::commands.
std::map<std::string, std::string, std::less<>> converter_commands(const Config& config);
/// Connects to the queue, if there is one; if it is unreachable, keeps trying in the background.
/// Errors, with where "--queue": an invalid address, an unsupported server.
core::Result<JobServiceOptions> job_options(const Config& config, const MemoryLimits& memory,
                                            const api::ServerView& about);

}  // namespace server
