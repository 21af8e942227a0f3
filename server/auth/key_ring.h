/// KeyRing: resolves keys, from the operator's own key and the stored ones.
///
/// The stored keys are reloaded every second: a removed key stops working within that time.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/mutex.h"
#include "server/config/live_config.h"
#include "server/store/key_table.h"

namespace server {

/// Holder of a key, and its rights.
struct Holder {
  std::string
      id;  ///< Id of a stored key; empty: the operator, or any caller where no key is required.
  std::string name = {};    ///< The key's, or "operator"; empty: any caller.
  std::string tenant = {};  ///< Empty: the operator's.
  bool may_read = false;
  bool may_write = false;
  bool may_admin = false;
  bool may_work = false;
  int priority_max = 100;
  int rate_limit = 0;  ///< Requests per minute; 0: any number.
};

class KeyRing {
 public:
  enum class Change : std::uint8_t { kAdded, kRemoved };
  /// Called for stored keys that were added or removed since the last reload.
  using Watcher = std::function<void(Change change, const KeyRow& key)>;
  /// config and table must outlive it.
  KeyRing(const LiveConfig& config, KeyTable& table, Watcher watcher = {});

  /// Returns whether a key is required; false on loopback when no key exists. Until the stored keys
  /// have been read once, one is required.
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
  std::map<std::string, KeyRow> rows_ GUARDED_BY(mutex_);  ///< Keys by id.
  bool is_read_ GUARDED_BY(mutex_) = false;
  std::optional<Clock::time_point> read_at_
      GUARDED_BY(mutex_);  ///< Empty: the next caller reloads the table.
};

}  // namespace server
