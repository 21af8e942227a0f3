/// KeyRing: whose a key is, from the operator's own key and the stored ones.
///
/// The stored keys are read anew every second: one that was removed stops working by then.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/mutex.h"
#include "server/live_config.h"
#include "server/store/key_table.h"

namespace server {

/// Who asks, and what they may.
struct Holder {
  std::string id;  ///< Of a stored key; empty: the operator, or anybody where no key is needed.
  std::string name = {};    ///< The key's, or "operator"; empty: anybody.
  std::string tenant = {};  ///< Empty: the operator's.
  bool may_read = true;
  bool may_write = true;
  bool may_admin = true;
  bool may_work = true;
  int priority_max = 100;
  int rate_limit = 0;  ///< Requests a minute; 0: any number.
};

class KeyRing {
 public:
  enum class Change : std::uint8_t { kAdded, kRemoved };
  /// Told of stored keys that have come or gone since the last look.
  using Watcher = std::function<void(Change change, const KeyRow& key)>;
  /// Config and table must outlive it.
  KeyRing(const LiveConfig& config, KeyTable& table, Watcher watcher = {});

  /// Without any key, on loopback, nobody needs one.
  bool is_needed();
  /// hash: secret_hash() of the key.
  std::optional<Holder> holder_of_hash(std::string_view hash);

 private:
  using Clock = std::chrono::steady_clock;
  void refresh() REQUIRES(mutex_);
  void tell_changes(const std::map<std::string, KeyRow>& now) const REQUIRES(mutex_);

  const LiveConfig& config_;
  KeyTable& table_;
  const Watcher watcher_;
  core::Mutex mutex_;
  std::map<std::string, KeyRow> rows_ GUARDED_BY(mutex_);  ///< By id.
  bool is_read_ GUARDED_BY(mutex_) = false;
  std::optional<Clock::time_point> read_at_
      GUARDED_BY(mutex_);  ///< Empty: the next caller reads the table.
};

}  // namespace server
