/// Implements ImageCodec with OpenImageIO, in memory only.
#pragma once

#include "core/image_io/image_codec.h"

namespace core::oiio {

/// Stops OpenImageIO from starting threads: the renderer's pool owns the cores.
void set_up();
Result<Image> read_header(std::string_view kind, std::span<const std::byte> file,
                          const ImageLimits& limits);
Result<Image> decode(std::string_view kind, std::span<const std::byte> file,
                     const ImageLimits& limits);
Status encode(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options,
              const ImageSink& sink);

}  // namespace core::oiio
