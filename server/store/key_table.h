/// KeyTable: the bearer keys that `tessera keys` manages. Only hashes are stored, so that a reader
/// of the store cannot use a key.
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
  std::string id;            ///< Eight hex digits; identifies the key in lists and logs.
  std::string name;          ///< Display name.
  std::string token_hash;    ///< sha256 of the key, hex.
  std::string session_hash;  ///< sha256 of the session cookie that the key is exchanged for, hex.
  std::string
      tenant;  ///< The owner: things created with the key belong to all keys of that tenant.
  bool may_read = true;
  bool may_write = true;
  bool may_work = false;          ///< May render units of jobs: `tessera worker`.
  bool may_admin = false;         ///< Sees all tenants, manages keys.
  int priority_max = 0;           ///< For jobs that it submits.
  std::optional<int> rate_limit;  ///< Requests per minute, 0: no limit; empty: the server's limit.
  double created_at = 0;          ///< Seconds since 1970.
  std::optional<double> expires_at;
};

/// Returns "read,write"; "admin" is added to these two.
std::string scopes_text(const KeyRow& row);
/// Reads such a text. Returns false if it is invalid.
bool read_scopes(std::string_view text, KeyRow& row);

/// A new key of its own tenant: the row of the table, and the text that is given to its owner once.
struct MadeKey {
  KeyRow row;
  std::string token;
};
MadeKey make_key(std::string name);

/// Returns random bytes as hex digits. bytes: at most 32.
std::string random_hex(std::size_t bytes);

/// Derives the session cookie from the key; it cannot be derived from the key's hash.
std::string session_of_token(std::string_view token);
/// Returns the hash stored in the table.
std::string secret_hash(std::string_view secret);
/// Compares in constant time. Empty texts are never equal secrets.
bool is_same_secret(std::string_view a, std::string_view b);

class KeyTable {
 public:
  /// database must outlive this.
  explicit KeyTable(Database& database) : database_(database) {}

  core::Status insert(const KeyRow& row);
  /// Returns the keys, oldest first.
  core::Result<std::vector<KeyRow>> list();
  /// Returns false if there is no key with that id.
  core::Result<bool> remove(std::string_view id);

 private:
  Database& database_;
};

}  // namespace server
