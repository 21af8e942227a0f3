#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <map>
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

#include "core/image_io/display_row.h"
#include "core/image_io/oiio/oiio.h"
#include "core/math/numbers.h"

namespace core::oiio {
namespace {

Error failed(std::string message) { return {ErrorCode::kInternal, std::move(message), ""}; }

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

/// OpenImageIO 2.4's writer of HEIF copies rows of libheif's size, which has at least 64 pixels and
/// whole blocks of 16 bytes, and so reads beyond a shorter last row.
constexpr std::size_t kBytesBeyond = 64 * 4 + 16;

/// fill(y, to): writes row y in the spec's format.
template <typename Value, typename Fill>
bool write_part(OIIO::ImageOutput& output, const OIIO::ImageSpec& spec, OIIO::TypeDesc type,
                const Fill& fill) {
  const std::size_t row_values =
      static_cast<std::size_t>(spec.width) * static_cast<std::size_t>(spec.nchannels);
  std::vector<Value> values(row_values * static_cast<std::size_t>(std::min(kRows, spec.height)) +
                            kBytesBeyond);
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

/// AV1's scale of quality differs: so much lower, its images differ from the original about as
/// little as those of WebP (FLIP). Measured: guide, API, "Take the image".
constexpr int kAvifLess = 7;

Status write_avif(const ImageRows& image, const ImageFormat& format, const EncodeOptions& options,
                  const ImageSink& sink) {
  const DisplayRow display(image, format, options);
  OIIO::ImageSpec spec(image.width, image.height, display.channels(), OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:UnassociatedAlpha", 1);
  if (options.is_color && options.tone_map != ToneMap::kLinear) {
    spec.attribute("oiio:ColorSpace", "sRGB");
  }
  spec.attribute("Compression", "avif:" + std::to_string(options.quality - kAvifLess));
  // OpenImageIO writes HEIF only by name; the attribute Compression makes it AV1.
  TemporaryFile file;
  const auto output = OIIO::ImageOutput::create("heif");
  if (!output) {  // It says nothing where its writer of HEIF cannot be made.
    return failed(
        "OpenImageIO cannot write AVIF: its writer needs an encoder of HEVC, such as Debian's "
        "libheif-plugin-x265");
  }
  if (!file.is_open()) {
    return failed("there is no temporary file");
  }
  const bool good = output->open(file.path(), spec) &&
                    write_part<std::uint8_t>(*output, spec, OIIO::TypeDesc::UINT8,
                                             [&](int y, std::uint8_t* to) {
                                               display.write(image.row(y), image.width, to);
                                             }) &&
                    output->close();
  if (!good) {
    return failed("OpenImageIO: " + output->geterror());
  }
  const Status mended = file.mend_exif();
  return mended ? file.give(sink) : mended;
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

/// Returns whether half floats hold the colours of all layers: none is beyond their range, nor is
/// the greatest of a layer so small that they have fewer bits for it.
bool suits_half(const ImageRows& image, std::size_t first, const std::vector<bool>& half) {
  std::vector<float> most(half.size());
  for (int y = 0; y < image.height; ++y) {
    const float* in = image.row(y) + first;
    for (int x = 0; x < image.width; ++x, in += image.channels()) {
      for (std::size_t c = 0; c < half.size(); ++c) {
        if (half[c] && std::isfinite(in[c])) {
          most[c] = std::max(most[c], std::fabs(in[c]));
        }
      }
    }
  }
  std::map<std::string_view, float> layers;
  for (std::size_t c = 0; c < half.size(); ++c) {
    const std::string_view name = image.channel_names[first + c];
    const std::size_t layer = name.rfind('.') + 1;  // the length of its prefix
    if (most[c] > kHalfMax) {
      return false;
    }
    if (name.substr(layer) != "A") {
      float& of_layer = layers[name.substr(0, layer)];
      of_layer = std::max(of_layer, most[c]);
    }
  }
  return std::none_of(layers.begin(), layers.end(), [](const auto& layer) {
    return layer.second > 0 && layer.second < kHalfNormalMin;
  });
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
      !suits_half(image, first, part.half)) {
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
                                     : write_avif(image, format, options, sink);
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception& problem) {
    return failed(std::string("OpenImageIO: ") + problem.what());
  }
}

}  // namespace core::oiio
