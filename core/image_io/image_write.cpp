#include <algorithm>
#include <cmath>
#include <exception>
#include <memory>
#include <new>
#include <utility>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include "core/image_io/image_io.h"
#include "core/image_io/oiio_setup.h"

namespace core {
namespace {

constexpr float kHalfMax = 65504;
constexpr int kWebpSideMax = 16383;

Error failed(std::string message) { return {ErrorCode::kInternal, std::move(message), ""}; }

std::uint8_t quantize(float v) noexcept {
  return static_cast<std::uint8_t>(std::lround(std::clamp(v, 0.0F, 1.0F) * 255.0F));
}

// Exposure, division by alpha, tone map and rounding of one picture. Data goes through unchanged
// but for clipping.
std::vector<std::uint8_t> display_bytes(const FloatImage& image, int channels_out,
                                        const EncodeOptions& options) {
  const int channels = image.channels();
  const float gain = options.is_color ? std::exp2(options.exposure_stops) : 1.0F;
  const ToneMap tone_map = options.is_color ? options.tone_map : ToneMap::kLinear;
  const std::size_t pixels =
      static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height);
  std::vector<std::uint8_t> out(pixels * static_cast<std::size_t>(channels_out));
  auto write = out.begin();
  for (std::size_t p = 0; p < pixels; ++p) {
    const float* in = image.values.data() + p * static_cast<std::size_t>(channels);
    const float alpha = channels == 4 ? in[3] : 1.0F;
    const float scale = channels == 4 && channels_out == 4 && alpha > 0 ? gain / alpha : gain;
    if (channels == 1) {
      const std::uint8_t grey = quantize(apply_tone_map(tone_map, Rgb(in[0] * scale)).r);
      write = std::fill_n(write, channels_out, grey);
      continue;
    }
    const Rgb c = apply_tone_map(tone_map, Rgb{in[0], in[1], in[2]} * scale);
    *write++ = quantize(c.r);
    *write++ = quantize(c.g);
    *write++ = quantize(c.b);
    if (channels_out == 4) {
      *write++ = std::isnan(alpha) ? std::uint8_t{0} : quantize(alpha);
    }
  }
  return out;
}

// Colour survives half precision; variances, depths and counts do not.
bool is_half_channel(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  const std::string_view layer = dot == std::string_view::npos ? "" : name.substr(0, dot);
  const std::string_view last = dot == std::string_view::npos ? name : name.substr(dot + 1);
  return (last == "R" || last == "G" || last == "B" || last == "A") &&
         (layer.empty() || layer == "beauty" || layer == "albedo");
}

std::vector<float> held_in_half(const FloatImage& image, const std::vector<bool>& half) {
  std::vector<float> values = image.values;
  const std::size_t channels = image.channel_names.size();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (half[i % channels] && std::isfinite(values[i])) {
      values[i] = std::clamp(values[i], -kHalfMax, kHalfMax);
    }
  }
  return values;
}

struct Pixels {
  OIIO::TypeDesc type;
  const void* data = nullptr;
};

Result<std::vector<std::byte>> write(std::string_view extension, const OIIO::ImageSpec& spec,
                                     Pixels pixels) {
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput proxy(bytes);
  const std::string name(extension);
  const auto output = OIIO::ImageOutput::create(name);
  if (!output) {
    return failed("OpenImageIO: " + OIIO::geterror());
  }
  if (!output->set_ioproxy(&proxy) || !output->open("memory." + name, spec) ||
      !output->write_image(pixels.type, pixels.data) || !output->close()) {
    return failed("OpenImageIO: " + output->geterror());
  }
  const auto* first = reinterpret_cast<const std::byte*>(bytes.data());
  return std::vector<std::byte>(first, first + bytes.size());
}

void add_metadata(OIIO::ImageSpec& spec, const EncodeOptions& options) {
  for (const auto& [key, value] : options.metadata) {
    spec.attribute(key, value);
  }
}

Result<std::vector<std::byte>> encode_display(const FloatImage& image, const ImageFormat& format,
                                              const EncodeOptions& options) {
  // A WebpOutput that could not be opened frees memory that it never had (OpenImageIO 2.4), so it
  // is only given what it takes: three or four channels, and not too large.
  const bool webp = format.extension == "webp";
  if (webp && (image.width > kWebpSideMax || image.height > kWebpSideMax)) {
    return Error{ErrorCode::kInvalidArgument,
                 "a WebP picture has at most " + std::to_string(kWebpSideMax) + " pixels a side",
                 ""};
  }
  const bool drops_alpha = image.channels() == 4 && !format.has_alpha;
  const int channels = drops_alpha || (webp && image.channels() == 1) ? 3 : image.channels();
  const std::vector<std::uint8_t> bytes = display_bytes(image, channels, options);
  OIIO::ImageSpec spec(image.width, image.height, channels, OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (options.is_color && options.tone_map != ToneMap::kLinear) {
    spec.attribute("oiio:ColorSpace", "sRGB");
  }
  if (format.extension == "png") {
    spec.attribute("png:compressionLevel", 1);
    add_metadata(spec, options);
  } else {
    spec.attribute("Compression", (webp ? "webp:" : "jpeg:") + std::to_string(options.quality));
  }
  return write(format.extension, spec, {OIIO::TypeDesc::UINT8, bytes.data()});
}

Result<std::vector<std::byte>> encode_linear(const FloatImage& image, const ImageFormat& format,
                                             const EncodeOptions& options) {
  const bool exr = format.extension == "exr";
  const int channels = image.channels() == 4 && !format.has_alpha ? 3 : image.channels();
  OIIO::ImageSpec spec(image.width, image.height, channels, OIIO::TypeDesc::FLOAT);
  spec.attribute("oiio:ColorSpace", "Linear");
  std::vector<float> values = image.values;
  if (exr) {
    spec.channelnames = image.channel_names;
    std::vector<bool> half;
    for (const std::string& name : image.channel_names) {
      half.push_back(options.is_color && is_half_channel(name));
      spec.channelformats.emplace_back(half.back() ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT);
      spec.alpha_channel = name == "A" ? static_cast<int>(half.size()) - 1 : spec.alpha_channel;
    }
    values = held_in_half(image, half);
    spec.attribute("compression", "zip");
    // Without this OpenImageIO writes the clock into the file, and equal pictures differ.
    spec.attribute("DateTime", "1970:01:01 00:00:00");
    add_metadata(spec, options);
  } else if (channels != image.channels()) {
    values.clear();
    for (std::size_t i = 0; i < image.values.size(); ++i) {
      if (i % 4 != 3) {
        values.push_back(image.values[i]);
      }
    }
  } else if (format.extension == "hdr" && channels == 1) {
    spec.nchannels = 3;
    spec.default_channel_names();
    values.clear();
    for (const float v : image.values) {
      values.insert(values.end(), 3, v);
    }
  }
  if (format.extension == "tif") {
    spec.attribute("compression", "zip");
  }
  return write(format.extension, spec, {OIIO::TypeDesc::FLOAT, values.data()});
}

}  // namespace

Result<std::vector<std::byte>> encode_image(const FloatImage& image, const ImageFormat& format,
                                            const EncodeOptions& options) {
  const int channels = image.channels();
  if (format.extension != "exr" && channels != 1 && channels != 3 && channels != 4) {
    return failed(std::string(format.extension) + " takes 1, 3 or 4 channels, not " +
                  std::to_string(channels));
  }
  if (image.width <= 0 || image.height <= 0 || channels == 0 ||
      image.values.size() != image.index(0, image.height, 0)) {
    return failed("an image without pixels, or with more or fewer values than pixels");
  }
  set_up_oiio();
  try {
    return format.high_dynamic_range ? encode_linear(image, format, options)
                                     : encode_display(image, format, options);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    return failed(std::string("OpenImageIO: ") + problem.what());
  }
}

}  // namespace core
