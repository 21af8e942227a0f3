/// Assets: uploaded files by the hash of their content, and who keeps them.
///
/// Equal uploads share their bytes; each tenant that brings them has a reference of its own. The
/// files of a scene are there for the tenants that keep the scene. Bytes go with the last of both.
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

  /// Size. Errors: kNotFound, also for one that `access` does not see.
  core::Result<std::uint64_t> find(std::string_view id, const Access& access);
  /// The whole content. Errors: of find().
  core::Result<core::SharedBytes> read(std::string_view id, const Access& access);
  core::Result<UniqueFd> open(std::string_view id, const Access& access);
  /// Of one that find() has found.
  std::string path_of(std::string_view id) const { return blobs_.path_of(id); }

  /// Does the tenant keep it already, by itself or in a scene? Where all is shared: does anybody?
  core::Result<bool> keeps(std::string_view id, const Access& access);
  core::Result<BlobStore::Upload> start_upload() const { return blobs_.start_upload(); }
  /// A reference of the tenant to an upload that is finished. True: it kept it before.
  core::Result<bool> keep(const StoredBlob& blob, const Access& access, double now);
  /// A file of a scene, which the scene's references keep.
  core::Result<StoredBlob> put_for_scene(std::string_view content, double now);

  /// Whether jobs need it, those of a tenant or (empty) of all.
  using InUse = std::function<core::Result<bool>(const std::optional<std::string>& tenant)>;
  /// Drops the tenant's reference; the operator, who has none, drops all. Errors: kNotFound;
  /// kConflict while a scene or job that would lose it needs it.
  core::Status remove(std::string_view id, const Access& access, const InUse& in_use);
  /// Bytes that nothing keeps any more.
  core::Status remove_bytes(std::string_view id) const { return blobs_.remove(id); }

 private:
  core::Status insert(const StoredBlob& blob, double now);

  Database& database_;
  const BlobStore& blobs_;
};

}  // namespace server
