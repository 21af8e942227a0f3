#include "server/store/key_table.h"

#include <algorithm>
#include <array>
#include <span>

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include "core/base/check.h"
#include "core/base/sha256.h"
#include "core/base/text.h"

namespace server {

std::string random_hex(std::size_t bytes) {
  std::array<unsigned char, 32> random{};
  CHECK(bytes <= random.size());
  CHECK(RAND_bytes(random.data(), static_cast<int>(bytes)) == 1);
  return core::hex(std::span(random).first(bytes));
}

std::string scopes_text(const KeyRow& row) {
  std::string text;
  for (const auto& [may, scope] : {std::pair(row.may_read, "read"),
                                   {row.may_write, "write"},
                                   {row.may_admin, "admin"},
                                   {row.may_work, "worker"}}) {
    if (may) {
      text.append(text.empty() ? "" : ",").append(scope);
    }
  }
  return text;
}

bool read_scopes(std::string_view text, KeyRow& row) {
  row.may_read = row.may_write = row.may_admin = row.may_work = false;
  while (!text.empty()) {
    const std::string_view scope = text.substr(0, text.find(','));
    row.may_admin = row.may_admin || scope == "admin";
    row.may_read = row.may_read || scope == "read" || scope == "admin";
    row.may_write = row.may_write || scope == "write" || scope == "admin";
    row.may_work = row.may_work || scope == "worker";
    if (scope != "read" && scope != "write" && scope != "admin" && scope != "worker") {
      return false;
    }
    text.remove_prefix(std::min(scope.size() + 1, text.size()));
  }
  return row.may_read || row.may_write || row.may_work;
}

std::string secret_hash(std::string_view secret) {
  return core::sha256_hex(secret.data(), secret.size());
}

std::string session_of_token(std::string_view token) {
  return secret_hash("tessera session " + std::string(token));
}

bool is_same_secret(std::string_view a, std::string_view b) {
  return !a.empty() && a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

MadeKey make_key(std::string name) {
  MadeKey made;
  made.row.id = random_hex(4);
  made.row.name = std::move(name);
  made.row.tenant = made.row.id;
  made.token = "tsk_" + made.row.id + "_" + random_hex(24);
  made.row.token_hash = secret_hash(made.token);
  made.row.session_hash = secret_hash(session_of_token(made.token));
  return made;
}

core::Status KeyTable::insert(const KeyRow& row) {
  return database_.transact([&row](Database::Session& session) -> core::Status {
    Statement insert = session.prepare(
        "INSERT INTO keys(id, name, token_hash, session_hash, scopes, rate_limit, created_at,"
        " expires_at, tenant, priority_max) VALUES(?,?,?,?,?,?,?,?,?,?)");
    insert.bind(row.id).bind(row.name).bind(row.token_hash).bind(row.session_hash);
    insert.bind(scopes_text(row));
    insert.bind(row.rate_limit ? std::optional<double>(*row.rate_limit) : std::nullopt);
    insert.bind(row.created_at).bind(row.expires_at).bind(row.tenant);
    return insert.bind(std::int64_t{row.priority_max}).run();
  });
}

core::Result<std::vector<KeyRow>> KeyTable::list() {
  auto session = database_.session();
  Statement select = session.prepare(
      "SELECT id, name, token_hash, session_hash, scopes, rate_limit, created_at, expires_at,"
      " tenant, priority_max FROM keys ORDER BY created_at, id");
  std::vector<KeyRow> rows;
  while (select.step()) {
    KeyRow row;
    row.id = select.text(0);
    row.name = select.text(1);
    row.token_hash = select.text(2);
    row.session_hash = select.text(3);
    static_cast<void>(read_scopes(select.text(4), row));  // An invalid text grants no scope.
    if (const auto limit = select.optional_real(5)) {
      row.rate_limit = static_cast<int>(*limit);
    }
    row.created_at = select.real(6);
    row.expires_at = select.optional_real(7);
    row.tenant = select.text(8);
    row.priority_max = static_cast<int>(select.integer(9));
    rows.push_back(std::move(row));
  }
  return select.result(std::move(rows));
}

core::Result<bool> KeyTable::remove(std::string_view id) {
  bool found = false;
  const core::Status done = database_.transact([&](Database::Session& session) -> core::Status {
    auto status = session.prepare("DELETE FROM keys WHERE id=?").bind(id).run();
    found = session.changes() > 0;
    return status;
  });
  if (!done) {
    return done.error();
  }
  return found;
}

}  // namespace server
