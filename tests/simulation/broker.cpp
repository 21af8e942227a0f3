#include "tests/simulation/broker.h"

#include <algorithm>
#include <set>
#include <vector>

#include "tests/simulation/faults.h"

namespace simulation {
namespace {

struct Entry {
  UnitMessage message;
  Nanoseconds due = 0;  ///< When a worker may get it.
};

/// Threads change it in turns: none of its functions waits in between.
struct Broker {
  explicit Broker(std::uint64_t seed) : random(seed) {}
  Random random;
  bool is_lossy = false;
  bool is_up = true;
  std::uint64_t generation = 1;
  Nanoseconds silence = kSecond;
  std::vector<Entry> entries;
  std::uint64_t last = 0;
  std::set<std::string> to_report;
};

Broker* broker = nullptr;

core::Error unreachable() {
  return {core::ErrorCode::kUnavailable, "no connection to the queue", ""};
}

Entry* find(const UnitMessage& message) {
  const auto found =
      std::find_if(broker->entries.begin(), broker->entries.end(),
                   [&](const Entry& entry) { return entry.message.number == message.number; });
  return found == broker->entries.end() ? nullptr : &*found;
}

void set_due(const UnitMessage& message, Nanoseconds due) {
  if (Entry* entry = find(message)) {
    entry->due = due;
    wake(broker, true);
  }
}

class Queue final : public queue::UnitQueue {
 public:
  std::string name() const override { return "simulation"; }
  bool is_connected() const override { return broker->is_up; }
  std::uint64_t generation() const override { return broker->generation; }
  core::Status prepare(std::chrono::milliseconds silence) override {
    if (!broker->is_up) {
      return unreachable();
    }
    broker->entries.clear();
    broker->silence = std::chrono::nanoseconds(silence).count();
    return core::ok_status();
  }
  core::Status publish(std::string_view unit) override {
    if (!broker->is_up) {
      return unreachable();
    }
    int copies = 1;
    if (broker->is_lossy && strikes(Fault::kNameLost)) {
      copies = 0;
    } else if (broker->is_lossy && strikes(Fault::kNameDoubled)) {
      copies = 2;
    }
    for (int i = 0; i < copies; ++i) {
      broker->entries.push_back({{std::string(unit), ++broker->last}, now()});
    }
    wake(broker, true);
    return core::ok_status();
  }
  core::Result<std::uint64_t> messages() override {
    return broker->is_up ? core::Result<std::uint64_t>(broker->entries.size()) : unreachable();
  }
  void request_report(const std::string& worker) override {
    if (broker->is_up && !(broker->is_lossy && strikes(Fault::kRequestLost))) {
      broker->to_report.insert(worker);
      wake(&broker->to_report, true);
    }
  }
};

}  // namespace

std::shared_ptr<queue::UnitQueue> start_broker(std::uint64_t seed) {
  broker = new Broker(seed);  // Lives as long as the process.
  return std::make_shared<Queue>();
}

void set_broker_lossy(bool is_lossy) { broker->is_lossy = is_lossy; }

void set_broker_up(bool is_up) {
  if (!is_up && broker->is_up) {
    count_fault(Fault::kQueueDown);
  }
  if (is_up && !broker->is_up) {
    broker->entries.clear();
    ++broker->generation;
  }
  broker->is_up = is_up;
}

std::optional<UnitMessage> pull_unit(Nanoseconds deadline) {
  while (now() < deadline) {
    std::vector<Entry*> due;
    Nanoseconds next = deadline;
    for (Entry& entry : broker->entries) {
      if (entry.due <= now()) {
        due.push_back(&entry);
      } else {
        next = std::min(next, entry.due);
      }
    }
    if (broker->is_up && !due.empty()) {
      Entry& chosen = *due[broker->random.below(due.size())];
      chosen.due = now() + broker->silence;
      return chosen.message;
    }
    wait(broker, broker->is_up ? next : deadline);
  }
  return std::nullopt;
}

void renew_unit(const UnitMessage& message) { set_due(message, now() + broker->silence); }

void finish_unit(const UnitMessage& message) {
  std::erase_if(broker->entries,
                [&](const Entry& entry) { return entry.message.number == message.number; });
}

void hand_unit_back(const UnitMessage& message) { set_due(message, now()); }

void await_report_request(const std::string& worker, Nanoseconds deadline) {
  while (broker->to_report.erase(worker) == 0 && now() < deadline) {
    wait(&broker->to_report, deadline);
  }
}

}  // namespace simulation
