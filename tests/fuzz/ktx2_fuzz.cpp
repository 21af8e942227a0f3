// Any bytes as a KTX2 file: no crash, no read beyond the end, no more memory than the limit allows.
#include <cstddef>
#include <cstdint>
#include <span>

#include "core/image_io/ktx2.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  const core::ImageLimits limits = {.side_max = 1024, .decoded_bytes_max = 1U << 22U};
  const auto header = core::read_ktx2_header(bytes, limits);
  const auto image = core::decode_ktx2(bytes, limits);
  static_cast<void>(header);
  static_cast<void>(image);
  return 0;
}
