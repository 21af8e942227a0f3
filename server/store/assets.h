/// Assets: uploaded files named by the hash of their content, and the tenants that keep them.
///
/// Equal uploads share their bytes; each tenant that uploads them has its own reference. Files of a
/// scene are kept for the tenants that keep the scene. The bytes are removed with the last
/// reference and the last scene.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"
#include "server/access.h"
#include "server/store/blob_store.h"
#include "server/store/database.h"

namespace server {

class Assets {
 public:
  /// Both must outlive this.
  Assets(Database& database, const BlobStore& blobs) : database_(database), blobs_(blobs) {}

  /// Returns the size. Errors: kNotFound, also for an asset that `access` does not see.
  core::Result<std::uint64_t> find(std::string_view id, const Access& access);
  /// Returns the whole content. Errors: of find().
  core::Result<core::SharedBytes> read(std::string_view id, const Access& access);
  core::Result<UniqueFd> open(std::string_view id, const Access& access);
  /// Pre: find() has found the asset.
  std::string path_of(std::string_view id) const { return blobs_.path_of(id); }
  /// As BlobStore::check().
  core::Status check(std::string_view id) const { return blobs_.check(id); }

  /// Returns whether the tenant keeps it, by a reference or in a scene; if all is shared, whether
  /// any tenant does.
  core::Result<bool> keeps(std::string_view id, const Access& access);
  /// Returns whether any tenant has uploaded it by itself, not as a file of a scene.
  core::Result<bool> was_uploaded(std::string_view id);
  core::Result<BlobStore::Upload> start_upload() const { return blobs_.start_upload(); }
  /// Adds the tenant's reference to a completed upload. Returns true if it had one already.
  core::Result<bool> keep(const StoredBlob& blob, const Access& access, double now);
  /// Stores a file of a scene, which the scene's references keep.
  core::Result<StoredBlob> put_for_scene(std::string_view content, double now);

  /// Returns whether jobs need it: those of a tenant, or (empty) all.
  using InUse = std::function<core::Result<bool>(const std::optional<std::string>& tenant)>;
  /// Drops the tenant's reference; the operator, who has none, drops all. Errors: kNotFound;
  /// kConflict while a scene or job that would lose it needs it.
  core::Status remove(std::string_view id, const Access& access, const InUse& in_use);
  /// Removes bytes without references.
  core::Status remove_bytes(std::string_view id) const { return blobs_.remove(id); }

 private:
  core::Status insert(const StoredBlob& blob, double now);

  Database& database_;
  const BlobStore& blobs_;
};

}  // namespace server
