/// Tickets: permission to watch some jobs for a minute without a key, for pages that cannot send
/// headers with an event stream or an image. Kept in memory: a restart ends them.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/mutex.h"
#include "server/access.h"

namespace server {

class Tickets {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kLife{60};
  static constexpr std::size_t kMax = 10'000;
  static constexpr std::size_t kMaxOfTenant = kMax / 2;  ///< The operator has no such limit.

  /// The caller on whose behalf a ticket watches.
  struct Holder {
    std::string key;  ///< Id of the key; empty: the operator's, or none.
    Access access;
  };
  /// Creates a ticket for these jobs on behalf of `holder`; empty if too many are
  /// open, of all or of its tenant.
  std::optional<std::string> issue(std::vector<std::string> jobs, Holder holder,
                                   Clock::time_point now = Clock::now());
  /// Returns the holder if the ticket permits watching all of these jobs; otherwise empty.
  std::optional<Holder> holder_of(std::string_view ticket, const std::vector<std::string>& jobs,
                                  Clock::time_point now = Clock::now()) const;

 private:
  struct Entry {
    std::vector<std::string> jobs;
    Holder holder;
    Clock::time_point ends;
  };
  mutable core::Mutex mutex_;
  std::map<std::string, Entry, std::less<>> entries_ GUARDED_BY(mutex_);
};

}  // namespace server
