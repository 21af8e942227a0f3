/// Stores an uploaded file as an asset of a tenant.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

#include "core/base/result.h"
#include "server/access.h"
#include "server/http/message.h"
#include "server/routes/context.h"

namespace server {

struct AssetUpload {
  std::string id;                    ///< sha256 that the content must have; empty: any
  std::uint64_t declared_bytes = 0;  ///< 0: unknown
  std::string media_type = {};       ///< An image/ type must be that of an image.
  /// Passes the content on, as BodyReader::read().
  std::function<bool(const BodyReader::Sink& sink)> read;
};
struct StoredAsset {
  std::string id;
  std::uint64_t bytes = 0;
  bool was_kept = false;  ///< the tenant had it already
};
/// Errors: kNoSpace, kOverQuota; kInvalidArgument for another content than the id says, and for a
/// damaged image; kBadSyntax when `read` fails.
core::Result<StoredAsset> store_asset(const RouteContext& context, const Access& access,
                                      const AssetUpload& asset);

}  // namespace server
