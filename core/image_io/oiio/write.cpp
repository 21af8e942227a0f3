#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <webp/encode.h>

#include "core/color/white_balance.h"
#include "core/image_io/oiio/oiio.h"

namespace core::oiio {
namespace {

constexpr float kHalfMax = 65504;
constexpr int kWebpSideMax = 16383;

Error failed(std::string message) { return {ErrorCode::kInternal, std::move(message), ""}; }

/// Value: std::uint8_t or std::uint16_t.
template <typename Value>
Value quantize(float v) noexcept {
  constexpr auto kMost = static_cast<float>(std::numeric_limits<Value>::max());
  return static_cast<Value>(std::lround(std::clamp(v, 0.0F, 1.0F) * kMost));
}

// Converts one row for display: exposure, division by alpha, white balance, contrast, tone map and
// rounding. Data is only clipped.
class DisplayRow {
 public:
  DisplayRow(int channels, int channels_out, const EncodeOptions& options)
      : channels_(channels),
        background_(options.background.value_or(Rgb(1))),
        channels_out_(channels_out),
        gain_(options.is_color ? std::exp2(options.exposure_stops) : 1.0F),
        contrast_(options.is_color ? options.contrast : 1),
        tone_map_(options.is_color ? options.tone_map : ToneMap::kLinear),
        is_before_(channels == 4 && channels_out == 3) {
    if (options.is_color && options.white_kelvin) {
      white_balance_.emplace(*options.white_kelvin);
    }
  }

  template <typename Value>
  Value* write(const float* in, Value* to) const {
    const float alpha = channels_ == 4 ? in[3] : 1.0F;
    const float scale = channels_ == 4 && alpha > 0 ? gain_ / alpha : gain_;
    if (channels_ == 1) {
      const auto grey = quantize<Value>(apply_tone_map(tone_map_, adjusted(Rgb(in[0] * scale))).r);
      return std::fill_n(to, channels_out_, grey);
    }
    const Rgb linear = adjusted(Rgb{in[0], in[1], in[2]} * scale);
    if (std::is_same_v<Value, std::uint8_t> && tone_map_ != ToneMap::kLinear && !is_before_) {
      const Rgb c = before_srgb_curve(tone_map_, linear);
      *to++ = srgb_byte(c.r);
      *to++ = srgb_byte(c.g);
      *to++ = srgb_byte(c.b);
      return with_alpha(alpha, to);
    }
    Rgb c = apply_tone_map(tone_map_, linear);
    if (is_before_) {
      // Blends display values, as a browser does.
      const float a = std::isnan(alpha) ? 0.0F : std::clamp(alpha, 0.0F, 1.0F);
      const auto blend = [a](float front, float back) {
        return (a > 0 ? a * std::clamp(front, 0.0F, 1.0F) : 0.0F) + (1 - a) * back;
      };
      c = {blend(c.r, background_.r), blend(c.g, background_.g), blend(c.b, background_.b)};
    }
    *to++ = quantize<Value>(c.r);
    *to++ = quantize<Value>(c.g);
    *to++ = quantize<Value>(c.b);
    return with_alpha(alpha, to);
  }

 private:
  template <typename Value>
  Value* with_alpha(float alpha, Value* to) const {
    if (channels_out_ == 4) {
      *to++ = std::isnan(alpha) ? Value{0} : quantize<Value>(alpha);
    }
    return to;
  }
  Rgb adjusted(Rgb linear) const {
    if (white_balance_) {
      linear = (*white_balance_)(linear);
    }
    if (contrast_ != 1) {
      linear = {contrasted(linear.r), contrasted(linear.g), contrasted(linear.b)};
    }
    return linear;
  }
  float contrasted(float v) const {
    constexpr float kMiddleGrey = 0.18F;
    return v > 0 ? kMiddleGrey * std::pow(v / kMiddleGrey, contrast_) : v;
  }

  int channels_;
  Rgb background_;
  int channels_out_;
  float gain_;
  std::optional<WhiteBalance> white_balance_;
  float contrast_;
  ToneMap tone_map_;
  bool is_before_;
};

// Returns whether a channel is colour, for which half precision suffices; not so for variances,
// depths and counts.
bool is_half_channel(std::string_view name) {
  const std::size_t dot = name.rfind('.');
  const std::string_view layer = dot == std::string_view::npos ? "" : name.substr(0, dot);
  const std::string_view last = dot == std::string_view::npos ? name : name.substr(dot + 1);
  return (last == "R" || last == "G" || last == "B" || last == "A") &&
         (layer.empty() || layer == "beauty" || layer == "albedo");
}

/// Passes OpenImageIO's output to a sink, and keeps the sink's error.
class SinkProxy final : public OIIO::Filesystem::IOProxy {
 public:
  explicit SinkProxy(const ImageSink& sink) : IOProxy("", Write), sink_(sink) {}
  const char* proxytype() const override { return "sink"; }
  std::size_t write(const void* from, std::size_t size) override {
    const std::size_t written = pwrite(from, size, m_pos);
    m_pos += static_cast<std::int64_t>(written);
    return written;
  }
  std::size_t pwrite(const void* from, std::size_t size, std::int64_t offset) override {
    if (status_) {
      status_ =
          sink_(static_cast<std::uint64_t>(offset), {static_cast<const std::byte*>(from), size});
    }
    size_ = std::max(size_, static_cast<std::size_t>(offset) + size);
    return status_ ? size : 0;
  }
  std::size_t size() const override { return size_; }
  const Status& status() const { return status_; }

 private:
  const ImageSink& sink_;
  Status status_ = ok_status();
  std::size_t size_ = 0;
};

// Rows passed to the library at a time: one or two blocks of a zip-compressed EXR or TIFF.
constexpr int kRows = 32;

/// fill(y, to): writes row y in the spec's format.
template <typename Value, typename Fill>
bool write_part(OIIO::ImageOutput& output, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                const Fill& fill) {
  const std::size_t row_values =
      static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.nchannels);
  std::vector<Value> values(row_values * static_cast<std::size_t>(std::min(kRows, spec.height)));
  bool good = true;
  for (int y = 0; good && y < spec.height; y += kRows) {
    const int end = std::min(y + kRows, spec.height);
    for (int row = y; row < end; ++row) {
      fill(row, values.data() + row_values * static_cast<std::size_t>(row - y));
    }
    good = output.write_scanlines(y, end, 0, type, values.data());
  }
  return good;
}

/// Has no name; deleted when closed.
class TemporaryFile {
 public:
  TemporaryFile() : file_(std::tmpfile(), &std::fclose) {}
  bool is_open() const { return file_ != nullptr; }
  std::string path() const { return "/proc/self/fd/" + std::to_string(fileno(file_.get())); }
  /// Mends the Exif item, at the end of the file: OpenImageIO swaps the bytes of its version, so
  /// that libheif does not find the TIFF header, and strict readers (libavif) refuse the file.
  /// Source: ISO/IEC 23008-12, A.2.1: first the header's offset, counted from behind these four
  /// bytes; TIFF 6.0, section 2: MM, then 42.
  Status mend_exif() {
    constexpr std::string_view kFound("Exif\0\0MM", 8);
    constexpr std::string_view kMended("\0\0\0\6Exif\0\0MM\0*", 14);
    constexpr long kEnd = 64;  // Less than any file: its boxes alone take more.
    std::string end(kEnd, '\0');
    bool good = std::fseek(file_.get(), -kEnd, SEEK_END) == 0 &&
                std::fread(end.data(), 1, end.size(), file_.get()) == end.size();
    if (const std::size_t at = end.rfind(kFound); good && at != std::string::npos && at >= 4) {
      good = std::fseek(file_.get(), static_cast<long>(at) - 4 - kEnd, SEEK_END) == 0 &&
             std::fwrite(kMended.data(), 1, kMended.size(), file_.get()) == kMended.size();
    }
    good = good && std::fseek(file_.get(), 0, SEEK_SET) == 0;
    return good ? ok_status() : Status(failed("a temporary file could not be changed"));
  }
  Status give(const ImageSink& sink) const {
    std::vector<std::byte> some(std::size_t{1} << 16U);
    std::uint64_t at = 0;
    while (const std::size_t count = std::fread(some.data(), 1, some.size(), file_.get())) {
      if (const Status given = sink(at, std::span(some).first(count)); !given) {
        return given;
      }
      at += count;
    }
    return at > 0 ? ok_status() : Status(failed("a temporary file could not be read"));
  }

 private:
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
};

/// write(output): writes everything, from open() on.
template <typename Write>
Status write_file(std::string_view extension, const ImageSink& sink, const Write& write) {
  SinkProxy proxy(sink);
  const auto output = OIIO::ImageOutput::create(std::string(extension));
  if (!output) {
    return failed("OpenImageIO: " + OIIO::geterror());
  }
  const bool good = output->set_ioproxy(&proxy) && write(*output) && output->close();
  if (!proxy.status()) {
    return proxy.status();
  }
  return good ? ok_status() : Status(failed("OpenImageIO: " + output->geterror()));
}

template <typename Value, typename Fill>
Status write_rows(std::string_view extension, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                  const ImageSink& sink, const Fill& fill) {
  return write_file(extension, sink, [&](OIIO::ImageOutput& output) {
    return output.open("memory." + std::string(extension), spec) &&
           write_part<Value>(output, spec, type, fill);
  });
}

void add_metadata(OIIO::ImageSpec& spec, const EncodeOptions& options) {
  for (const auto& [key, value] : options.metadata) {
    spec.attribute(key, value);
  }
}

Rgb linear(Rgb encoded) {
  return {linear_from_srgb(encoded.r), linear_from_srgb(encoded.g), linear_from_srgb(encoded.b)};
}

bool drops_alpha(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options) {
  return image.channels() == 4 && (!format.has_alpha || options.background);
}

/// AV1's scale of quality differs: so much lower, its images differ from the original about as
/// little as those of WebP (FLIP). Measured: guide, API, "Take the image".
constexpr int kAvifLess = 7;

/// Keeps the beginning of a file on its way to a sink.
class PngHead {
 public:
  explicit PngHead(const ImageSink& sink) : sink_(sink) {}
  Status write(std::uint64_t offset, std::span<const std::byte> piece) {
    for (std::size_t i = 0; i < piece.size() && offset + i < bytes_.size(); ++i) {
      bytes_[offset + i] = std::to_integer<char>(piece[i]);
    }
    return sink_(offset, piece);
  }
  /// OpenImageIO states the intent of proofs, absolute colorimetric; images are meant perceptually.
  /// Source: PNG, 3rd edition, 11.3.2.5: a chunk of one byte, then CRC-32 of type and byte.
  Status set_intent_to_perceptual() const {
    constexpr std::string_view kBefore("\0\0\0\1sRGB", 8);
    constexpr std::string_view kPerceptual("\0\xAE\xCE\x1C\xE9", 5);
    const std::size_t at = bytes_.find(kBefore);
    return at == std::string::npos
               ? ok_status()
               : sink_(at + kBefore.size(), std::as_bytes(std::span(kPerceptual)));
  }

 private:
  const ImageSink& sink_;
  /// Room for the signature, IHDR, gAMA, cHRM and sRGB, which take 106 bytes.
  std::string bytes_ = std::string(128, '\0');
};

/// fill(y, to): writes row y.
template <typename Fill>
Status write_avif(const OIIO::ImageSpec& spec, const ImageSink& sink, const Fill& fill) {
  // OpenImageIO writes HEIF only by name; the attribute Compression makes it AV1.
  TemporaryFile file;
  const auto output = OIIO::ImageOutput::create("heif");
  if (!file.is_open() || !output) {
    return failed(!output ? "OpenImageIO: " + OIIO::geterror() : "there is no temporary file");
  }
  const bool good = output->open(file.path(), spec) &&
                    write_part<std::uint8_t>(*output, spec, OIIO::TypeDesc::UINT8, fill) &&
                    output->close();
  if (!good) {
    return failed("OpenImageIO: " + output->geterror());
  }
  const Status mended = file.mend_exif();
  return mended ? file.give(sink) : mended;
}

/// spec: of 3 or 4 channels. fill(y, to): writes row y. OpenImageIO would take libwebp's slowest
/// method, which takes seconds for noise in alpha and saves 2%.
template <typename Fill>
Status write_webp(const OIIO::ImageSpec& spec, int quality, const ImageSink& sink,
                  const Fill& fill) {
  const std::size_t stride = spec.scanline_bytes();
  std::vector<std::uint8_t> pixels(stride * static_cast<std::size_t>(spec.height));
  for (int y = 0; y < spec.height; ++y) {
    fill(y, &pixels[stride * static_cast<std::size_t>(y)]);
  }
  const auto encode = spec.nchannels == 4 ? &WebPEncodeRGBA : &WebPEncodeRGB;
  std::uint8_t* made = nullptr;
  const std::size_t size = encode(pixels.data(), spec.width, spec.height, static_cast<int>(stride),
                                  static_cast<float>(quality), &made);
  const std::unique_ptr<std::uint8_t, void (*)(void*)> owner(made, &WebPFree);
  if (size == 0) {
    return failed("libwebp could not encode the image");
  }
  return sink(0, std::as_bytes(std::span(made, size)));
}

Status write_display(const ImageRows& image, const ImageFormat& format,
                     const EncodeOptions& options, const ImageSink& sink) {
  const bool webp = format.extension == "webp";
  if (webp && (image.width > kWebpSideMax || image.height > kWebpSideMax)) {
    return Error{ErrorCode::kInvalidArgument,
                 "a WebP image has at most " + std::to_string(kWebpSideMax) + " pixels per side",
                 ""};
  }
  const bool avif = format.extension == "avif";
  const bool needs_color = (webp || avif) && image.channels() == 1;
  const int channels = drops_alpha(image, format, options) || needs_color ? 3 : image.channels();
  const OIIO::TypeDesc type = options.bits == 16 ? OIIO::TypeDesc::UINT16 : OIIO::TypeDesc::UINT8;
  OIIO::ImageSpec spec(image.width, image.height, channels, type);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (options.is_color && options.tone_map != ToneMap::kLinear) {
    spec.attribute("oiio:ColorSpace", "sRGB");
  }
  if (format.extension == "png") {
    spec.attribute("png:compressionLevel", 1);
    add_metadata(spec, options);
  } else {
    const std::string_view name = format.extension == "jpg" ? "jpeg" : format.extension;
    const int quality = avif ? options.quality - kAvifLess : options.quality;
    spec.attribute("Compression", std::string(name) + ":" + std::to_string(quality));
  }
  const DisplayRow display(image.channels(), channels, options);
  const auto fill = [&](int y, auto* to) {
    const float* in = image.row(y);
    for (int x = 0; x < image.width; ++x) {
      to = display.write(in, to);
      in += image.channels();
    }
  };
  if (avif) {
    return write_avif(spec, sink, fill);
  }
  if (webp) {
    return write_webp(spec, options.quality, sink, fill);
  }
  PngHead head(sink);
  const ImageSink through_head = [&head](std::uint64_t offset, std::span<const std::byte> piece) {
    return head.write(offset, piece);
  };
  const Status written =
      options.bits == 16
          ? write_rows<std::uint16_t>(format.extension, spec, type, through_head, fill)
          : write_rows<std::uint8_t>(format.extension, spec, type, through_head, fill);
  return written && format.extension == "png" ? head.set_intent_to_perceptual() : written;
}

/// Channels of an image that are written together in a linear format.
struct LinearPart {
  std::size_t first = 0;
  OIIO::ImageSpec spec;
  std::vector<bool> half{};
  std::vector<bool> whole{};
  bool has_whole = false;
};

/// Returns a value as passed to the library.
float stored(const LinearPart& part, std::size_t c, float v) {
  v = part.whole[c] ? std::bit_cast<float>(static_cast<std::uint32_t>(v)) : v;
  return part.half[c] && std::isfinite(v) ? std::clamp(v, -kHalfMax, kHalfMax) : v;
}

/// Integers are passed as bits in floats, because OpenImageIO would scale floats that become
/// integers.
OIIO::TypeDesc given_type(const LinearPart& part) {
  return part.has_whole ? OIIO::TypeDesc::UNKNOWN : OIIO::TypeDesc::FLOAT;
}

/// Otherwise OpenImageIO writes the current time into EXR and TIFF, and equal images differ.
void pin_date(OIIO::ImageSpec& spec) { spec.attribute("DateTime", "1970:01:01 00:00:00"); }

/// Returns whether a channel that half precision would suffice for has a value beyond its range.
bool exceeds_half(const ImageRows& image, std::size_t first, const std::vector<bool>& half) {
  for (int y = 0; y < image.height; ++y) {
    const float* in = image.row(y) + first;
    for (int x = 0; x < image.width; ++x, in += image.channels()) {
      for (std::size_t c = 0; c < half.size(); ++c) {
        if (half[c] && std::isfinite(in[c]) && std::fabs(in[c]) > kHalfMax) {
          return true;
        }
      }
    }
  }
  return false;
}

/// layer: the prefix of channel names, which is removed together with the dot after it.
LinearPart exr_part(const ImageRows& image, std::size_t first, std::size_t count,
                    const std::string& layer, const EncodeOptions& options) {
  LinearPart part = {first, OIIO::ImageSpec(image.width, image.height, static_cast<int>(count),
                                            OIIO::TypeDesc::FLOAT)};
  const auto name = [&](std::size_t c) -> const std::string& {
    return image.channel_names[first + c];
  };
  for (std::size_t c = 0; c < count; ++c) {
    part.whole.push_back(std::find(options.whole_channels.begin(), options.whole_channels.end(),
                                   name(c)) != options.whole_channels.end());
    part.has_whole = part.has_whole || part.whole[c];
  }
  for (std::size_t c = 0; c < count; ++c) {
    part.half.push_back(options.is_color && !part.has_whole && is_half_channel(name(c)));
  }
  if (std::find(part.half.begin(), part.half.end(), true) != part.half.end() &&
      exceeds_half(image, first, part.half)) {
    part.half.assign(count, false);
  }
  for (std::size_t c = 0; c < count; ++c) {
    part.spec.channelnames[c] = name(c).substr(layer.empty() ? 0 : layer.size() + 1);
    part.spec.channelformats.emplace_back(part.whole[c]  ? OIIO::TypeDesc::UINT
                                          : part.half[c] ? OIIO::TypeDesc::HALF
                                                         : OIIO::TypeDesc::FLOAT);
    part.spec.alpha_channel = name(c) == "A" ? static_cast<int>(c) : part.spec.alpha_channel;
  }
  part.spec.attribute("oiio:ColorSpace", "Linear");
  part.spec.attribute("compression", "zip");
  pin_date(part.spec);
  return part;
}

/// Returns one part per layer, whose channels are contiguous.
std::vector<LinearPart> exr_parts(const ImageRows& image, const EncodeOptions& options) {
  const auto layer_of = [&](std::size_t c) {
    const std::string& name = image.channel_names[c];
    const std::size_t dot = name.rfind('.');
    return dot == std::string::npos ? std::string() : name.substr(0, dot);
  };
  std::vector<LinearPart> parts;
  const std::size_t channels = image.channel_names.size();
  for (std::size_t first = 0, end = 0; first < channels; first = end) {
    const std::string layer = layer_of(first);
    for (end = first + 1; end < channels && layer_of(end) == layer;) {
      ++end;
    }
    LinearPart& part = parts.emplace_back(exr_part(image, first, end - first, layer, options));
    part.spec.attribute("oiio:subimagename", layer.empty() ? "beauty" : layer);
    for (const auto& [key, value] : options.metadata) {
      const std::string prefix = key.substr(0, key.rfind('/') + 1) + "name";
      const auto matte = options.metadata.find(prefix);
      const bool is_own = matte != options.metadata.end() && !matte->second.empty() &&
                          layer.compare(0, matte->second.size(), matte->second) == 0;
      if (first == 0 || is_own) {
        part.spec.attribute(key, value);
      }
    }
  }
  return parts;
}

Status write_exr_parts(const ImageRows& image, const EncodeOptions& options,
                       const ImageSink& sink) {
  const std::vector<LinearPart> parts = exr_parts(image, options);
  std::vector<OIIO::ImageSpec> specs;
  for (const LinearPart& part : parts) {
    specs.push_back(part.spec);
  }
  // OpenImageIO writes multi-part files only by name, and ignores the proxy.
  const TemporaryFile file;
  const auto output = OIIO::ImageOutput::create("exr");
  if (!file.is_open() || !output) {
    return failed(!output ? "OpenImageIO: " + OIIO::geterror() : "there is no temporary file");
  }
  bool good = output->open(file.path(), static_cast<int>(specs.size()), specs.data());
  for (std::size_t i = 0; good && i < parts.size(); ++i) {
    const LinearPart& part = parts[i];
    good = (i == 0 || output->open(file.path(), part.spec, OIIO::ImageOutput::AppendSubimage)) &&
           write_part<float>(*output, part.spec, given_type(part), [&](int y, float* to) {
             const float* in = image.row(y) + part.first;
             for (int x = 0; x < image.width; ++x, in += image.channels()) {
               for (std::size_t c = 0; c < part.half.size(); ++c) {
                 *to++ = stored(part, c, in[c]);
               }
             }
           });
  }
  return good && output->close() ? file.give(sink)
                                 : Status(failed("OpenImageIO: " + output->geterror()));
}

Status write_linear(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options,
                    const ImageSink& sink) {
  const bool exr = format.extension == "exr";
  const int in_channels = image.channels();
  const bool is_before = drops_alpha(image, format, options);
  const Rgb behind = options.background ? linear(*options.background) : Rgb(1);
  const bool spreads_grey = format.extension == "hdr" && in_channels == 1;
  const auto channels = static_cast<std::size_t>(is_before || spreads_grey ? 3 : in_channels);
  LinearPart part;
  if (exr) {
    part = exr_part(image, 0, channels, "", options);
    add_metadata(part.spec, options);
  } else {
    part.spec = OIIO::ImageSpec(image.width, image.height, static_cast<int>(channels),
                                OIIO::TypeDesc::FLOAT);
    part.spec.attribute("oiio:ColorSpace", "Linear");
    part.half.resize(channels);
    part.whole.resize(channels);
    if (format.extension == "tif") {
      // OpenImageIO compresses floats with a predictor that few programs know.
      part.spec.attribute("compression", "none");
      pin_date(part.spec);
    }
  }
  return write_rows<float>(
      format.extension, part.spec, given_type(part), sink, [&](int y, float* to) {
        const float* in = image.row(y);
        for (int x = 0; x < image.width; ++x, in += in_channels) {
          for (std::size_t c = 0; c < channels; ++c) {
            float v = in[spreads_grey ? 0 : c];
            v = is_before && in[3] < 1 ? v + (1 - in[3]) * behind[static_cast<int>(c)] : v;
            *to++ = stored(part, c, v);
          }
        }
      });
}

}  // namespace

Status encode(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options,
              const ImageSink& sink) {
  set_up();
  try {
    if (options.parts && format.extension == "exr") {
      return write_exr_parts(image, options, sink);
    }
    return format.high_dynamic_range ? write_linear(image, format, options, sink)
                                     : write_display(image, format, options, sink);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    return failed(std::string("OpenImageIO: ") + problem.what());
  }
}

}  // namespace core::oiio
