/// Broker of the names of units, between WorkBoard and workers, in place of NATS JetStream.
///
/// A name goes to one worker at a time, and to another when that one has been silent for too long.
/// Names come in any order; while the broker is lossy, they are lost or come twice.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "server/queue/unit_queue.h"
#include "tests/simulation/executor.h"

namespace simulation {

struct UnitMessage {
  std::string unit;
  std::uint64_t number = 0;
};

/// Starts an empty broker. Once per process.
std::shared_ptr<queue::UnitQueue> start_broker(std::uint64_t seed);
void set_broker_lossy(bool is_lossy);
/// While it is down, no client reaches it; then it has lost everything.
void set_broker_up(bool is_up);

// Of workers.
std::optional<UnitMessage> pull_unit(Nanoseconds deadline);
void renew_unit(const UnitMessage& message);
void finish_unit(const UnitMessage& message);
void hand_unit_back(const UnitMessage& message);
/// Waits until the worker is asked to report, or the deadline.
void await_report_request(const std::string& worker, Nanoseconds deadline);

}  // namespace simulation
