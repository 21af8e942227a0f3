/// WorkUnit: a set of slices of one job, and the workers that render them.
#pragma once

#include <algorithm>
#include <chrono>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "core/render/units/slice_work.h"

namespace server {

class Job;
class RenderRun;

struct WorkUnit {
  using Clock = std::chrono::steady_clock;
  struct Lease {
    std::string worker;
    Clock::time_point since;
    Clock::time_point until;
    double progress = 0;  ///< CPU seconds, as last reported.
  };
  /// One of two results, kept until the other arrives or a dispute is settled.
  struct Result {
    std::string worker;
    std::string digest;
    std::vector<core::SliceWork> work;
    Clock::time_point at;
  };

  std::shared_ptr<RenderRun> run;
  std::weak_ptr<Job> job;
  std::vector<core::Slice> slices;
  double pixel_samples = 0;     ///< Of the slices.
  double expected_seconds = 0;  ///< CPU time.
  bool is_checked = false;      ///< Needs two results, which must be equal.
  int copies = 1;               ///< Number of workers intended to render it.
  int published = 0;            ///< Messages published for workers that have not leased it yet.
  Clock::time_point published_at;
  std::vector<Lease> leases;
  std::optional<Result> first;
  std::optional<Result> other;    ///< Differs from the first.
  bool is_busy = false;           ///< A result is being taken, or this process renders the unit.
  std::stop_source own;           ///< Stops this process from rendering the unit.
  std::set<std::string> lost;     ///< Workers that took it and did not report in time.
  std::set<std::string> refused;  ///< Workers that could not render it, or sent an invalid result.

  /// Returns the number of further workers that it needs.
  int wanted() const {
    return is_busy ? 0 : copies - static_cast<int>(leases.size()) - (first ? 1 : 0);
  }
  std::vector<Lease>::iterator lease_of(const std::string& worker) {
    return std::find_if(leases.begin(), leases.end(),
                        [&worker](const Lease& lease) { return lease.worker == worker; });
  }
  bool has_failed(const std::string& worker) const {
    return lost.contains(worker) || refused.contains(worker);
  }
  bool has_lease(const std::string& worker) const {
    return std::any_of(leases.begin(), leases.end(),
                       [&worker](const Lease& lease) { return lease.worker == worker; });
  }
  void drop_lease(const std::string& worker) {
    std::erase_if(leases, [&worker](const Lease& lease) { return lease.worker == worker; });
  }
};

}  // namespace server
