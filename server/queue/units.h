/// Units of work on a JetStream work queue: the coordinator publishes their names, each is given to
/// one worker at a time, and to another if that one stops responding.
///
/// The stream is in memory and has one replica: the coordinator knows the open units and publishes
/// them again whenever the broker has lost them.
#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "server/queue/nats_link.h"
#include "server/queue/unit_queue.h"

namespace queue {

class UnitPublisher final : public UnitQueue {
 public:
  explicit UnitPublisher(std::shared_ptr<NatsLink> link) : link_(std::move(link)) {}

  std::string name() const override { return link_->name(); }
  bool is_connected() const override { return link_->is_connected(); }
  std::uint64_t generation() const override { return link_->generation(); }
  /// Creates the stream and its consumer.
  core::Status prepare(std::chrono::milliseconds silence) override;
  core::Status publish(std::string_view unit) override;
  core::Result<std::uint64_t> messages() override;
  void request_report(const std::string& worker) override;

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

/// Used by one thread of a worker.
class UnitPuller {
 public:
  explicit UnitPuller(std::shared_ptr<NatsLink> link);
  ~UnitPuller();
  UnitPuller(const UnitPuller&) = delete;
  UnitPuller& operator=(const UnitPuller&) = delete;

  /// A unit given to this worker; if destroyed without done(), another worker gets it when it is
  /// due.
  class Unit {
   public:
    /// link: must outlive it. generation: that of the link in which the message came.
    Unit(std::string name, void* message, const NatsLink& link, std::uint64_t generation)
        : name_(std::move(name)), message_(message), link_(link), generation_(generation) {}
    ~Unit();
    Unit(Unit&& other) noexcept
        : name_(std::move(other.name_)),
          message_(std::exchange(other.message_, nullptr)),
          link_(other.link_),
          generation_(other.generation_) {}
    Unit& operator=(Unit&&) = delete;
    Unit(const Unit&) = delete;
    Unit& operator=(const Unit&) = delete;

    const std::string& name() const { return name_; }
    /// Extends the time until another worker gets it. From any thread.
    void renew() const;
    /// Removes it from the queue.
    void done() const;
    /// Makes it available to other workers at once.
    void hand_back() const;

   private:
    /// Returns whether the broker still knows the message by its number.
    bool is_current() const;

    std::string name_;
    void* message_;
    const NatsLink& link_;
    std::uint64_t generation_;
  };
  /// Waits for a unit for that long. Returns empty if there is none, or no broker.
  std::optional<Unit> next(std::chrono::milliseconds time);

 private:
  void unsubscribe();

  std::shared_ptr<NatsLink> link_;
  std::uint64_t generation_ = 0;
  void* subscription_ = nullptr;
};

}  // namespace queue
