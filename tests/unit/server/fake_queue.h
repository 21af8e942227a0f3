/// The queue of units, in memory.
#pragma once

#include <string>
#include <vector>

#include "core/base/mutex.h"
#include "server/queue/unit_queue.h"

namespace test_support {

class FakeQueue final : public queue::UnitQueue {
 public:
  /// While it is down, no client reaches it; then it has lost everything.
  void set_up(bool is_up);
  /// Returns the names published since the last call.
  std::vector<std::string> take_published();
  /// Returns the workers asked to report since the last call.
  std::vector<std::string> take_requests();

  std::string name() const override { return "memory"; }
  bool is_connected() const override;
  std::uint64_t generation() const override;
  core::Status prepare(std::chrono::milliseconds silence) override;
  core::Status publish(std::string_view unit) override;
  core::Result<std::uint64_t> messages() override;
  void request_report(const std::string& worker) override;

 private:
  mutable core::Mutex mutex_;
  bool is_up_ GUARDED_BY(mutex_) = true;
  std::uint64_t generation_ GUARDED_BY(mutex_) = 1;
  std::uint64_t messages_ GUARDED_BY(mutex_) = 0;
  std::vector<std::string> published_ GUARDED_BY(mutex_);
  std::vector<std::string> requests_ GUARDED_BY(mutex_);
};

}  // namespace test_support
