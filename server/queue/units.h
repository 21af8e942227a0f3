/// Units of work on a JetStream work queue: the coordinator publishes their names, each is given to
/// one worker at a time, and again to another when the first one falls silent.
///
/// The stream is in memory and has one replica: what is open is known to the coordinator, which
/// publishes it again whenever the broker has lost it.
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "server/queue/nats_link.h"

namespace queue {

class UnitPublisher {
 public:
  explicit UnitPublisher(std::shared_ptr<NatsLink> link) : link_(std::move(link)) {}

  /// Makes the stream, empty, and its consumer. silence: of a worker, before a unit goes to the
  /// next. Errors: kUnavailable; kInvalidArgument for a server that is not used.
  core::Status prepare(std::chrono::milliseconds silence);
  /// Errors: kUnavailable; then the stream has to be prepared anew.
  core::Status publish(std::string_view unit);
  /// Asks the worker to report at once. The request may get lost.
  void request_report(const std::string& worker);
  const NatsLink& link() const { return *link_; }

 private:
  std::shared_ptr<NatsLink> link_;
};

/// Requests to a worker to report at once, because a unit that it renders is no longer wanted.
class ReportRequests {
 public:
  ReportRequests(std::shared_ptr<NatsLink> link, const std::string& worker);
  ~ReportRequests();
  ReportRequests(const ReportRequests&) = delete;
  ReportRequests& operator=(const ReportRequests&) = delete;

  /// Returns whether a request has come since the last call. Does not wait.
  bool take();

 private:
  std::shared_ptr<NatsLink> link_;
  std::string subject_;
  void* subscription_ = nullptr;
};

/// Of one thread of a worker.
class UnitPuller {
 public:
  explicit UnitPuller(std::shared_ptr<NatsLink> link);
  ~UnitPuller();
  UnitPuller(const UnitPuller&) = delete;
  UnitPuller& operator=(const UnitPuller&) = delete;

  /// A unit that was given to this worker; destroyed without done(), it goes to another one when it
  /// is due.
  class Unit {
   public:
    Unit(std::string name, void* message) : name_(std::move(name)), message_(message) {}
    ~Unit();
    Unit(Unit&& other) noexcept
        : name_(std::move(other.name_)), message_(std::exchange(other.message_, nullptr)) {}
    Unit& operator=(Unit&&) = delete;
    Unit(const Unit&) = delete;
    Unit& operator=(const Unit&) = delete;

    const std::string& name() const { return name_; }
    /// It is not given to another one for as long again. From any thread.
    void renew() const;
    /// It is never given again.
    void done() const;
    /// Another one may have it at once.
    void hand_back() const;

   private:
    std::string name_;
    void* message_;
  };
  /// Waits for a unit that long. Empty: there is none, or no broker.
  std::optional<Unit> next(std::chrono::milliseconds time);

 private:
  void unsubscribe();

  std::shared_ptr<NatsLink> link_;
  std::uint64_t generation_ = 0;
  void* subscription_ = nullptr;
};

}  // namespace queue
