#include "tests/unit/server/fake_queue.h"

#include <utility>

namespace test_support {
namespace {

core::Error unreachable() {
  return {core::ErrorCode::kUnavailable, "no connection to the queue", ""};
}

}  // namespace

void FakeQueue::set_up(bool is_up) {
  const core::MutexLock lock(mutex_);
  if (is_up && !is_up_) {
    messages_ = 0;
    ++generation_;
  }
  is_up_ = is_up;
}

std::vector<std::string> FakeQueue::take_published() {
  const core::MutexLock lock(mutex_);
  return std::exchange(published_, {});
}

std::vector<std::string> FakeQueue::take_requests() {
  const core::MutexLock lock(mutex_);
  return std::exchange(requests_, {});
}

bool FakeQueue::is_connected() const {
  const core::MutexLock lock(mutex_);
  return is_up_;
}

std::uint64_t FakeQueue::generation() const {
  const core::MutexLock lock(mutex_);
  return generation_;
}

core::Status FakeQueue::prepare(std::chrono::milliseconds /*silence*/) {
  const core::MutexLock lock(mutex_);
  return is_up_ ? core::ok_status() : unreachable();
}

core::Status FakeQueue::publish(std::string_view unit) {
  const core::MutexLock lock(mutex_);
  if (!is_up_) {
    return unreachable();
  }
  ++messages_;
  published_.emplace_back(unit);
  return core::ok_status();
}

core::Result<std::uint64_t> FakeQueue::messages() {
  const core::MutexLock lock(mutex_);
  return is_up_ ? core::Result<std::uint64_t>(messages_) : unreachable();
}

void FakeQueue::request_report(const std::string& worker) {
  const core::MutexLock lock(mutex_);
  requests_.push_back(worker);
}

}  // namespace test_support
