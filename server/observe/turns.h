/// Turns: places for requests that need much memory or computing, shared by tenants: dry runs,
/// uploads of scenes, denoising, comparisons, merges.
///
/// A tenant without a place is not kept waiting by those that hold all of them: it gets a further
/// one, up to twice as many in all. The tenant with fewest places comes first, then the oldest
/// request.
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"

namespace server {

class Turns {
 public:
  explicit Turns(int places) : places_(places) {}
  Turns(const Turns&) = delete;
  Turns& operator=(const Turns&) = delete;

  /// A place; released by the destructor. Must not outlive the Turns.
  class Held {
   public:
    Held(Turns& turns, std::string tenant) : turns_(&turns), tenant_(std::move(tenant)) {}
    Held(Held&& other) noexcept
        : turns_(std::exchange(other.turns_, nullptr)), tenant_(std::move(other.tenant_)) {}
    Held(const Held&) = delete;
    Held& operator=(const Held&) = delete;
    ~Held() {
      if (turns_ != nullptr) {
        turns_->leave(tenant_);
      }
    }

   private:
    Turns* turns_;
    std::string tenant_;
  };

  /// Waits for a place. patience: empty for any time. Errors: kUnavailable when the time is over;
  /// kCancelled when a stop was requested.
  core::Result<Held> take(const std::string& tenant, const std::stop_token& stop,
                          std::optional<std::chrono::seconds> patience = std::chrono::seconds(20));

 private:
  struct Waiting {
    std::uint64_t number = 0;
    std::string tenant;
  };
  void leave(const std::string& tenant);
  int places_of(const std::string& tenant) const REQUIRES(mutex_);
  bool is_next(std::uint64_t number) const REQUIRES(mutex_);

  const int places_;
  core::Mutex mutex_;
  core::CondVar changed_;
  int taken_ GUARDED_BY(mutex_) = 0;
  std::map<std::string, int> places_by_tenant_ GUARDED_BY(mutex_);
  std::vector<Waiting> waiting_ GUARDED_BY(mutex_);  ///< Oldest first.
  std::uint64_t last_number_ GUARDED_BY(mutex_) = 0;
};

}  // namespace server
