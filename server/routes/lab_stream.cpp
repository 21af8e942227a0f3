#include "server/routes/lab_stream.h"

#include <chrono>
#include <exception>
#include <thread>
#include <utility>

#include <unistd.h>

namespace server {
namespace {

/// Experiments run at a lower priority than renders.
constexpr int kNiceness = 10;
constexpr std::chrono::seconds kLabPoll{1};

}  // namespace

void LabStream::push(std::string line) {
  {
    const core::MutexLock lock(mutex_);
    lines_ += line;
    lines_ += '\n';
  }
  changed_.notify_all();
}

void LabStream::compute(const std::stop_token& stop) {
  // Applies to this thread alone, on Linux; without the right to change it, the run keeps the
  // normal priority.
  [[maybe_unused]] const int priority = ::nice(kNiceness);
  const auto outcome =
      core::lab::run(request_.setup, request_.options, stop, [this](const core::lab::Point& point) {
        push(api::lab_point_json(point));
        return true;
      });
  if (outcome) {
    push(api::lab_outcome_json(request_, *outcome));
  }
}

std::string LabStream::next(const std::stop_token& stop) {
  const core::MutexLock lock(mutex_);
  // The predicate runs with the lock held, which the thread-safety analysis cannot see.
  const auto ready = [&]()
                         TESSERA_TS(no_thread_safety_analysis) { return done_ || !lines_.empty(); };
  while (!ready() && !stop.stop_requested()) {
    changed_.wait_for(mutex_, stop, kLabPoll, ready);
  }
  return std::exchange(lines_, {});
}

void LabStream::run(StreamWriter& writer) {
  std::exception_ptr failure;
  {
    std::jthread thread([this, &failure](const std::stop_token& stop) {
      try {
        compute(stop);
      } catch (const std::exception&) {
        failure = std::current_exception();
      }
      {
        const core::MutexLock lock(mutex_);
        done_ = true;
      }
      changed_.notify_all();
    });
    const std::stop_token stop = writer.stop_token();
    for (std::string lines = next(stop); !lines.empty(); lines = next(stop)) {
      if (!writer.write(lines)) {
        break;
      }
    }
    thread.request_stop();
  }
  if (failure) {
    std::rethrow_exception(failure);
  }
  if (writer.stopping()) {
    writer.write(api::lab_cancelled_json() + "\n");
  }
}

}  // namespace server
