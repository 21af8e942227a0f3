#include "server/observe/cpu_meter.h"

#include <utility>

#include <sys/resource.h>

#include "core/base/cpu_time.h"

namespace server {
namespace {

double own_and_children_seconds() {
  rusage used = {};
  ::getrusage(RUSAGE_CHILDREN, &used);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return core::thread_cpu_seconds() + seconds(used.ru_utime) + seconds(used.ru_stime);
}

}  // namespace

CpuMeter::CpuMeter() : begin_(own_and_children_seconds()) {}

core::ParallelFor CpuMeter::counted(core::ParallelFor inner) {
  return [this, inner = std::move(inner)](int count, const std::function<void(int)>& body) {
    inner(count, [&](int i) {
      const double before = core::thread_cpu_seconds();
      body(i);
      if (std::this_thread::get_id() != thread_) {
        others_ += core::thread_cpu_seconds() - before;
      }
    });
  };
}

double CpuMeter::seconds() const { return own_and_children_seconds() + others_.load() - begin_; }

}  // namespace server
