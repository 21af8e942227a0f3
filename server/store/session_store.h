/// Sessions of browsers: a random cookie stands for a key, until a time, the owner's word, or the
/// end of the key. They outlive the process; the store has hashes only.
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
  /// A picture may render for days, and its page stays open.
  static constexpr std::chrono::hours kLife{7 * 24};
  static constexpr std::size_t kMax = 10000;  ///< The one that ends first goes beyond.

  /// Reads what is stored. database must outlive the result.
  static core::Result<std::unique_ptr<SessionStore>> open(Database& database);

  /// A new one for the key of that hash: the cookie.
  core::Result<std::string> begin(std::string_view token_hash, double now) EXCLUDES(mutex_);
  /// The hash of the key that the cookie stands for; empty when there is no such session, or it is
  /// over.
  std::optional<std::string> token_hash_of(std::string_view cookie, double now) const
      EXCLUDES(mutex_);
  /// That of the cookie, if there is one.
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
  std::map<std::string, Entry> entries_ GUARDED_BY(mutex_);  ///< By the cookie's hash.
};

}  // namespace server
