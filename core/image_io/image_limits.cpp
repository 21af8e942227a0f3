#include <string>
#include <utility>

#include "core/image_io/image_codec.h"

namespace core {
namespace {

Error too_large(std::string message) { return {ErrorCode::kTooLarge, std::move(message), ""}; }

}  // namespace

Status check_image_size(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_per_pixel,
                        const ImageLimits& limits) {
  const auto side_max = static_cast<std::uint64_t>(limits.side_max);
  if (width > side_max || height > side_max) {
    return too_large("image of " + std::to_string(width) + "x" + std::to_string(height) +
                     " pixels; a side may have " + std::to_string(side_max));
  }
  if (width * height * bytes_per_pixel > limits.decoded_bytes_max) {
    return too_large("image of " + std::to_string(width * height * bytes_per_pixel) +
                     " bytes when decoded; " + std::to_string(limits.decoded_bytes_max) +
                     " are allowed");
  }
  return ok_status();
}

}  // namespace core
