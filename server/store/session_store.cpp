#include "server/store/session_store.h"

#include <algorithm>

#include "server/store/key_table.h"

namespace server {

core::Result<std::unique_ptr<SessionStore>> SessionStore::open(Database& database) {
  std::unique_ptr<SessionStore> store(new SessionStore(database));  // NOLINT: private constructor.
  const core::MutexLock lock(store->mutex_);
  auto session = database.session();
  Statement select = session.prepare("SELECT hash, token_hash, ends_at FROM sessions");
  while (select.step()) {
    store->entries_.emplace(select.text(0),
                            Entry{.token_hash = select.text(1), .ends_at = select.real(2)});
  }
  return select.result(std::move(store));
}

core::Result<std::string> SessionStore::begin(std::string_view token_hash, double now) {
  std::string cookie = random_hex(32);
  const std::string hash = secret_hash(cookie);
  const double ends_at = now + std::chrono::duration<double>(kLife).count();
  const core::MutexLock lock(mutex_);
  core::Status stored = forget_old(now);
  if (stored) {
    stored = database_.transact([&](Database::Session& session) {
      return session.prepare("INSERT INTO sessions(hash, token_hash, ends_at) VALUES(?, ?, ?)")
          .bind(hash)
          .bind(token_hash)
          .bind(ends_at)
          .run();
    });
  }
  if (!stored) {
    return stored.error();
  }
  entries_.emplace(hash, Entry{.token_hash = std::string(token_hash), .ends_at = ends_at});
  return cookie;
}

std::optional<std::string> SessionStore::token_hash_of(std::string_view cookie, double now) const {
  const core::MutexLock lock(mutex_);
  const auto found = entries_.find(secret_hash(cookie));
  return found == entries_.end() || found->second.ends_at <= now
             ? std::nullopt
             : std::optional<std::string>(found->second.token_hash);
}

core::Status SessionStore::end(std::string_view cookie) {
  const std::string hash = secret_hash(cookie);
  const core::MutexLock lock(mutex_);
  if (entries_.find(hash) == entries_.end()) {
    return core::ok_status();
  }
  // Removes it from the store first: a session reported as ended must not be valid after a restart.
  core::Status removed = database_.transact([&](Database::Session& session) {
    return session.prepare("DELETE FROM sessions WHERE hash=?").bind(hash).run();
  });
  if (removed) {
    entries_.erase(hash);
  }
  return removed;
}

core::Status SessionStore::forget_old(double now) {
  double until = now;
  if (entries_.size() >= kMax) {
    const auto first = std::min_element(
        entries_.begin(), entries_.end(),
        [](const auto& a, const auto& b) { return a.second.ends_at < b.second.ends_at; });
    until = std::max(until, first->second.ends_at);
  }
  core::Status removed = database_.transact([&](Database::Session& session) {
    return session.prepare("DELETE FROM sessions WHERE ends_at<=?").bind(until).run();
  });
  if (removed) {
    std::erase_if(entries_, [until](const auto& entry) { return entry.second.ends_at <= until; });
  }
  return removed;
}

}  // namespace server
