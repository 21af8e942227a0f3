#include "server/key_ring.h"

#include <utility>

#include <openssl/crypto.h>

#include "server/observe/clock.h"

namespace server {
namespace {

constexpr std::chrono::milliseconds kFresh{1000};

bool same_secret(std::string_view a, std::string_view b) {
  return !a.empty() && a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

}  // namespace

KeyRing::KeyRing(const Config& config, KeyTable& table, Watcher watcher)
    : config_(config),
      table_(table),
      watcher_(std::move(watcher)),
      own_token_hash_(config.key.empty() ? std::string() : secret_hash(config.key)),
      own_session_hash_(config.key.empty() ? std::string()
                                           : secret_hash(session_of_token(config.key))) {
  const core::MutexLock lock(mutex_);
  refresh();
  read_at_.reset();  // The first who asks looks again.
}

void KeyRing::refresh() {
  const auto now = Clock::now();
  if (read_at_ && now - *read_at_ < kFresh) {
    return;
  }
  // A store that cannot be read keeps the keys that were known: nobody is let in by that.
  if (auto rows = table_.list()) {
    std::map<std::string, KeyRow> by_id;
    for (KeyRow& row : *rows) {
      std::string id = row.id;
      by_id.emplace(std::move(id), std::move(row));
    }
    if (is_read_ && watcher_) {
      tell_changes(by_id);
    }
    is_read_ = true;
    rows_ = std::move(by_id);
  }
  read_at_ = now;
}

void KeyRing::tell_changes(const std::map<std::string, KeyRow>& now) const {
  for (const auto& [id, row] : rows_) {
    if (now.find(id) == now.end()) {
      watcher_(Change::kRemoved, row);
    }
  }
  for (const auto& [id, row] : now) {
    if (rows_.find(id) == rows_.end()) {
      watcher_(Change::kAdded, row);
    }
  }
}

bool KeyRing::is_needed() {
  if (!config_.key.empty() || !is_loopback(config_.listen)) {
    return true;
  }
  const core::MutexLock lock(mutex_);
  refresh();
  return !rows_.empty();
}

std::optional<Holder> KeyRing::find(const std::string& hash, std::string KeyRow::*member) {
  const core::MutexLock lock(mutex_);
  refresh();
  for (const auto& [id, row] : rows_) {
    if (same_secret(row.*member, hash) && !(row.expires_at && *row.expires_at <= unix_now())) {
      return Holder{.id = id,
                    .name = row.name,
                    .may_read = row.may_read,
                    .may_write = row.may_write,
                    .rate_limit = row.rate_limit.value_or(config_.rate_limit)};
    }
  }
  return std::nullopt;
}

std::optional<Holder> KeyRing::holder_of_token(std::string_view token) {
  const std::string hash = secret_hash(token);
  if (same_secret(hash, own_token_hash_)) {
    const core::MutexLock lock(mutex_);
    refresh();  // Nobody else may ask for long, and changes are to be told.
    return Holder{.id = {}, .name = "operator"};
  }
  return find(hash, &KeyRow::token_hash);
}

std::optional<Holder> KeyRing::holder_of_session(std::string_view cookie) {
  const std::string hash = secret_hash(cookie);
  if (same_secret(hash, own_session_hash_)) {
    return Holder{.id = {}, .name = "operator"};
  }
  return find(hash, &KeyRow::session_hash);
}

}  // namespace server
