/// KeyTable: the bearer keys that `tessera keys` manages. The store has hashes only; who reads it
/// cannot ask in a key's name.
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "server/store/database.h"

namespace server {

struct KeyRow {
  std::string id;            ///< Eight hex digits; names the key in lists and logs.
  std::string name;          ///< For people.
  std::string token_hash;    ///< sha256 of the key, hex.
  std::string session_hash;  ///< sha256 of the session cookie that the key is exchanged for, hex.
  std::string tenant;        ///< Whose it is: what it makes belongs to all keys of that tenant.
  bool may_read = true;
  bool may_write = true;
  bool may_work = false;          ///< Renders units of jobs: `tessera worker`.
  bool may_admin = false;         ///< Sees the things of all tenants, manages keys.
  int priority_max = 0;           ///< Of the jobs that it submits.
  std::optional<int> rate_limit;  ///< Requests a minute, 0 for any number; empty: the server's.
  double created_at = 0;          ///< Seconds since 1970.
  std::optional<double> expires_at;
};

/// "read,write"; "admin" goes with these two.
std::string scopes_text(const KeyRow& row);
/// From such a text. False: it is not one.
bool read_scopes(std::string_view text, KeyRow& row);
/// 1 to 64 letters, digits, `.`, `_` and `-`.
bool is_tenant_name(std::string_view text);

/// A fresh key of a tenant of its own: what stands in the table, and the text that its owner gets,
/// once.
struct MadeKey {
  KeyRow row;
  std::string token;
};
MadeKey make_key(std::string name);

/// bytes: at most 32.
std::string random_hex(std::size_t bytes);

/// The session cookie of a key: known to who has the key, and to nobody who has its hash.
std::string session_of_token(std::string_view token);
/// As in the table.
std::string secret_hash(std::string_view secret);
/// In a time that does not tell where they differ. Empty ones are no secrets.
bool is_same_secret(std::string_view a, std::string_view b);

class KeyTable {
 public:
  /// database must outlive this.
  explicit KeyTable(Database& database) : database_(database) {}

  core::Status insert(const KeyRow& row);
  /// Oldest first.
  core::Result<std::vector<KeyRow>> list();
  /// False when there is none of that id.
  core::Result<bool> remove(std::string_view id);

 private:
  Database& database_;
};

}  // namespace server
