#include "core/image_io/png_jpeg.h"

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <new>
#include <stdexcept>
#include <string>
#include <string_view>

#include "core/base/invalid.h"
#include "core/image_io/codec_errors.h"
#include "core/image_io/image_codec.h"

namespace core {
namespace {

Status check_size(const Image& image, const ImageLimits& limits) {
  const std::size_t pixel_bytes =
      bytes_per_value(image.type) * static_cast<std::size_t>(image.channels);
  return check_image_size(static_cast<std::uint64_t>(image.width),
                          static_cast<std::uint64_t>(image.height), pixel_bytes, limits);
}

/// A PNG that is read. Borrows the file. Errors of libpng are thrown.
class PngReader {
 public:
  explicit PngReader(std::span<const std::byte> file)
      : rest_(file),
        png_(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, &throw_png_error,
                                    &ignore_png_warning)) {
    info_ = png_ == nullptr ? nullptr : png_create_info_struct(png_);
    if (info_ == nullptr) {
      png_destroy_read_struct(&png_, nullptr, nullptr);
      throw std::bad_alloc();
    }
  }
  ~PngReader() { png_destroy_read_struct(&png_, &info_, nullptr); }
  PngReader(const PngReader&) = delete;
  PngReader& operator=(const PngReader&) = delete;

  Result<Image> header(const ImageLimits& limits) {
    png_set_read_fn(png_, this, &take);
    png_read_info(png_, info_);
    png_set_expand(png_);
    if (std::endian::native == std::endian::little) {
      png_set_swap(png_);
    }
    passes_ = png_set_interlace_handling(png_);
    png_read_update_info(png_, info_);
    Image image;
    image.width = static_cast<int>(png_get_image_width(png_, info_));
    image.height = static_cast<int>(png_get_image_height(png_, info_));
    image.channels = png_get_channels(png_, info_);
    image.type = png_get_bit_depth(png_, info_) == 16 ? PixelType::kU16 : PixelType::kU8;
    const Status fits = check_size(image, limits);
    return fits ? Result<Image>(std::move(image)) : fits.error();
  }
  /// Pre: header() succeeded.
  void read(Image& image) {
    const std::size_t stride = png_get_rowbytes(png_, info_);
    image.bytes.resize(stride * static_cast<std::size_t>(image.height));
    for (int pass = 0; pass < passes_; ++pass) {
      for (int y = 0; y < image.height; ++y) {
        std::byte* const row = &image.bytes[stride * static_cast<std::size_t>(y)];
        png_read_row(png_, reinterpret_cast<png_bytep>(row), nullptr);
      }
    }
    png_read_end(png_, nullptr);
  }

 private:
  static void take(png_structp png, png_bytep to, std::size_t size) {
    PngReader& reader = *static_cast<PngReader*>(png_get_io_ptr(png));
    if (size > reader.rest_.size()) {
      png_error(png, "the file is truncated");
    }
    std::memcpy(to, reader.rest_.data(), size);
    reader.rest_ = reader.rest_.subspan(size);
  }

  std::span<const std::byte> rest_;
  png_structp png_;
  png_infop info_ = nullptr;
  int passes_ = 1;
};

/// A JPEG that is read. Borrows the file. Errors of libjpeg are thrown.
class JpegReader {
 public:
  explicit JpegReader(std::span<const std::byte> file) {
    jpeg_.err = throwing_errors(errors_);
    jpeg_create_decompress(&jpeg_);
    jpeg_mem_src(&jpeg_, reinterpret_cast<const unsigned char*>(file.data()),
                 static_cast<unsigned long>(file.size()));
  }
  ~JpegReader() { jpeg_destroy_decompress(&jpeg_); }
  JpegReader(const JpegReader&) = delete;
  JpegReader& operator=(const JpegReader&) = delete;

  int components() {
    jpeg_read_header(&jpeg_, TRUE);
    return jpeg_.num_components;
  }
  /// Pre: components() was called.
  Result<Image> header(const ImageLimits& limits) {
    jpeg_calc_output_dimensions(&jpeg_);
    Image image;
    image.width = static_cast<int>(jpeg_.output_width);
    image.height = static_cast<int>(jpeg_.output_height);
    image.channels = jpeg_.output_components;
    if (image.channels != 1 && image.channels != 3) {
      return invalid("jpg: an image of " + std::to_string(image.channels) +
                     " channels cannot be read");
    }
    const Status fits = check_size(image, limits);
    return fits ? Result<Image>(std::move(image)) : fits.error();
  }
  /// Pre: header() succeeded.
  void read(Image& image) {
    image.bytes.resize(image.value_count());
    jpeg_start_decompress(&jpeg_);
    const std::size_t stride =
        static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.channels);
    while (jpeg_.output_scanline < jpeg_.output_height) {
      JSAMPROW rows[] = {reinterpret_cast<JSAMPROW>(&image.bytes[stride * jpeg_.output_scanline])};
      jpeg_read_scanlines(&jpeg_, rows, 1);
    }
    jpeg_finish_decompress(&jpeg_);
  }

 private:
  jpeg_error_mgr errors_{};
  jpeg_decompress_struct jpeg_{};
};

/// Returns the errors of a library that read() throws; kind: before the message.
template <typename Read>
Result<Image> without_exceptions(std::string_view kind, const Read& read) {
  try {
    return read();
  } catch (const std::runtime_error& problem) {
    return invalid(std::string(kind) + ": " + problem.what());
  }
}

Result<Image> read_png(std::span<const std::byte> file, const ImageLimits& limits, bool decodes) {
  return without_exceptions("png", [&] {
    PngReader reader(file);
    auto image = reader.header(limits);
    if (image && decodes) {
      reader.read(*image);
    }
    return image;
  });
}

Result<Image> read_jpeg(std::span<const std::byte> file, const ImageLimits& limits, bool decodes) {
  return without_exceptions("jpg", [&] {
    JpegReader reader(file);
    reader.components();
    auto image = reader.header(limits);
    if (image && decodes) {
      reader.read(*image);
    }
    return image;
  });
}

}  // namespace

Result<Image> read_png_header(std::span<const std::byte> file, const ImageLimits& limits) {
  return read_png(file, limits, false);
}
Result<Image> decode_png(std::span<const std::byte> file, const ImageLimits& limits) {
  return read_png(file, limits, true);
}

bool has_inks(std::span<const std::byte> file) {
  try {
    return JpegReader(file).components() == 4;
  } catch (const std::runtime_error&) {
    return false;  // decoding says why
  }
}
Result<Image> read_jpeg_header(std::span<const std::byte> file, const ImageLimits& limits) {
  return read_jpeg(file, limits, false);
}
Result<Image> decode_jpeg(std::span<const std::byte> file, const ImageLimits& limits) {
  return read_jpeg(file, limits, true);
}

}  // namespace core
