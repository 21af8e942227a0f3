/// UnitPlanner: cuts the next unit of work from the jobs that are rendering.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "server/jobs/scheduler.h"
#include "server/workers/work_unit.h"

namespace server {

class UnitPlanner {
 public:
  /// Shortest CPU time of a unit, at the end of a pass: ten times the cost of leasing it and taking
  /// its result, at a round trip of 10 ms.
  static constexpr double kSecondsLeast = 0.1;

  struct Named {
    std::string name;
    WorkUnit unit;
  };
  /// run_name: distinguishes units from those of other processes. scheduler must outlive it.
  UnitPlanner(Scheduler& scheduler, std::string run_name)
      : scheduler_(scheduler), run_name_(std::move(run_name)) {}

  /// Takes slices of the job whose turn it is. slots: threads of the workers, at least 1. Empty if
  /// no job has any now.
  std::optional<Named> next(int slots);

 private:
  Scheduler& scheduler_;
  const std::string run_name_;
  std::uint64_t last_ = 0;
};

}  // namespace server
