#include <array>

#include "core/image_io/image_io.h"

namespace core {
namespace {

constexpr std::array kFormats = {
    ImageFormat{"png", "image/png", false, true},
    ImageFormat{"jpg", "image/jpeg", false, false},
    ImageFormat{"webp", "image/webp", false, true},
    ImageFormat{"avif", "image/avif", false, true},
    ImageFormat{"exr", "image/x-exr", true, true},
    ImageFormat{"hdr", "image/vnd.radiance", true, false},
    ImageFormat{"tif", "image/tiff", true, true},
};

}  // namespace

std::span<const ImageFormat> image_formats() { return kFormats; }

}  // namespace core
