/// SessionStore: browser sessions. A random cookie represents a key until it expires, its owner
/// ends it, or the key is removed. Sessions outlive the process; only hashes are stored.
#pragma once

#include <chrono>
#include <cstddef>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

class SessionStore {
 public:
  /// A picture may render for days while its page stays open.
  static constexpr std::chrono::hours kLife{7 * 24};
  static constexpr std::size_t kMax = 10000;  ///< The one that expires first is dropped.

  /// Reads the stored sessions. database must outlive the result.
  static core::Result<std::unique_ptr<SessionStore>> open(Database& database);

  /// Starts a session for the key with that hash and returns its cookie.
  core::Result<std::string> begin(std::string_view token_hash, double now) EXCLUDES(mutex_);
  /// Returns the hash of the cookie's key; empty when there is no such session, or it has expired.
  std::optional<std::string> token_hash_of(std::string_view cookie, double now) const
      EXCLUDES(mutex_);
  /// Ends the cookie's session, if there is one.
  core::Status end(std::string_view cookie) EXCLUDES(mutex_);

 private:
  explicit SessionStore(Database& database) : database_(database) {}
  struct Entry {
    std::string token_hash;
    double ends_at = 0;
  };
  core::Status forget_old(double now) REQUIRES(mutex_);

  Database& database_;
  mutable core::Mutex mutex_;
  std::map<std::string, Entry> entries_ GUARDED_BY(mutex_);  ///< Sessions by the cookie's hash.
};

}  // namespace server
