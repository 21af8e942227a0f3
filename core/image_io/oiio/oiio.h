/// The functions of ImageCodec by OpenImageIO, which never touches a path here.
#pragma once

#include "core/image_io/image_codec.h"

namespace core::oiio {

/// OpenImageIO shall start no threads of its own: the renderer's pool owns the cores.
void set_up();
Result<Image> read_header(std::string_view kind, std::span<const std::byte> file,
                          const ImageLimits& limits);
Result<Image> decode(std::string_view kind, std::span<const std::byte> file,
                     const ImageLimits& limits);
Status encode(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options,
              const ImageSink& sink);

}  // namespace core::oiio
