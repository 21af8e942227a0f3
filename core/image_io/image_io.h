/// Reads and writes image files in memory. OpenImageIO is loaded on its first use
/// (image_codec.h).
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

/// Reads width, height and channels from the header only. Formats by magic bytes: PNG, JPEG, WebP,
/// EXR, HDR (Radiance), TIFF, KTX2 (see ktx2.h). Errors: kInvalidArgument, kTooLarge.
Result<Image> read_image_header(std::span<const std::byte> file);

/// Returns the error of read_image_header(), or that of decoding as far as it shows without pixels
/// in memory: a cut or damaged HDR, a cut PNG, TIFF, WebP, or EXR.
Status check_image_file(std::span<const std::byte> file);

/// Returns the size of a decoded value.
constexpr std::size_t bytes_per_value(PixelType type) noexcept {
  return type == PixelType::kU8 ? 1 : type == PixelType::kU16 ? 2 : 4;
}

/// Decodes to 8-bit, 16-bit or float as stored (half becomes float), 1 to 4 channels. Errors:
/// kInvalidArgument with the reason, kTooLarge before pixel memory is allocated.
Result<Image> decode_image(std::span<const std::byte> file, const ImageLimits& limits);

struct ImageFormat {
  std::string_view extension;  ///< "png"
  std::string_view mime;       ///< "image/png"
  bool high_dynamic_range;     ///< stored linear, without tone mapping and exposure
  bool has_alpha;
};
/// png jpg webp avif exr hdr tif.
std::span<const ImageFormat> image_formats();

struct EncodeOptions {
  ToneMap tone_map = ToneMap::kSrgb;
  float exposure_stops = 0;                ///< multiplies by 2^stops before tone mapping
  std::optional<float> white_kelvin = {};  ///< WhiteBalance, before contrast and tone mapping
  /// Slope in stops: middle grey, 0.18, stays, and a stop beside it becomes this many. Before tone
  /// mapping.
  float contrast = 1;
  bool is_color = true;  ///< false: data (normals, depth, samples); no tone curve
  int quality = 92;      ///< jpg, webp, avif
  int bits = 8;          ///< of each channel; 16 only in png
  /// Display values in [0,1]: the background of an image with four channels, which then loses its
  /// alpha. Null: none, or white in formats without alpha.
  std::optional<Rgb> background = {};
  std::map<std::string, std::string> metadata;   ///< text attributes, if the format supports them
  std::vector<std::string> whole_channels = {};  ///< unsigned integers in EXR, up to 2^24
  bool parts = false;  ///< EXR: each layer (channel names up to the last dot) is a separate part
};

/// Encodes an image. Colour channels of EXR (R G B A, and those of the layers "beauty" and
/// "albedo") are half floats; others are float, and all are float if a finite colour is outside of
/// the range of half floats, +-65504, if all colours of a layer are below 2^-14, where half floats
/// have fewer bits, if is_color is false or if whole_channels are among them.
/// With parts this is decided per part; the first has the metadata, and parts of mattes their own.
/// Display formats take 1, 3 or 4 channels (R, G, B[, A] with alpha associated in `image`; written
/// unassociated in PNG, WebP and AVIF, associated in EXR). EXR takes any channels. NaN is written
/// unchanged in float formats and as 0 in display formats. Errors: kInternal with the library's
/// message.
Result<std::vector<std::byte>> encode_image(const FloatImage& image, const ImageFormat& format,
                                            const EncodeOptions& options);
/// As above, from rows, only some of which are in memory at a time.
Result<std::string> encode_rows(const ImageRows& rows, const ImageFormat& format,
                                const EncodeOptions& options);
/// Returns the maximum memory of encode_rows(), including its result; measured by
/// tests/stress/memory --measure.
std::uint64_t encoding_bytes(int width, int height, int channels, const ImageFormat& format,
                             int bits = 8);

}  // namespace core
