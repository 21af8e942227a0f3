// Defines the functions of server/queue that WorkBoard calls, in place of the real ones.
#include "tests/unit/server/fake_queue.h"

#include <atomic>
#include <chrono>
#include <string_view>
#include <utility>

#include "core/base/mutex.h"
#include "server/queue/units.h"

namespace test_support {
namespace {

struct Queue {
  core::Mutex mutex;
  bool is_up GUARDED_BY(mutex) = true;
  std::uint64_t messages GUARDED_BY(mutex) = 0;
  std::vector<std::string> published GUARDED_BY(mutex);
  std::vector<std::string> requests GUARDED_BY(mutex);
  std::atomic<std::uint64_t>* generation GUARDED_BY(mutex) = nullptr;
};

Queue& shared() {
  static Queue all;
  return all;
}

core::Error unreachable() {
  return {core::ErrorCode::kUnavailable, "no connection to the queue", ""};
}

}  // namespace

std::shared_ptr<queue::NatsLink> start_queue() {
  {
    Queue& all = shared();
    const core::MutexLock lock(all.mutex);
    all.is_up = true;
    all.messages = 0;
    all.published.clear();
    all.requests.clear();
  }
  return *queue::NatsLink::open({}, "");
}

void set_queue_up(bool is_up) {
  Queue& all = shared();
  const core::MutexLock lock(all.mutex);
  if (is_up && !all.is_up) {
    all.messages = 0;
    ++*all.generation;
  }
  all.is_up = is_up;
}

std::vector<std::string> take_published() {
  Queue& all = shared();
  const core::MutexLock lock(all.mutex);
  return std::exchange(all.published, {});
}

std::vector<std::string> take_requests() {
  Queue& all = shared();
  const core::MutexLock lock(all.mutex);
  return std::exchange(all.requests, {});
}

}  // namespace test_support

namespace queue {

struct NatsLink::Handles {};

core::Result<std::shared_ptr<NatsLink>> NatsLink::open(const Address& /*address*/,
                                                       const std::string& /*name*/) {
  std::shared_ptr<NatsLink> link(new NatsLink());
  auto& all = test_support::shared();
  const core::MutexLock lock(all.mutex);
  all.generation = &link->generation_;
  return link;
}

NatsLink::~NatsLink() = default;

bool NatsLink::is_connected() const {
  auto& all = test_support::shared();
  const core::MutexLock lock(all.mutex);
  return all.is_up;
}

core::Status UnitPublisher::prepare(std::chrono::milliseconds /*silence*/) {
  auto& all = test_support::shared();
  const core::MutexLock lock(all.mutex);
  return all.is_up ? core::ok_status() : test_support::unreachable();
}

core::Status UnitPublisher::publish(std::string_view unit) {
  auto& all = test_support::shared();
  const core::MutexLock lock(all.mutex);
  if (!all.is_up) {
    return test_support::unreachable();
  }
  ++all.messages;
  all.published.emplace_back(unit);
  return core::ok_status();
}

core::Result<std::uint64_t> UnitPublisher::messages() {
  auto& all = test_support::shared();
  const core::MutexLock lock(all.mutex);
  return all.is_up ? core::Result<std::uint64_t>(all.messages) : test_support::unreachable();
}

void UnitPublisher::request_report(const std::string& worker) {
  auto& all = test_support::shared();
  const core::MutexLock lock(all.mutex);
  all.requests.push_back(worker);
}

}  // namespace queue
