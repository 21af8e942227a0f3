// Any bytes as an image file: no crash, no read beyond the end, no more memory than the limit
// allows.
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/image_io/image_io.h"
#include "core/image_io/radiance.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  const auto header = core::read_image_header(bytes);
  const auto image = core::decode_image(bytes, {.side_max = 1024, .decoded_bytes_max = 1U << 24U});
  static_cast<void>(header);
  static_cast<void>(image);
  static_cast<void>(core::primaries_warning(bytes, "the file"));
  return 0;
}
