/// CpuMeter: CPU time of work that is divided among threads and helper processes.
#pragma once

#include <atomic>
#include <functional>
#include <thread>

namespace server {

/// Calls body(0) to body(count - 1) on any threads, as core::ParallelFor.
using ParallelFor = std::function<void(int count, const std::function<void(int)>& body)>;

/// Counts from its construction; seconds() is called on the same thread.
class CpuMeter {
 public:
  CpuMeter();

  /// Returns `inner` such that the time of its bodies on other threads is counted too. Must not
  /// outlive this.
  ParallelFor counted(ParallelFor inner);
  /// CPU time of the thread, of the bodies, and of the child processes of this process that have
  /// ended: also of those that others had started.
  double seconds() const;

 private:
  const std::thread::id thread_ = std::this_thread::get_id();
  const double begin_;
  std::atomic<double> others_ = 0;
};

}  // namespace server
