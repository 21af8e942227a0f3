/// Image files to and from memory. OpenImageIO is loaded with the first of them (image_codec.h).
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/color/tone_map.h"
#include "core/image_io/image.h"
#include "core/image_io/image_rows.h"

namespace core {

struct ImageLimits {
  int side_max = 16384;
  std::size_t decoded_bytes_max = std::size_t{1} << 30;
};

/// Width, height and channels from the header alone. Formats by magic bytes: PNG, JPEG, WebP, EXR,
/// HDR (Radiance), TIFF, KTX2 (see ktx2.h). Errors: kInvalidArgument, kTooLarge.
Result<Image> read_image_header(std::span<const std::byte> file);

/// Of a value as it is decoded.
constexpr std::size_t bytes_per_value(PixelType type) noexcept {
  return type == PixelType::kU8 ? 1 : type == PixelType::kU16 ? 2 : 4;
}

/// Decodes to 8-bit, 16-bit or float as the file has it (half becomes float), 1 to 4 channels.
/// Errors: kInvalidArgument with the reason, kTooLarge before any pixel memory is taken.
Result<Image> decode_image(std::span<const std::byte> file, const ImageLimits& limits);

struct ImageFormat {
  std::string_view extension;  ///< "png"
  std::string_view mime;       ///< "image/png"
  bool high_dynamic_range;     ///< written linear, tone map and exposure do not apply
  bool has_alpha;
};
/// png jpg webp exr hdr tif.
std::span<const ImageFormat> image_formats();

struct EncodeOptions {
  ToneMap tone_map = ToneMap::kSrgb;
  float exposure_stops = 0;  ///< multiplies by 2^stops before tone mapping
  bool is_color = true;      ///< false: data (normals, depth, samples); no tone curve
  int quality = 92;          ///< jpg, webp
  /// As on a screen, each in [0,1]: what stands behind a picture of four channels, which loses its
  /// alpha. Null: nothing, or white in formats without alpha.
  std::optional<Rgb> background = {};
  std::map<std::string, std::string> metadata;   ///< text attributes where the format has them
  std::vector<std::string> whole_channels = {};  ///< unsigned integers in EXR, up to 2^24
  bool parts = false;  ///< EXR: each layer (channel names up to the last dot) a part of its own
};

/// Colour channels of EXR (R G B A, and those of the layers "beauty" and "albedo") are half floats,
/// finite values held within +-65504; all others, and all when is_color is false or whole_channels
/// are among them, are float. With parts
/// that is decided part by part; the first has the metadata, and parts of mattes theirs. Display
/// formats take 1, 3 or 4 channels (R, G, B[, A] with alpha associated in `image`; written
/// unassociated in PNG and WebP, associated in EXR). EXR takes any channels. NaN is written as is
/// in float formats and as 0 in display formats. Errors: kInternal with the library's words.
Result<std::vector<std::byte>> encode_image(const FloatImage& image, const ImageFormat& format,
                                            const EncodeOptions& options);
/// The same from rows, some of which are in memory at a time.
Result<std::string> encode_rows(const ImageRows& rows, const ImageFormat& format,
                                const EncodeOptions& options);
/// The most that encode_rows() takes, its result included; measured by tests/stress/memory
/// --measure.
std::uint64_t encoding_bytes(int width, int height, int channels, const ImageFormat& format);

}  // namespace core
