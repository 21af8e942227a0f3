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
  bool may_read = true;
  bool may_write = true;
  std::optional<int> rate_limit;  ///< Requests a minute, 0 for any number; empty: the server's.
  double created_at = 0;          ///< Seconds since 1970.
  std::optional<double> expires_at;
};

/// A fresh key: what stands in the table, and the text that its owner gets, once.
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
