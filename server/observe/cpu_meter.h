/// CpuMeter: CPU time of work that is divided among threads and helper processes.
#pragma once

#include <atomic>
#include <thread>

#include "core/base/parallel_for.h"

namespace server {

/// Counts from its construction; seconds() is called on the same thread.
class CpuMeter {
 public:
  CpuMeter();

  /// Returns `inner` such that the time of its bodies on other threads is counted too. Must not
  /// outlive this.
  core::ParallelFor counted(core::ParallelFor inner);
  /// CPU time of the thread, of the bodies, and of the child processes of this process that have
  /// ended: also of those that others had started.
  double seconds() const;

 private:
  const std::thread::id thread_ = std::this_thread::get_id();
  const double begin_;
  std::atomic<double> others_ = 0;
};

}  // namespace server
