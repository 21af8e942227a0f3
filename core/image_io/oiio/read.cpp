#include <algorithm>
#include <cstdint>
#include <cstring>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <numeric>
#include <utility>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/base/invalid.h"
#include "core/image_io/exr_layers.h"
#include "core/image_io/oiio/oiio.h"

namespace core::oiio {

void set_up() {
  static const bool kDone = OIIO::attribute("threads", 1) && OIIO::attribute("exr_threads", -1);
  static_cast<void>(kDone);
}

namespace {

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
  OIIO::ImageSpec spec;
  int part = 0;
  std::vector<int> channels;  // of the part
  Image header;
};

// Opens the part of an EXR that contains the picture, and finds its channels.
Status choose_picture(OpenedImage& opened) {
  std::vector<ExrPart> parts;
  do {
    const OIIO::ImageSpec& spec = opened.input->spec();
    parts.push_back({std::string(spec.get_string_attribute("oiio:subimagename")),
                     {spec.channelnames.begin(), spec.channelnames.end()}});
  } while (opened.input->seek_subimage(static_cast<int>(parts.size()), 0));
  static_cast<void>(opened.input->geterror());  // about the part after the last one
  const auto chosen = choose_exr_picture(parts);
  if (!chosen) {
    return chosen.error();
  }
  opened.part = static_cast<int>(chosen->part);
  opened.channels = chosen->channels;
  if (!opened.input->seek_subimage(opened.part, 0)) {
    return invalid("exr: " + library_words(opened.input->geterror()));
  }
  opened.spec = opened.input->spec();
  return ok_status();
}

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
  OIIO::ImageSpec& spec = opened.spec;
  if (!opened.input->open("memory." + std::string(kind), spec, config)) {
    return invalid(std::string(kind) + ": " + library_words(opened.input->geterror()));
  }
  if (kind == "exr") {
    if (auto status = choose_picture(opened); !status) {
      return status.error();
    }
  } else {
    opened.channels.resize(static_cast<std::size_t>(std::clamp(spec.nchannels, 0, 4)));
    std::iota(opened.channels.begin(), opened.channels.end(), 0);
    spec.x = spec.y = spec.full_x = spec.full_y = 0;
    spec.full_width = spec.width;
    spec.full_height = spec.height;
  }
  if (spec.width <= 0 || spec.height <= 0 || spec.nchannels <= 0 || spec.depth > 1 || spec.deep ||
      spec.full_width <= 0 || spec.full_height <= 0) {
    return invalid("an image of " + std::to_string(spec.width) + "x" + std::to_string(spec.height) +
                   " pixels and " + std::to_string(spec.nchannels) + " channels cannot be read");
  }
  for (const int channel : opened.channels) {
    if (kind == "exr" && spec.channelformat(channel) == OIIO::TypeDesc::UINT32) {
      return invalid("channel \"" + spec.channelnames[static_cast<std::size_t>(channel)] +
                     "\" of the EXR has unsigned integers, which are ids and no light; save it as "
                     "half or float");
    }
  }
  PixelType type = pixel_type(spec.channelformat(opened.channels[0]));
  for (const int channel : opened.channels) {
    type = pixel_type(spec.channelformat(channel)) == type ? type : PixelType::kF32;
  }
  // OpenImageIO's buffers hold all channels of the file, ours at most four; the picture is as large
  // as the display window.
  const std::size_t pixel_bytes = bytes_per_value(type) * static_cast<std::size_t>(spec.nchannels);
  for (const auto& [width, height] :
       {std::pair(spec.width, spec.height), std::pair(spec.full_width, spec.full_height)}) {
    if (auto fits = check_image_size(static_cast<std::uint64_t>(width),
                                     static_cast<std::uint64_t>(height), pixel_bytes, limits);
        !fits) {
      return fits.error();
    }
  }
  opened.header = {
      spec.full_width, spec.full_height, static_cast<int>(opened.channels.size()), type, {}};
  return opened;
}

// Copies the data window, which has the channels from `first` on, to its place in the display
// window; what lies outside stays black.
void place_window(const OpenedImage& opened, int first, std::size_t stored_channels,
                  const PagedVector<std::byte>& stored, Image& image) {
  const OIIO::ImageSpec& spec = opened.spec;
  const std::size_t value_bytes = bytes_per_value(image.type);
  const auto begin_x = std::max<std::int64_t>(spec.x, spec.full_x);
  const auto begin_y = std::max<std::int64_t>(spec.y, spec.full_y);
  const auto end_x =
      std::min(std::int64_t{spec.x} + spec.width, std::int64_t{spec.full_x} + spec.full_width);
  const auto end_y =
      std::min(std::int64_t{spec.y} + spec.height, std::int64_t{spec.full_y} + spec.full_height);
  for (std::int64_t y = begin_y; y < end_y; ++y) {
    for (std::int64_t x = begin_x; x < end_x; ++x) {
      const auto from =
          static_cast<std::size_t>((y - spec.y) * spec.width + x - spec.x) * stored_channels;
      const auto to =
          static_cast<std::size_t>((y - spec.full_y) * spec.full_width + x - spec.full_x) *
          opened.channels.size();
      for (std::size_t c = 0; c < opened.channels.size(); ++c) {
        std::memcpy(
            &image.bytes[(to + c) * value_bytes],
            &stored[(from + static_cast<std::size_t>(opened.channels[c] - first)) * value_bytes],
            value_bytes);
      }
    }
  }
}

/// Divides colour by alpha, rounded to whole values. Pre: Value is unsigned.
template <typename Value>
void divide_by_alpha(Image& image) {
  const auto channels = static_cast<std::size_t>(image.channels);
  std::vector<Value> values(image.value_count());
  std::memcpy(values.data(), image.bytes.data(), image.bytes.size());
  for (std::size_t at = 0; at < values.size(); at += channels) {
    const std::uint64_t alpha = values[at + channels - 1];
    for (std::size_t c = 0; alpha > 0 && c + 1 < channels; ++c) {
      constexpr std::uint64_t kMost = std::numeric_limits<Value>::max();
      const std::uint64_t straight = (values[at + c] * kMost + alpha / 2) / alpha;
      values[at + c] = static_cast<Value>(std::min(straight, kMost));
    }
  }
  std::memcpy(image.bytes.data(), values.data(), image.bytes.size());
}

void multiply_by_alpha(Image& image) {
  const auto channels = static_cast<std::size_t>(image.channels);
  std::vector<float> values(image.value_count());
  std::memcpy(values.data(), image.bytes.data(), image.bytes.size());
  for (std::size_t at = 0; at < values.size(); at += channels) {
    for (std::size_t c = 0; c + 1 < channels; ++c) {
      values[at + c] *= values[at + channels - 1];
    }
  }
  std::memcpy(image.bytes.data(), values.data(), image.bytes.size());
}

// A TIFF says whether its colour is multiplied by alpha; ours is if its values are floats.
void unify_alpha(const OIIO::ImageSpec& spec, Image& image) {
  if (spec.alpha_channel != image.channels - 1 || image.channels < 2) {
    return;
  }
  const bool is_straight = spec.get_int_attribute("oiio:UnassociatedAlpha", 0) != 0;
  if (image.type == PixelType::kF32 && is_straight) {
    multiply_by_alpha(image);
  } else if (image.type == PixelType::kU8 && !is_straight) {
    divide_by_alpha<std::uint8_t>(image);
  } else if (image.type == PixelType::kU16 && !is_straight) {
    divide_by_alpha<std::uint16_t>(image);
  }
}

Result<Image> decode_pixels(std::string_view kind, std::span<const std::byte> file,
                            const ImageLimits& limits) {
  auto opened = open_image(kind, file, limits);
  if (!opened) {
    return opened.error();
  }
  Image image = std::move(opened->header);
  const OIIO::TypeDesc type = image.type == PixelType::kU8    ? OIIO::TypeDesc::UINT8
                              : image.type == PixelType::kU16 ? OIIO::TypeDesc::UINT16
                                                              : OIIO::TypeDesc::FLOAT;
  const OIIO::ImageSpec& spec = opened->spec;
  const auto [low, high] = std::minmax_element(opened->channels.begin(), opened->channels.end());
  const auto stored_channels = static_cast<std::size_t>(*high - *low + 1);
  PagedVector<std::byte> stored(static_cast<std::size_t>(spec.width) *
                                static_cast<std::size_t>(spec.height) * stored_channels *
                                bytes_per_value(image.type));
  if (!opened->input->read_image(opened->part, 0, *low, *high + 1, type, stored.data())) {
    return invalid(std::string(kind) + ": " + library_words(opened->input->geterror()));
  }
  const bool as_stored = spec.x == spec.full_x && spec.y == spec.full_y &&
                         spec.width == image.width && spec.height == image.height &&
                         std::is_sorted(opened->channels.begin(), opened->channels.end()) &&
                         stored_channels == opened->channels.size();
  if (as_stored) {
    image.bytes = std::move(stored);
  } else {
    image.bytes.resize(image.value_count() * bytes_per_value(image.type));
    place_window(*opened, *low, stored_channels, stored, image);
  }
  if (kind == "tif") {
    if (image.type == PixelType::kU16 && image.channels == 1 &&
        spec.get_int_attribute("tiff:PhotometricInterpretation", 1) == 0) {
      // WhiteIsZero, which OpenImageIO inverts only in 8 bits.
      std::transform(image.bytes.begin(), image.bytes.end(), image.bytes.begin(),
                     [](std::byte byte) { return ~byte; });
    }
    unify_alpha(spec, image);
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
