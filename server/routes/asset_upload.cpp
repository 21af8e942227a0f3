#include "server/routes/asset_upload.h"

#include <shared_mutex>
#include <string_view>

#include "server/observe/clock.h"
#include "server/routes/answers.h"
#include "server/routes/asset_check.h"

namespace server {

core::Result<StoredAsset> store_asset(const RouteContext& context, const Access& access,
                                      const AssetUpload& asset) {
  StorageQuota::Room room = context.quota.room(access.tenant, StorageQuota::Kind::kAsset);
  // The file is stored already and needs no further space.
  const auto kept = context.assets.keeps(asset.id, access);
  if (!kept) {
    return kept.error();
  }
  const auto size = context.assets.find(asset.id, access);
  const bool is_known = *kept && size && *size == asset.declared_bytes;
  core::Status written = is_known ? core::ok_status() : room.grow_to(asset.declared_bytes);
  if (!written) {
    return written.error();
  }
  auto upload = context.assets.start_upload();
  if (!upload) {
    return upload.error();
  }
  const bool complete = asset.read([&](std::string_view piece) {
    written = is_known ? core::ok_status() : room.cover(upload->bytes() + piece.size());
    if (written) {
      written = upload->write(piece);
    }
    return written.has_value();
  });
  if (!written) {
    return written.error();
  }
  if (!complete) {
    return body_cut_short();
  }
  const auto was_uploaded = context.assets.was_uploaded(upload->id());
  if (!was_uploaded) {
    return was_uploaded.error();
  }
  const core::Status sound = check_asset_file(
      {.path = upload->path(), .media_type = asset.media_type, .was_decoded = *was_uploaded});
  if (!sound) {
    return sound.error();
  }
  const std::shared_lock<std::shared_mutex> naming(context.scenes.names_mutex());
  const auto stored = upload->finish(asset.id);
  if (!stored) {
    return stored.error();
  }
  const auto was_kept = context.assets.keep(*stored, access, unix_now());
  if (!was_kept) {
    return was_kept.error();
  }
  return StoredAsset{.id = stored->id, .bytes = stored->bytes, .was_kept = *was_kept};
}

}  // namespace server
