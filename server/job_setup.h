/// What the service of jobs is set up with, from what the operator chose.
#pragma once

#include "api/server_view.h"
#include "core/base/result.h"
#include "server/about.h"
#include "server/config.h"
#include "server/jobs/job_service.h"

namespace server {

/// At least 1.
int render_threads(const Config& config);
/// Connects to the queue, if there is one; one that cannot be reached is waited for. Errors, with
/// where "--queue": an address that is none, a server that is not used.
core::Result<JobServiceOptions> job_options(const Config& config, const MemoryLimits& memory,
                                            const api::ServerView& about);

}  // namespace server
