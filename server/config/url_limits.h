/// Bounds on the jobs that URLs of images start, so that those who look at images never fill the
/// queue or the quota of those who publish them.
#pragma once

#include <algorithm>

#include "server/config/config.h"

namespace server {

/// Unfinished at a time. A turntable of 36 images in two sizes is 72: it takes two visits.
inline constexpr int kUrlJobsOfPreset = 64;

/// Half of what the queue and the tenant's quota hold, at least one.
inline int url_jobs_of_tenant(const Config& config) {
  const int most =
      config.quota_jobs > 0 ? std::min(config.quota_jobs, config.queue_max) : config.queue_max;
  return std::max(most / 2, 1);
}

}  // namespace server
