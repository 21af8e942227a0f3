#include "server/routes/asset_check.h"

#include <cerrno>
#include <span>

#include <fcntl.h>
#include <sys/mman.h>

#include "core/image_io/hdr.h"
#include "core/image_io/image_size.h"
#include "server/store/files.h"

namespace server {
namespace {

core::Status check_bytes(std::span<const std::byte> file) {
  const std::string_view kind = core::image_kind(file);
  if (kind == "hdr") {
    return core::check_hdr(file);
  }
  if (kind == "exr" && !core::peek_image_size(file)) {
    return core::Error{core::ErrorCode::kInvalidArgument,
                       "the OpenEXR image is cut short or its header is damaged", ""};
  }
  return core::ok_status();
}

}  // namespace

core::Status check_asset_file(const std::string& path) {
  const auto file = open_file(path, O_RDONLY);
  const auto bytes = file ? file_bytes(file->get(), path) : file.error();
  if (!bytes || *bytes == 0) {
    return bytes ? core::ok_status() : core::Status(bytes.error());
  }
  // Mapped, because only an environment map is read beyond its first page.
  void* const data = ::mmap(nullptr, *bytes, PROT_READ, MAP_PRIVATE, file->get(), 0);
  if (data == MAP_FAILED) {
    return file_error("mapping", path, errno);
  }
  const core::Status checked = check_bytes({static_cast<const std::byte*>(data), *bytes});
  ::munmap(data, *bytes);
  return checked;
}

}  // namespace server
