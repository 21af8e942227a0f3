#include "core/image_io/image_io.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <utility>

#include "core/base/invalid.h"
#include "core/image_io/display_files.h"
#include "core/image_io/exr_header.h"
#include "core/image_io/hdr.h"
#include "core/image_io/image_codec.h"
#include "core/image_io/image_size.h"
#include "core/image_io/ktx2.h"
#include "core/image_io/png_jpeg.h"
#include "core/image_io/webp.h"

namespace core {
namespace {

/// libwebp processes the whole image: memory per pixel in addition to the file. Measured: 20.
constexpr std::uint64_t kWebpBytes = 32;
/// So do libheif and libaom. Measured: 25.
constexpr std::uint64_t kAvifBytes = 32;
/// Memory of any encoder for its tables and current rows.
constexpr std::uint64_t kCodecBytes = std::uint64_t{2} << 20U;

Error failed(std::string message) { return {ErrorCode::kInternal, std::move(message), ""}; }

/// Returns the kind of a file that may be passed to a decoder.
Result<std::string_view> check_file(std::span<const std::byte> file, const ImageLimits& limits) {
  const std::string_view kind = image_kind(file);
  if (kind.empty()) {
    return invalid("not an image in a supported format: PNG, JPEG, WebP, EXR, HDR, TIFF or KTX2");
  }
  if (const auto size = peek_image_size(file)) {
    if (auto fits = check_image_size(size->width, size->height, 1, limits); !fits) {
      return fits.error();
    }
  } else if (kind != "hdr" && kind != "tif" && kind != "ktx2") {
    return invalid("the " + std::string(kind) + " header is cut or malformed");
  }
  const auto header = kind == "exr" ? exr_header(file) : std::nullopt;
  if (header && header->is_cube) {
    return invalid(
        "the EXR is a cube map (envmap = cube), which is not read; convert it to a panorama with "
        "OpenEXR's exrenvmap -latlong");
  }
  if (header && !header->subsampled.empty()) {
    return invalid("channel \"" + std::string(header->subsampled) +
                   "\" of the EXR has fewer values than pixels: images of luminance and chroma (Y, "
                   "RY, BY) are not read; save it as R, G and B");
  }
  // libpng reports this only on stderr.
  if (kind == "png" && !png_is_whole(file)) {
    return invalid("the PNG is truncated or its chunks are malformed");
  }
  if (kind == "tif" && !tiff_is_whole(file)) {
    return invalid("the TIFF is truncated or its directory is malformed");
  }
  return kind;
}

/// Returns the name of a compression that is newer than OpenEXR 3.1, which reads up to DWAB; else
/// empty. Source: Imf::Compression of OpenEXR 3.4.
std::string unread_compression(unsigned number) {
  constexpr unsigned kDwab = 9;
  constexpr unsigned kHtj2k256 = 10;
  constexpr unsigned kHtj2k32 = 11;
  return number <= kDwab                             ? ""
         : number == kHtj2k256 || number == kHtj2k32 ? "HTJ2K"
                                                     : "method " + std::to_string(number);
}

using Reader = Result<Image> (*)(std::span<const std::byte> file, const ImageLimits& limits);
/// Readers of formats that need no module: header and pixels.
struct OwnFormat {
  std::string_view kind;
  Reader header;
  Reader pixels;
};
constexpr OwnFormat kOwnFormats[] = {{"hdr", &read_hdr_header, &decode_hdr},
                                     {"jpg", &read_jpeg_header, &decode_jpeg},
                                     {"ktx2", &read_ktx2_header, &decode_ktx2},
                                     {"png", &read_png_header, &decode_png},
                                     {"webp", &read_webp_header, &decode_webp}};

/// Calls a function of the format, or of the codec.
template <typename Function>
Result<Image> read(std::span<const std::byte> file, const ImageLimits& limits,
                   Reader OwnFormat::*own, Function ImageCodec::*function) {
  const auto kind = check_file(file, limits);
  if (!kind) {
    return kind.error();
  }
  const auto* const format = std::find_if(std::begin(kOwnFormats), std::end(kOwnFormats),
                                          [&](const OwnFormat& f) { return f.kind == *kind; });
  if (format != std::end(kOwnFormats) && !(*kind == "jpg" && has_inks(file))) {
    return (format->*own)(file, limits);
  }
  const auto codec = image_codec();
  if (!codec) {
    return codec.error();
  }
  auto image = ((*codec)->*function)(*kind, file, limits);
  if (!image && *kind == "exr") {
    if (const std::string unread = unread_compression(exr_header(file)->compression);
        !unread.empty()) {
      return invalid("the EXR is compressed with " + unread +
                     ", which is not read here; save it with ZIP or PIZ compression");
    }
  }
  return image;
}

/// Content: of bytes, from which a file is assembled.
template <typename Content>
Result<Content> encode(const ImageRows& image, const ImageFormat& format,
                       const EncodeOptions& options) {
  const int channels = image.channels();
  if (format.extension != "exr" && channels != 1 && channels != 3 && channels != 4) {
    return failed(std::string(format.extension) + " takes 1, 3 or 4 channels, not " +
                  std::to_string(channels));
  }
  if (image.width <= 0 || image.height <= 0 || channels == 0) {
    return failed("an image without pixels");
  }
  Content file;
  const ImageSink sink = [&file](std::uint64_t offset, std::span<const std::byte> piece) {
    const auto at = static_cast<std::size_t>(offset);
    file.resize(std::max(file.size(), at + piece.size()));
    std::memcpy(file.data() + at, piece.data(), piece.size());
    return ok_status();
  };
  if (has_own_writer(format)) {
    const Status written = write_display_file(image, format, options, sink);
    return written ? Result<Content>(std::move(file)) : written.error();
  }
  const auto codec = image_codec();
  if (!codec) {
    return codec.error();
  }
  const Status written = (*codec)->encode(image, format, options, sink);
  return written ? Result<Content>(std::move(file)) : written.error();
}

}  // namespace

Result<Image> read_image_header(std::span<const std::byte> file) {
  return read(file, {}, &OwnFormat::header, &ImageCodec::read_header);
}

Status check_image_file(std::span<const std::byte> file) {
  const auto status_of = [](const Result<Image>& read) {
    return read ? ok_status() : Status(read.error());
  };
  if (image_kind(file) == "ktx2") {
    return status_of(read_ktx2_header(file, {}));
  }
  const auto kind = check_file(file, {});
  if (!kind) {
    return kind.error();
  }
  if (*kind == "exr" && !exr_header(file)->is_whole) {
    return invalid("the EXR is cut short or damaged");
  }
  return *kind == "hdr"    ? check_hdr(file)
         : *kind == "webp" ? status_of(read_webp_header(file, {}))
                           : ok_status();
}

Result<Image> decode_image(std::span<const std::byte> file, const ImageLimits& limits) {
  return read(file, limits, &OwnFormat::pixels, &ImageCodec::decode);
}

Result<std::vector<std::byte>> encode_image(const FloatImage& image, const ImageFormat& format,
                                            const EncodeOptions& options) {
  if (image.width <= 0 || image.height <= 0 ||
      image.values.size() != image.index(0, image.height, 0)) {
    return failed("an image without pixels, or with the wrong number of values");
  }
  const ImageRows rows = {image.width, image.height, image.channel_names,
                          [&image](int y) { return &image.values[image.index(0, y, 0)]; }};
  return encode<std::vector<std::byte>>(rows, format, options);
}

Result<std::string> encode_rows(const ImageRows& rows, const ImageFormat& format,
                                const EncodeOptions& options) {
  return encode<std::string>(rows, format, options);
}

std::uint64_t encoding_bytes(int width, int height, int channels, const ImageFormat& format,
                             int bits) {
  const auto pixels = static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height);
  const std::uint64_t value_bytes = format.high_dynamic_range ? 4 : bits == 16 ? 2 : 1;
  // Noise does not compress, and a growing file exists twice for a moment.
  const std::uint64_t file_bytes = 2 * pixels * value_bytes * static_cast<std::uint64_t>(channels);
  const std::uint64_t whole = format.extension == "webp"   ? pixels * kWebpBytes
                              : format.extension == "avif" ? pixels * kAvifBytes
                                                           : 0;
  return file_bytes + whole + kCodecBytes;
}

}  // namespace core
