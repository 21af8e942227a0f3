/// WorkUnit: some slices of one job, and the workers that render them.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "core/render/slice_work.h"
#include "server/jobs/job.h"

namespace server {

struct WorkUnit {
  using Clock = std::chrono::steady_clock;
  struct Lease {
    std::string worker;
    Clock::time_point since;
    Clock::time_point until;
    double progress = 0;  ///< CPU seconds, as last reported.
  };
  /// What the first of two workers brought, until the other one's is in.
  struct Result {
    std::string worker;
    std::string digest;
    std::vector<core::SliceWork> work;
    Clock::time_point at;
  };

  std::shared_ptr<RenderRun> run;
  std::vector<core::Slice> slices;
  double expected_seconds = 0;  ///< CPU time.
  bool is_checked = false;      ///< Two results are wanted, which have to be equal.
  int copies = 1;               ///< Workers that are to render it.
  int published = 0;            ///< Messages that are out, for workers that are still to come.
  Clock::time_point published_at;
  std::vector<Lease> leases;
  std::optional<Result> first;
  bool is_busy = false;        ///< A result is being taken.
  std::set<std::string> lost;  ///< Workers that it was lost with.
  int losses = 0;              ///< Of all of them.

  /// Workers that it waits for.
  int wanted() const {
    return is_busy ? 0 : copies - static_cast<int>(leases.size()) - (first ? 1 : 0);
  }
  std::vector<Lease>::iterator lease_of(const std::string& worker) {
    return std::find_if(leases.begin(), leases.end(),
                        [&worker](const Lease& lease) { return lease.worker == worker; });
  }
  bool has_lease(const std::string& worker) const {
    return std::any_of(leases.begin(), leases.end(),
                       [&worker](const Lease& lease) { return lease.worker == worker; });
  }
};

}  // namespace server
