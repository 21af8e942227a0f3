/// UnitQueue: names of units that wait for workers, as the coordinator sees them. The product's is
/// UnitPublisher, over NATS; tests and the simulation have others.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace queue {

class UnitQueue {
 public:
  UnitQueue() = default;
  virtual ~UnitQueue() = default;
  UnitQueue(const UnitQueue&) = delete;
  UnitQueue& operator=(const UnitQueue&) = delete;

  /// Returns HOST:PORT, for messages.
  virtual std::string name() const = 0;
  virtual bool is_connected() const = 0;
  /// Returns a number that changes after each reconnection.
  virtual std::uint64_t generation() const = 0;
  /// Empties the queue. silence: time without renewal after which a unit goes to the next worker.
  /// Errors: kUnavailable; kInvalidArgument for an unsupported server.
  virtual core::Status prepare(std::chrono::milliseconds silence) = 0;
  /// Errors: kUnavailable; call prepare() again.
  virtual core::Status publish(std::string_view unit) = 0;
  /// Returns the number of units that no worker is done with. Errors: as publish().
  virtual core::Result<std::uint64_t> messages() = 0;
  /// Asks the worker to report at once. The request may get lost.
  virtual void request_report(const std::string& worker) = 0;
};

}  // namespace queue
