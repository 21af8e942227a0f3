/// Image: pixels in memory, row 0 on top, channels interleaved.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/paged_memory.h"

namespace core {

enum class PixelType : std::uint8_t { kU8, kU16, kF32 };

struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;  ///< 1 grey, 2 grey+alpha, 3 RGB, 4 RGBA; named layers may have any number.
  PixelType type = PixelType::kU8;
  /// width * height * channels values of `type`, native endian. 8-bit and 16-bit values are as
  /// stored in the file, including its sRGB encoding.
  PagedVector<std::byte> bytes;

  std::size_t value_count() const noexcept {
    return static_cast<std::size_t>(width) * static_cast<std::size_t>(height) *
           static_cast<std::size_t>(channels);
  }
};

/// A float image with named channels: the contents of an EXR, or one layer of a film.
struct FloatImage {
  int width = 0;
  int height = 0;
  std::vector<std::string> channel_names;  ///< e.g. "R", "G", "B", "A", "albedo.R", "depth.Z"
  std::vector<float> values;               ///< interleaved, row 0 on top

  int channels() const noexcept { return static_cast<int>(channel_names.size()); }
  std::size_t index(int x, int y, int channel) const noexcept {
    return (static_cast<std::size_t>(y) * static_cast<std::size_t>(width) +
            static_cast<std::size_t>(x)) *
               channel_names.size() +
           static_cast<std::size_t>(channel);
  }
};

}  // namespace core
