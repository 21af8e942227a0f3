#include "server/auth/key_ring.h"

#include <utility>

#include "server/observe/clock.h"

namespace server {
namespace {

constexpr std::chrono::milliseconds kFresh{1000};

}  // namespace

KeyRing::KeyRing(const LiveConfig& config, KeyTable& table, Watcher watcher)
    : config_(config), table_(table), watcher_(std::move(watcher)) {
  const core::MutexLock lock(mutex_);
  refresh();
  read_at_.reset();  // The first caller reloads the table.
}

void KeyRing::refresh() {
  const auto now = Clock::now();
  if (read_at_ && now - *read_at_ < kFresh) {
    return;
  }
  // If the store cannot be read, the known keys remain valid; this admits no new key.
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
  if (const auto config = config_.now(); !config->key.empty() || !is_loopback(config->listen)) {
    return true;
  }
  const core::MutexLock lock(mutex_);
  refresh();
  return !is_read_ || !rows_.empty();  // Unread keys may exist.
}

std::optional<Holder> KeyRing::holder_of_hash(std::string_view hash) {
  const auto config = config_.now();
  const core::MutexLock lock(mutex_);
  refresh();  // Even for the operator's key: changes must be reported soon.
  if (!config->key.empty() && is_same_secret(hash, secret_hash(config->key))) {
    return Holder{.id = {},
                  .name = "operator",
                  .may_read = true,
                  .may_write = true,
                  .may_admin = true,
                  .may_work = true};
  }
  if (!config->worker_key.empty() && is_same_secret(hash, secret_hash(config->worker_key))) {
    return Holder{.id = "worker-key", .name = "worker", .may_work = true};
  }
  for (const auto& [id, row] : rows_) {
    if (is_same_secret(row.token_hash, hash) &&
        !(row.expires_at && *row.expires_at <= unix_now())) {
      return Holder{.id = id,
                    .name = row.name,
                    .tenant = row.tenant,
                    .may_read = row.may_read,
                    .may_write = row.may_write,
                    .may_admin = row.may_admin,
                    .may_work = row.may_work,
                    .priority_max = row.priority_max,
                    .rate_limit = row.rate_limit.value_or(config->rate_limit)};
    }
  }
  return std::nullopt;
}

}  // namespace server
