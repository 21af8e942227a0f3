#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/image_io/oiio/oiio.h"

namespace core::oiio {

void set_up() {
  static const bool kDone = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(kDone);
}

namespace {

Error invalid(std::string message) { return {ErrorCode::kInvalidArgument, std::move(message), ""}; }

// Returns the library's message as one line, without the made-up file name.
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

// An open file. The reader borrows the proxy, which must outlive it.
struct OpenedImage {
  std::unique_ptr<OIIO::Filesystem::IOMemReader> proxy;
  std::unique_ptr<OIIO::ImageInput> input;
  Image header;
};

Result<OpenedImage> open_image(std::string_view kind, std::span<const std::byte> file,
                               const ImageLimits& limits) {
  set_up();
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
  config.attribute("oiio:UnassociatedAlpha", 1);  // Textures need colour and alpha as stored.
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
  if (auto fits = check_image_size(static_cast<std::uint64_t>(spec.width),
                                   static_cast<std::uint64_t>(spec.height), pixel_bytes, limits);
      !fits) {
    return fits.error();
  }
  opened.header = {spec.width, spec.height, std::min(spec.nchannels, 4), type, {}};
  return opened;
}

Result<Image> decode_pixels(std::string_view kind, std::span<const std::byte> file,
                            const ImageLimits& limits) {
  auto opened = open_image(kind, file, limits);
  if (!opened) {
    return opened.error();
  }
  Image image = std::move(opened->header);
  image.bytes.resize(image.value_count() * bytes_per_value(image.type));
  const OIIO::TypeDesc type = image.type == PixelType::kU8    ? OIIO::TypeDesc::UINT8
                              : image.type == PixelType::kU16 ? OIIO::TypeDesc::UINT16
                                                              : OIIO::TypeDesc::FLOAT;
  if (!opened->input->read_image(0, 0, 0, image.channels, type, image.bytes.data())) {
    return invalid(std::string(kind) + ": " + library_words(opened->input->geterror()));
  }
  return image;
}

// Catches exceptions of OpenImageIO and its codecs; std::bad_alloc propagates to the job.
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

Result<Image> read_header(std::string_view kind, std::span<const std::byte> file,
                          const ImageLimits& limits) {
  return without_exceptions([&]() -> Result<Image> {
    auto opened = open_image(kind, file, limits);
    if (!opened) {
      return opened.error();
    }
    return std::move(opened->header);
  });
}

Result<Image> decode(std::string_view kind, std::span<const std::byte> file,
                     const ImageLimits& limits) {
  return without_exceptions([&] { return decode_pixels(kind, file, limits); });
}

}  // namespace core::oiio
