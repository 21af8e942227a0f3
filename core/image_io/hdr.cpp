#include "core/image_io/hdr.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/invalid.h"
#include "core/image_io/image_codec.h"

namespace core {

namespace {

using Rgbe = std::array<std::uint8_t, 4>;

/// The resolution line: which axis comes first, its direction, and both lengths.
struct Resolution {
  char sign[2] = {};
  char axis[2] = {};
  int size[2] = {};
  std::size_t end = 0;  ///< of the line, from the start of the file
};

struct Header {
  int width = 0;
  int height = 0;
  Resolution resolution;
  Rgb multiplier = Rgb(1);  ///< of the stored values
};

std::string_view text_of(std::span<const std::byte> file) {
  return {reinterpret_cast<const char*>(file.data()), file.size()};
}

std::optional<Resolution> resolution_of(std::span<const std::byte> file) {
  const std::string_view text = text_of(file);
  const std::size_t gap = text.find("\n\n");  // an empty line ends the variables
  if (gap == std::string_view::npos) {
    return std::nullopt;
  }
  constexpr std::size_t kLineMax = 100;
  const std::string line(text.substr(gap + 2, kLineMax));
  Resolution r;
  const int read = std::sscanf(line.c_str(), "%c%c %d %c%c %d", &r.sign[0], &r.axis[0], &r.size[0],
                               &r.sign[1], &r.axis[1], &r.size[1]);
  const auto is_axis = [&](int i) {
    return (r.sign[i] == '+' || r.sign[i] == '-') && (r.axis[i] == 'X' || r.axis[i] == 'Y') &&
           r.size[i] > 0;
  };
  if (read != 6 || !is_axis(0) || !is_axis(1) || r.axis[0] == r.axis[1]) {
    return std::nullopt;
  }
  r.end = std::min(gap + 2 + line.find('\n') + 1, file.size());
  return r;
}

/// Calls use(value) for each line `name=value`.
template <typename Use>
void for_each_variable(std::span<const std::byte> file, std::string_view name, const Use& use) {
  const std::string_view text = text_of(file);
  const std::string_view lines = text.substr(0, text.find("\n\n"));
  const std::string start = "\n" + std::string(name) + "=";
  for (auto at = lines.find(start); at != std::string_view::npos; at = lines.find(start, at + 1)) {
    const std::string_view rest = lines.substr(at + start.size());
    use(std::string(rest.substr(0, rest.find('\n'))));
  }
}

template <std::size_t kCount>
std::optional<std::array<float, kCount>> numbers_of(const std::string& value) {
  std::array<float, kCount> numbers{};
  const char* at = value.c_str();
  for (float& number : numbers) {
    char* end = nullptr;
    number = std::strtof(at, &end);
    if (end == at) {
      return std::nullopt;
    }
    at = end;
  }
  return numbers;
}

/// Returns the product of all EXPOSURE and COLORCORR; empty if one is not positive.
std::optional<Rgb> multiplier_of(std::span<const std::byte> file) {
  Rgb product(1);
  bool is_good = true;
  const auto multiply = [&](Rgb by) {
    product *= by;
    is_good = is_good && is_finite(product) && std::min({by.r, by.g, by.b}) > 0 &&
              std::min({product.r, product.g, product.b}) > 0;
  };
  for_each_variable(file, "EXPOSURE", [&](const std::string& value) {
    const auto by = numbers_of<1>(value);
    multiply(Rgb(by ? (*by)[0] : 0));
  });
  for_each_variable(file, "COLORCORR", [&](const std::string& value) {
    const auto by = numbers_of<3>(value);
    multiply(by ? Rgb{(*by)[0], (*by)[1], (*by)[2]} : Rgb(0));
  });
  return is_good ? std::optional(product) : std::nullopt;
}

Result<Header> header_of(std::span<const std::byte> file, const ImageLimits& limits) {
  const auto r = resolution_of(file);
  if (!r) {
    return invalid("the HDR is cut short, or has no resolution line such as -Y 512 +X 1024");
  }
  const int x = r->axis[0] == 'X' ? 0 : 1;
  Header header{r->size[x], r->size[1 - x], *r};
  if (auto fits = check_image_size(static_cast<std::uint64_t>(header.width),
                                   static_cast<std::uint64_t>(header.height), sizeof(Rgb), limits);
      !fits) {
    return fits.error();
  }
  std::string format;
  for_each_variable(file, "FORMAT", [&](const std::string& value) { format = value; });
  if (format.find("32-bit_rle_xyze") != std::string::npos) {
    return invalid(
        "the HDR has XYZ colours (FORMAT=32-bit_rle_xyze), which are not read; convert it to RGB "
        "with Radiance's ra_xyze -r");
  }
  if (format.find("32-bit_rle_rgbe") == std::string::npos) {
    return invalid("the HDR has no line FORMAT=32-bit_rle_rgbe");
  }
  const auto multiplier = multiplier_of(file);
  if (!multiplier) {
    return invalid(
        "EXPOSURE and COLORCORR of the HDR must be positive numbers; correct its header");
  }
  header.multiplier = *multiplier;
  return header;
}

/// Reads bytes in order; past the end it reads zeros and says so.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  std::uint8_t peek(std::size_t offset) const noexcept {
    return offset < bytes_.size() ? std::to_integer<std::uint8_t>(bytes_[offset]) : std::uint8_t{0};
  }
  void skip(std::size_t count) noexcept {
    is_past_end_ = is_past_end_ || count > bytes_.size();
    bytes_ = bytes_.subspan(std::min(count, bytes_.size()));
  }
  bool is_past_end() const noexcept { return is_past_end_; }

 private:
  std::span<const std::byte> bytes_;
  bool is_past_end_ = false;
};

/// Reads a scanline whose four channels are run-length encoded. False: a run leaves the line.
bool read_channels(Bytes& bytes, std::span<Rgbe> line) noexcept {
  constexpr unsigned kRun = 128;  // above: repeats one byte; up to it: so many bytes follow
  bytes.skip(4);
  for (std::size_t channel = 0; channel < 4; ++channel) {
    for (std::size_t x = 0; x < line.size();) {
      const unsigned code = bytes.peek(0);
      const std::size_t count = code > kRun ? code - kRun : code;
      if (count == 0 || count > line.size() - x) {
        return false;
      }
      for (std::size_t i = 0; i < count; ++i) {
        line[x++][channel] = bytes.peek(code > kRun ? 1 : 1 + i);
      }
      bytes.skip(code > kRun ? 2 : 1 + count);
    }
  }
  return true;
}

/// Reads a scanline of pixels; 1 1 1 n repeats the last one n times, n << 8 if it follows another,
/// and so on. False: a run leaves the line, or has nothing to repeat.
bool read_pixels(Bytes& bytes, std::span<Rgbe> line) noexcept {
  unsigned shift = 0;
  for (std::size_t x = 0; x < line.size() && !bytes.is_past_end();) {
    const Rgbe pixel = {bytes.peek(0), bytes.peek(1), bytes.peek(2), bytes.peek(3)};
    bytes.skip(4);
    const bool repeats = pixel[0] == 1 && pixel[1] == 1 && pixel[2] == 1;
    const std::size_t count = repeats ? std::size_t{pixel[3]} << shift : 1;
    if (count > line.size() - x || (repeats && x == 0)) {
      return false;
    }
    std::fill_n(line.subspan(x).begin(), count, repeats ? line[x - 1] : pixel);
    x += count;
    shift = repeats ? std::min(shift + 8, 24U) : 0;
  }
  return true;
}

/// Calls use(scanline, its pixels) for each.
template <typename Use>
Status read_scanlines(std::span<const std::byte> file, const Resolution& r, const Use& use) {
  Bytes bytes(file.subspan(r.end));
  const auto width = static_cast<std::size_t>(r.size[1]);
  std::vector<Rgbe> line(width);
  for (int i = 0; i < r.size[0]; ++i) {
    const bool has_channels = width >= 8 && width < 32768 && bytes.peek(0) == 2 &&
                              bytes.peek(1) == 2 && bytes.peek(2) < 128;
    const bool is_line = has_channels ? std::size_t{bytes.peek(2)} * 256 + bytes.peek(3) == width &&
                                            read_channels(bytes, line)
                                      : read_pixels(bytes, line);
    if (!is_line || bytes.is_past_end()) {
      return invalid("the Radiance image (.hdr) is cut short or damaged");
    }
    use(i, line);
  }
  return ok_status();
}

}  // namespace

Result<Image> read_hdr_header(std::span<const std::byte> file, const ImageLimits& limits) {
  const auto header = header_of(file, limits);
  return header ? Image{header->width, header->height, 3, PixelType::kF32, {}}
                : Result<Image>(header.error());
}

Result<Image> decode_hdr(std::span<const std::byte> file, const ImageLimits& limits) {
  const auto header = header_of(file, limits);
  if (!header) {
    return header.error();
  }
  std::array<float, 256> steps{};  // of each exponent; 0 is black
  for (int e = 1; e < 256; ++e) {
    steps[static_cast<std::size_t>(e)] = std::ldexp(1.0F, e - (128 + 8));
  }
  const Resolution& r = header->resolution;
  Image image{header->width, header->height, 3, PixelType::kF32, {}};
  image.bytes.resize(image.value_count() * sizeof(float));
  const Status read = read_scanlines(file, r, [&](int line, std::span<const Rgbe> pixels) {
    for (int i = 0; i < r.size[1]; ++i) {
      const Rgbe& pixel = pixels[static_cast<std::size_t>(i)];
      const auto place = [&](char axis, char from_far_end) {
        const int k = r.axis[0] == axis ? 0 : 1;
        const int at = k == 0 ? line : i;
        return static_cast<std::size_t>(r.sign[k] == from_far_end ? r.size[k] - 1 - at : at);
      };
      const auto value = [&](int c) {
        return static_cast<float>(pixel[static_cast<std::size_t>(c)]) * steps[pixel[3]] /
               header->multiplier[c];
      };
      const Rgb color = {value(0), value(1), value(2)};
      const std::size_t to =
          place('Y', '+') * static_cast<std::size_t>(header->width) + place('X', '-');
      std::memcpy(&image.bytes[to * sizeof(Rgb)], &color, sizeof(Rgb));
    }
  });
  return read ? Result<Image>(std::move(image)) : read.error();
}

Status check_hdr(std::span<const std::byte> file) {
  const auto header = header_of(file, {});
  return header ? read_scanlines(file, header->resolution, [](int, std::span<const Rgbe>) {})
                : Status(header.error());
}

std::optional<Chromaticities> hdr_primaries(std::span<const std::byte> file) {
  std::optional<Chromaticities> primaries;
  for_each_variable(file, "PRIMARIES",
                    [&](const std::string& value) { primaries = numbers_of<8>(value); });
  return primaries;
}

}  // namespace core
