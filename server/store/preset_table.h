/// Presets of tenants, and the keys that sign URLs of their images.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "server/access.h"
#include "server/store/database.h"

namespace server {

struct PresetRow {
  std::string name;
  std::string body;  ///< JSON of PUT /v1/presets/{name}
  bool is_public = false;
  std::string tenant;  ///< The owner.
};

struct SigningKeyRow {
  std::string id;
  std::string key;  ///< Stored as it is: a signature cannot be checked with its hash.
  std::string tenant;
  double created_at = 0;  ///< Unix seconds.
};

/// Makes a new key, unpadded base64url of 32 random bytes.
SigningKeyRow make_signing_key(std::string tenant, double now);

class PresetTable {
 public:
  /// database must outlive this.
  explicit PresetTable(Database& database) : database_(database) {}

  /// Returns whether it replaced one. Errors: kConflict when a public preset of another tenant has
  /// the name, or the tenant has too many presets.
  core::Result<bool> put(const PresetRow& row, double now);
  /// Returns the tenant's own preset; empty if there is none.
  core::Result<std::optional<PresetRow>> find(std::string_view name, const std::string& tenant);
  core::Result<std::optional<PresetRow>> find_public(std::string_view name);
  /// Returns the presets of all tenants, first those of this one.
  core::Result<std::vector<PresetRow>> list(const std::string& tenant);
  /// Returns false if there is none.
  core::Result<bool> remove(std::string_view name, const std::string& tenant);

  /// Errors: kConflict when the tenant has too many keys.
  core::Status insert_key(const SigningKeyRow& row);
  /// Returns the keys of all tenants, oldest first. Kept in memory: each signed request needs them.
  using Keys = std::shared_ptr<const std::vector<SigningKeyRow>>;
  core::Result<Keys> keys();
  core::Status remove_key(std::string_view id);

 private:
  /// After a change of the store, so that the next caller reads it.
  void forget_keys();

  Database& database_;
  core::Mutex keys_mutex_;
  Keys keys_ GUARDED_BY(keys_mutex_);  ///< Null: to be read.
};

}  // namespace server
