/// ImageCodec: the interface of the module libtessera-images.so. Only the module links OpenImageIO,
/// whose 260 libraries take 0.2 s to load, so it is loaded when the first image is read, or is
/// written in a format that display_files.h does not write.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string_view>

#include "core/base/result.h"
#include "core/image_io/image_io.h"

namespace core {

/// Receives the output of an encoder: pieces at offsets, which may be written again.
using ImageSink = std::function<Status(std::uint64_t offset, std::span<const std::byte> piece)>;

/// kind: from image_kind(). Files have passed check_file() of image_io.cpp. Exceptions of a
/// decoder, other than std::bad_alloc, are returned as errors.
struct ImageCodec {
  Result<Image> (*read_header)(std::string_view kind, std::span<const std::byte> file,
                               const ImageLimits& limits);
  Result<Image> (*decode)(std::string_view kind, std::span<const std::byte> file,
                          const ImageLimits& limits);
  Status (*encode)(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options,
                   const ImageSink& sink);
};

/// Returns the module's codec; loads it on the first call. Errors: kInternal, with the loader's
/// message.
Result<const ImageCodec*> image_codec();

/// Errors: kTooLarge.
Status check_image_size(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_per_pixel,
                        const ImageLimits& limits);

}  // namespace core
