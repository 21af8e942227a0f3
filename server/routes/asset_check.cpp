#include "server/routes/asset_check.h"

#include <cerrno>
#include <span>

#include <fcntl.h>
#include <sys/mman.h>

#include "core/image_io/image_io.h"
#include "core/image_io/image_size.h"
#include "server/store/files.h"

namespace server {
namespace {

core::Status check_bytes(std::span<const std::byte> file, const AssetCheck& asset) {
  const bool is_declared = asset.media_type.starts_with("image/");
  const std::string_view kind = core::image_kind(file);
  if (kind.empty() && !is_declared) {
    return core::ok_status();
  }
  // Scenes accept a JPEG that ends early, with a warning.
  if (kind == "jpg" && is_declared && !core::jpeg_is_whole(file)) {
    return core::Error{core::ErrorCode::kInvalidArgument, "the JPEG is cut short", ""};
  }
  return asset.was_decoded && !kind.empty() ? core::ok_status() : core::check_image_file(file);
}

}  // namespace

core::Status check_asset_file(const AssetCheck& asset) {
  const std::string& path = asset.path;
  const auto file = open_file(path, O_RDONLY);
  const auto bytes = file ? file_bytes(file->get(), path) : file.error();
  if (!bytes) {
    return bytes.error();
  }
  if (*bytes == 0) {  // cannot be mapped
    return check_bytes({}, asset);
  }
  // Mapped, because only an environment map is read beyond its first page.
  void* const data = ::mmap(nullptr, *bytes, PROT_READ, MAP_PRIVATE, file->get(), 0);
  if (data == MAP_FAILED) {
    return file_error("mapping", path, errno);
  }
  const core::Status checked = check_bytes({static_cast<const std::byte*>(data), *bytes}, asset);
  ::munmap(data, *bytes);
  return checked;
}

}  // namespace server
