/// PNG, JPEG and WebP files, each by its own library, which needs no module (image_codec.h).
#pragma once

#include "core/image_io/image_codec.h"

namespace core {

/// Returns whether write_display_file() writes this format.
bool has_own_writer(const ImageFormat& format) noexcept;

/// As encode_rows(). Errors: kInvalidArgument (too many pixels for the format), kInternal with the
/// library's message.
Status write_display_file(const ImageRows& image, const ImageFormat& format,
                          const EncodeOptions& options, const ImageSink& sink);

}  // namespace core
