#include "core/image_io/display_files.h"

#include <bit>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <webp/encode.h>

#include "core/image_io/codec_errors.h"
#include "core/image_io/display_row.h"

namespace core {
namespace {

constexpr int kWebpSideMax = 16383;

Error failed(std::string message) { return {ErrorCode::kInternal, std::move(message), ""}; }

/// An open PNG.
class PngFile {
 public:
  explicit PngFile(const ImageSink& sink)
      : sink_(sink),
        png_(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, &throw_png_error,
                                     &ignore_png_warning)),
        info_(png_ == nullptr ? nullptr : png_create_info_struct(png_)) {
    if (info_ == nullptr) {
      png_destroy_write_struct(&png_, nullptr);
      throw std::bad_alloc();
    }
    png_set_write_fn(png_, this, &give, nullptr);
  }
  ~PngFile() { png_destroy_write_struct(&png_, &info_); }
  PngFile(const PngFile&) = delete;
  PngFile& operator=(const PngFile&) = delete;

  void write_header(const ImageRows& image, int channels, const EncodeOptions& options) {
    constexpr int kTypes[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                              PNG_COLOR_TYPE_RGB_ALPHA};
    png_set_IHDR(png_, info_, static_cast<png_uint_32>(image.width),
                 static_cast<png_uint_32>(image.height), options.bits, kTypes[channels - 1],
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_compression_level(png_, 1);
    if (options.is_color && options.tone_map != ToneMap::kLinear) {
      png_set_sRGB_gAMA_and_cHRM(png_, info_, PNG_sRGB_INTENT_PERCEPTUAL);
    }
    std::vector<png_text> texts;
    for (const auto& [key, value] : options.metadata) {
      png_text& text = texts.emplace_back();
      text.compression = PNG_TEXT_COMPRESSION_NONE;
      text.key = const_cast<char*>(key.c_str());
      text.text = const_cast<char*>(value.c_str());
      text.text_length = value.size();
    }
    png_set_text(png_, info_, texts.data(), static_cast<int>(texts.size()));
    png_write_info(png_, info_);
    if (options.bits == 16 && std::endian::native == std::endian::little) {
      png_set_swap(png_);
    }
  }
  template <typename Value>
  void write_rows(const ImageRows& image, const DisplayRow& display) {
    std::vector<Value> row(static_cast<std::size_t>(image.width) *
                           static_cast<std::size_t>(display.channels()));
    for (int y = 0; y < image.height && status_; ++y) {
      display.write(image.row(y), image.width, row.data());
      png_write_row(png_, reinterpret_cast<png_const_bytep>(row.data()));
    }
    if (status_) {
      png_write_end(png_, info_);
    }
  }
  const Status& status() const { return status_; }

 private:
  static void give(png_structp png, png_bytep bytes, std::size_t size) {
    PngFile& file = *static_cast<PngFile*>(png_get_io_ptr(png));
    if (file.status_) {
      file.status_ = file.sink_(file.written_, std::as_bytes(std::span(bytes, size)));
      file.written_ += size;
    }
  }

  const ImageSink& sink_;
  png_structp png_;
  png_infop info_;
  std::uint64_t written_ = 0;
  Status status_ = ok_status();
};

Status write_png(const ImageRows& image, const DisplayRow& display, const EncodeOptions& options,
                 const ImageSink& sink) {
  PngFile file(sink);
  file.write_header(image, display.channels(), options);
  if (options.bits == 16) {
    file.write_rows<std::uint16_t>(image, display);
  } else {
    file.write_rows<std::uint8_t>(image, display);
  }
  return file.status();
}

/// An open JPEG.
class JpegFile {
 public:
  JpegFile() {
    jpeg_.err = throwing_errors(errors_);
    jpeg_create_compress(&jpeg_);
    jpeg_mem_dest(&jpeg_, &bytes_, &size_);
  }
  ~JpegFile() {
    jpeg_destroy_compress(&jpeg_);
    std::free(bytes_);
  }
  JpegFile(const JpegFile&) = delete;
  JpegFile& operator=(const JpegFile&) = delete;

  void write(const ImageRows& image, const DisplayRow& display, int quality) {
    jpeg_.image_width = static_cast<JDIMENSION>(image.width);
    jpeg_.image_height = static_cast<JDIMENSION>(image.height);
    jpeg_.input_components = display.channels();
    jpeg_.in_color_space = display.channels() == 1 ? JCS_GRAYSCALE : JCS_RGB;
    jpeg_set_defaults(&jpeg_);
    jpeg_set_quality(&jpeg_, quality, TRUE);
    jpeg_start_compress(&jpeg_, TRUE);
    std::vector<std::uint8_t> row(static_cast<std::size_t>(image.width) *
                                  static_cast<std::size_t>(display.channels()));
    for (int y = 0; y < image.height; ++y) {
      display.write(image.row(y), image.width, row.data());
      JSAMPROW rows[] = {row.data()};
      jpeg_write_scanlines(&jpeg_, rows, 1);
    }
    jpeg_finish_compress(&jpeg_);
  }
  std::span<const std::byte> bytes() const {
    return std::as_bytes(std::span(bytes_, std::size_t{size_}));
  }

 private:
  jpeg_error_mgr errors_{};
  jpeg_compress_struct jpeg_{};
  unsigned char* bytes_ = nullptr;
  unsigned long size_ = 0;
};

/// OpenImageIO would take libwebp's slowest method, which takes seconds for noise in alpha and
/// saves 2%.
Status write_webp(const ImageRows& image, const DisplayRow& display, int quality,
                  const ImageSink& sink) {
  if (image.width > kWebpSideMax || image.height > kWebpSideMax) {
    return Error{ErrorCode::kInvalidArgument,
                 "a WebP image has at most " + std::to_string(kWebpSideMax) + " pixels per side",
                 ""};
  }
  const auto stride =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(display.channels());
  std::vector<std::uint8_t> pixels(stride * static_cast<std::size_t>(image.height));
  for (int y = 0; y < image.height; ++y) {
    display.write(image.row(y), image.width, &pixels[stride * static_cast<std::size_t>(y)]);
  }
  const auto encode = display.channels() == 4 ? &WebPEncodeRGBA : &WebPEncodeRGB;
  std::uint8_t* made = nullptr;
  const std::size_t size = encode(pixels.data(), image.width, image.height,
                                  static_cast<int>(stride), static_cast<float>(quality), &made);
  const std::unique_ptr<std::uint8_t, void (*)(void*)> owner(made, &WebPFree);
  if (size == 0) {
    return failed("libwebp could not encode the image");
  }
  return sink(0, std::as_bytes(std::span(made, size)));
}

}  // namespace

bool has_own_writer(const ImageFormat& format) noexcept {
  return format.extension == "png" || format.extension == "jpg" || format.extension == "webp";
}

Status write_display_file(const ImageRows& image, const ImageFormat& format,
                          const EncodeOptions& options, const ImageSink& sink) {
  const DisplayRow display(image, format, options);
  try {
    if (format.extension == "png") {
      return write_png(image, display, options, sink);
    }
    if (format.extension == "webp") {
      return write_webp(image, display, options.quality, sink);
    }
    JpegFile file;
    file.write(image, display, options.quality);
    return sink(0, file.bytes());
  } catch (const std::runtime_error& problem) {
    return failed((format.extension == "png" ? "libpng: " : "libjpeg: ") +
                  std::string(problem.what()));
  }
}

}  // namespace core
