#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/image_io/image_io.h"
#include "core/image_io/image_size.h"
#include "core/image_io/oiio_setup.h"

namespace core {

void set_up_oiio() {
  static const bool kDone = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(kDone);
}

namespace {

Error invalid(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message), ""}; }
Error too_large(std::string message) { return {ErrorCode::kTooLarge, std::move(message), ""}; }

// The library's words, one line, without the made-up file name.
std::string library_words(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') {
    text.pop_back();
  }
  return text.empty() ? "no reason given" : text;
}

PixelType pixel_type(OIIO::TypeDesc format) noexcept {
  if (format == OIIO::TypeDesc::UINT8 || format == OIIO::TypeDesc::INT8) {
    return PixelType::kU8;
  }
  return format == OIIO::TypeDesc::UINT16 || format == OIIO::TypeDesc::INT16 ? PixelType::kU16
                                                                             : PixelType::kF32;
}

Status check_size(std::uint64_t width, std::uint64_t height, std::uint64_t bytes_per_pixel,
                  const ImageLimits& limits) {
  const auto side_max = static_cast<std::uint64_t>(limits.side_max);
  if (width > side_max || height > side_max) {
    return too_large("image of " + std::to_string(width) + "x" + std::to_string(height) +
                     " pixels; a side may have " + std::to_string(side_max));
  }
  if (width * height * bytes_per_pixel > limits.decoded_bytes_max) {
    return too_large("image of " + std::to_string(width * height * bytes_per_pixel) +
                     " bytes when decoded; " + std::to_string(limits.decoded_bytes_max) +
                     " are allowed");
  }
  return ok_status();
}

// An opened file. The reader borrows the proxy, so the proxy outlives it.
struct OpenedImage {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> proxy;
  std::unique_ptr<OIIO::ImageInput> input;
  Image header;
};

Result<OpenedImage> open_image(std::span<const std::byte> file, const ImageLimits& limits) {
  const std::string_view kind = image_kind(file);
  if (kind.empty()) {
    return invalid("not an image that is read here: PNG, JPEG, WebP, EXR, HDR or TIFF");
  }
  if (const auto size = peek_image_size(file)) {
    if (auto fits = check_size(size->width, size->height, 1, limits); !fits) {
      return fits.error();
    }
  } else if (kind != "hdr" && kind != "tif") {
    return invalid("the " + std::string(kind) + " header is cut or malformed");
  }
  // libpng reports this on stderr only.
  if (kind == "png" && !png_is_whole(file)) {
    return invalid("the png is cut or its chunks are malformed");
  }
  set_up_oiio();
  OpenedImage opened;
  opened.proxy = std::make_unique<OIIO::Filesystem::IOMemReader>(file.data(), file.size());
  opened.input = OIIO::ImageInput::create(std::string(kind));
  if (!opened.input) {
    return Error{ErrorCode::kInternal, "OpenImageIO: " + library_words(OIIO::geterror()), ""};
  }
  if (!opened.input->set_ioproxy(opened.proxy.get())) {
    return Error{ErrorCode::kInternal,
                 "OpenImageIO cannot read " + std::string(kind) + " from memory", ""};
  }
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // Textures want colour and alpha as stored.
  OIIO::ImageSpec spec;
  if (!opened.input->open("memory." + std::string(kind), spec, config)) {
    return invalid(std::string(kind) + ": " + library_words(opened.input->geterror()));
  }
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1 || spec.deep) {
    return invalid("an image of " + std::to_string(spec.width) + "x" + std::to_string(spec.height) +
                   " pixels and " + std::to_string(spec.nchannels) + " channels cannot be read");
  }
  PixelType type = pixel_type(spec.format);
  for (const OIIO::TypeDesc& format : spec.channelformats) {
    type = pixel_type(format) == type ? type : PixelType::kF32;
  }
  // OpenImageIO's buffers hold all channels of the file, ours the first four.
  const std::size_t pixel_bytes = bytes_per_value(type) * static_cast<std::size_t>(spec.nchannels);
  if (auto fits = check_size(static_cast<std::uint64_t>(spec.width),
                             static_cast<std::uint64_t>(spec.height), pixel_bytes, limits);
      !fits) {
    return fits.error();
  }
  opened.header = {spec.width, spec.height, std::min(spec.nchannels, 4), type, {}};
  return opened;
}

Result<Image> decode(std::span<const std::byte> file, const ImageLimits& limits) {
  auto opened = open_image(file, limits);
  if (!opened) {
    return opened.error();
  }
  Image image = std::move(opened->header);
  image.bytes.resize(image.value_count() * bytes_per_value(image.type));
  const OIIO::TypeDesc type = image.type == PixelType::kU8    ? OIIO::TypeDesc::UINT8
                              : image.type == PixelType::kU16 ? OIIO::TypeDesc::UINT16
                                                              : OIIO::TypeDesc::FLOAT;
  if (!opened->input->read_image(0, 0, 0, image.channels, type, image.bytes.data())) {
    return invalid(std::string(image_kind(file)) + ": " + library_words(opened->input->geterror()));
  }
  return image;
}

// What OpenImageIO or a codec below it throws ends here; lack of memory is the job's affair.
template <typename Function>
auto without_exceptions(const Function& function) -> decltype(function()) {
  try {
    return function();
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    return invalid("the image cannot be read: " + library_words(problem.what()));
  }
}

}  // namespace

std::size_t bytes_per_value(PixelType type) noexcept {
  return type == PixelType::kU8 ? 1 : type == PixelType::kU16 ? 2 : 4;
}

Result<Image> read_image_header(std::span<const std::byte> file) {
  return without_exceptions([&]() -> Result<Image> {
    auto opened = open_image(file, ImageLimits{});
    if (!opened) {
      return opened.error();
    }
    return std::move(opened->header);
  });
}

Result<Image> decode_image(std::span<const std::byte> file, const ImageLimits& limits) {
  return without_exceptions([&] { return decode(file, limits); });
}

}  // namespace core
