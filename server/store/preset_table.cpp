#include "server/store/preset_table.h"

#include <array>
#include <span>
#include <utility>

#include <openssl/rand.h>

#include "core/base/check.h"
#include "core/base/url_signature.h"
#include "server/store/key_table.h"

namespace server {
namespace {

using core::Error;
using core::ErrorCode;

/// Of one tenant.
constexpr std::int64_t kPresetsMax = 256;
constexpr std::int64_t kKeysMax = 16;

std::int64_t count_of(Statement& select) { return select.step() ? select.integer(0) : 0; }

core::Result<std::vector<PresetRow>> preset_rows(Statement& select) {
  return select.rows([](const Statement& row) {
    return PresetRow{.name = row.text(0),
                     .body = row.text(1),
                     .is_public = row.integer(2) != 0,
                     .tenant = row.text(3)};
  });
}

core::Result<std::optional<PresetRow>> first_row(Statement& select) {
  auto rows = preset_rows(select);
  if (!rows) {
    return rows.error();
  }
  return rows->empty() ? std::nullopt : std::optional(std::move(rows->front()));
}

}  // namespace

SigningKeyRow make_signing_key(std::string tenant, double now) {
  std::array<unsigned char, 32> random{};
  CHECK(RAND_bytes(random.data(), static_cast<int>(random.size())) == 1);
  return {.id = random_hex(4),
          .key = core::encode_base64url(std::as_bytes(std::span(random))),
          .tenant = std::move(tenant),
          .created_at = now};
}

core::Result<bool> PresetTable::put(const PresetRow& row, double now) {
  bool has_replaced = false;
  const core::Status done = database_.transact([&](Database::Session& session) -> core::Status {
    if (row.is_public) {
      Statement others = session.prepare(
          "SELECT count(*) FROM presets WHERE name=? AND is_public=1 AND tenant<>?");
      others.bind(std::string_view(row.name)).bind(std::string_view(row.tenant));
      if (count_of(others) > 0) {
        return Error{ErrorCode::kConflict,
                     "another tenant has published a preset named \"" + row.name + "\"", ""};
      }
    }
    Statement own = session.prepare("SELECT count(*) FROM presets WHERE tenant=? AND name<>?");
    own.bind(std::string_view(row.tenant)).bind(std::string_view(row.name));
    if (count_of(own) >= kPresetsMax) {
      return Error{ErrorCode::kConflict,
                   "there are " + std::to_string(kPresetsMax) + " presets; delete one first", ""};
    }
    Statement update =
        session.prepare("UPDATE presets SET body=?, is_public=? WHERE tenant=? AND name=?");
    update.bind(std::string_view(row.body)).bind(std::int64_t{row.is_public ? 1 : 0});
    update.bind(std::string_view(row.tenant)).bind(std::string_view(row.name));
    if (auto status = update.run(); !status) {
      return status;
    }
    has_replaced = session.changes() > 0;
    if (has_replaced) {
      return core::ok_status();
    }
    Statement insert = session.prepare(
        "INSERT INTO presets(tenant, name, body, is_public, created_at) VALUES(?,?,?,?,?)");
    insert.bind(std::string_view(row.tenant)).bind(std::string_view(row.name));
    insert.bind(std::string_view(row.body)).bind(std::int64_t{row.is_public ? 1 : 0});
    return insert.bind(now).run();
  });
  return done ? core::Result<bool>(has_replaced) : core::Result<bool>(done.error());
}

core::Result<std::optional<PresetRow>> PresetTable::find(std::string_view name,
                                                         const std::string& tenant) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT name, body, is_public, tenant FROM presets WHERE tenant=? AND name=?");
  select.bind(std::string_view(tenant)).bind(name);
  return first_row(select);
}

core::Result<std::optional<PresetRow>> PresetTable::find_public(std::string_view name) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT name, body, is_public, tenant FROM presets WHERE is_public=1 AND name=?");
  select.bind(name);
  return first_row(select);
}

core::Result<std::vector<PresetRow>> PresetTable::list(const std::string& tenant) {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT name, body, is_public, tenant FROM presets ORDER BY tenant<>?, tenant, name");
  select.bind(std::string_view(tenant));
  return preset_rows(select);
}

core::Result<bool> PresetTable::remove(std::string_view name, const std::string& tenant) {
  bool found = false;
  const core::Status done = database_.transact([&](Database::Session& session) -> core::Status {
    Statement gone = session.prepare("DELETE FROM presets WHERE tenant=? AND name=?");
    auto status = gone.bind(std::string_view(tenant)).bind(name).run();
    found = session.changes() > 0;
    return status;
  });
  return done ? core::Result<bool>(found) : core::Result<bool>(done.error());
}

core::Status PresetTable::insert_key(const SigningKeyRow& row) {
  const core::Status done = database_.transact([&](Database::Session& session) -> core::Status {
    Statement own = session.prepare("SELECT count(*) FROM signing_keys WHERE tenant=?");
    own.bind(std::string_view(row.tenant));
    if (count_of(own) >= kKeysMax) {
      return Error{ErrorCode::kConflict, "there are " + std::to_string(kKeysMax) + " signing keys",
                   ""};
    }
    Statement insert =
        session.prepare("INSERT INTO signing_keys(id, key, tenant, created_at) VALUES(?,?,?,?)");
    insert.bind(std::string_view(row.id)).bind(std::string_view(row.key));
    return insert.bind(std::string_view(row.tenant)).bind(row.created_at).run();
  });
  forget_keys();
  return done;
}

core::Result<PresetTable::Keys> PresetTable::keys() {
  const core::MutexLock lock(keys_mutex_);
  if (keys_ != nullptr) {
    return keys_;
  }
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT id, key, tenant, created_at FROM signing_keys ORDER BY created_at, id");
  std::vector<SigningKeyRow> rows;
  while (select.step()) {
    rows.push_back({.id = select.text(0),
                    .key = select.text(1),
                    .tenant = select.text(2),
                    .created_at = select.real(3)});
  }
  if (const auto status = select.status(); !status) {
    return status.error();
  }
  keys_ = std::make_shared<const std::vector<SigningKeyRow>>(std::move(rows));
  return keys_;
}

core::Status PresetTable::remove_key(std::string_view id) {
  core::Status done = core::ok_status();
  {
    auto session = database_.session();  // keys() takes it while it holds its mutex.
    Statement gone = session.prepare("DELETE FROM signing_keys WHERE id=?");
    done = gone.bind(id).run();
  }
  forget_keys();
  return done;
}

void PresetTable::forget_keys() {
  const core::MutexLock lock(keys_mutex_);
  keys_.reset();
}

}  // namespace server
