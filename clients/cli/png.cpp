// PNG (ISO/IEC 15948) by libpng's simplified interface.
#include <string>

#include <png.h>

#include "clients/cli/picture.h"

namespace cli {
namespace {

using core::Error;
using core::ErrorCode;

constexpr std::size_t kChannels = 4;                       // PNG_FORMAT_RGBA
constexpr std::size_t kPixelsMax = std::size_t{1} << 26U;  // the largest film of the service

std::uint8_t over_black(std::uint8_t value, std::uint8_t alpha) {
  return static_cast<std::uint8_t>((value * alpha + 127) / 255);
}

/// Frees libpng's memory on every return path.
class Reader {
 public:
  Reader() { image_.version = PNG_IMAGE_VERSION; }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  ~Reader() { png_image_free(&image_); }

  png_image& image() { return image_; }
  Error broken() const {
    return Error{ErrorCode::kInvalidArgument, std::string("the PNG is damaged: ") + image_.message,
                 ""};
  }

 private:
  png_image image_ = {};
};

}  // namespace

core::Result<Picture> decode_png(std::string_view bytes) {
  constexpr std::size_t kSignature = 8;
  if (bytes.size() < kSignature ||
      png_sig_cmp(reinterpret_cast<png_const_bytep>(bytes.data()), 0, kSignature) != 0) {
    return Error{ErrorCode::kUnsupportedFormat, "the image is not a PNG", ""};
  }
  Reader reader;
  png_image& image = reader.image();
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) {
    return reader.broken();
  }
  const std::size_t count = std::size_t{image.width} * image.height;
  if (count > kPixelsMax) {
    return Error{ErrorCode::kTooLarge,
                 "the PNG has " + std::to_string(image.width) + " x " +
                     std::to_string(image.height) + " pixels; at most 64 Mi can be drawn",
                 ""};
  }
  image.format = PNG_FORMAT_RGBA;
  std::vector<std::uint8_t> raw(count * kChannels);
  if (png_image_finish_read(&image, nullptr, raw.data(), 0, nullptr) == 0) {
    return reader.broken();
  }
  Picture picture{static_cast<int>(image.width), static_cast<int>(image.height), {}};
  picture.pixels.reserve(count);
  for (std::size_t at = 0; at < raw.size(); at += kChannels) {
    const std::uint8_t alpha = raw[at + 3];
    picture.pixels.push_back({over_black(raw[at], alpha), over_black(raw[at + 1], alpha),
                              over_black(raw[at + 2], alpha)});
  }
  return picture;
}

}  // namespace cli
