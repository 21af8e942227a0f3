#include "core/image_io/hdr_header.h"

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "core/image_io/image_io.h"

namespace core {

namespace {

/// The resolution line: which axis comes first, its direction, and both lengths.
struct Resolution {
  char sign[2] = {};
  char axis[2] = {};
  int size[2] = {};
  std::size_t end = 0;  ///< of the line, from the start of the file
};

std::optional<Resolution> resolution_of(std::span<const std::byte> file) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
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

/// Reads bytes in order; past the end it reads zeros and says so.
class Bytes {
 public:
  explicit Bytes(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  unsigned peek(std::size_t offset) const noexcept {
    return offset < bytes_.size() ? std::to_integer<unsigned>(bytes_[offset]) : 0;
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

/// Skips a scanline whose four channels are run-length encoded. False: a run leaves the line.
bool skip_channels(Bytes& bytes, std::size_t width) noexcept {
  constexpr unsigned kRun = 128;  // above: repeats one byte; up to it: so many bytes follow
  bytes.skip(4);
  for (int channel = 0; channel < 4; ++channel) {
    for (std::size_t x = 0; x < width;) {
      const unsigned code = bytes.peek(0);
      bytes.skip(code > kRun ? 2 : 1 + std::size_t{code});
      x += code > kRun ? code - kRun : code;
      if (code == 0 || x > width) {
        return false;
      }
    }
  }
  return true;
}

/// Skips a scanline of pixels; 1 1 1 n repeats the last one n times, n << 8 if it follows another.
bool skip_pixels(Bytes& bytes, std::size_t width) noexcept {
  unsigned shift = 0;
  for (std::size_t x = 0; x < width && !bytes.is_past_end();) {
    const bool repeats = bytes.peek(0) == 1 && bytes.peek(1) == 1 && bytes.peek(2) == 1;
    x += repeats ? std::size_t{bytes.peek(3)} << shift : 1;
    shift = repeats && shift < 16 ? shift + 8 : 0;
    bytes.skip(4);
    if (x > width) {
      return false;
    }
  }
  return true;
}

}  // namespace

std::optional<HdrOrder> hdr_order(std::span<const std::byte> file) {
  const auto r = resolution_of(file);
  if (!r) {
    return std::nullopt;
  }
  const int x = r->axis[0] == 'X' ? 0 : 1;
  return HdrOrder{x == 0, r->sign[x] == '-', r->sign[1 - x] == '+'};
}

bool hdr_is_whole(std::span<const std::byte> file) noexcept {
  const auto r = resolution_of(file);
  if (!r) {
    return false;
  }
  Bytes bytes(file.subspan(r->end));
  const auto width = static_cast<std::size_t>(r->size[1]);
  for (int line = 0; line < r->size[0]; ++line) {
    const bool has_channels = width >= 8 && width < 32768 && bytes.peek(0) == 2 &&
                              bytes.peek(1) == 2 && (bytes.peek(2) << 8U | bytes.peek(3)) == width;
    const bool is_line = has_channels ? skip_channels(bytes, width) : skip_pixels(bytes, width);
    if (!is_line || bytes.is_past_end()) {
      return false;
    }
  }
  return true;
}

Image in_order(Image scanlines, const HdrOrder& order) {
  if (!order.by_columns && !order.from_right && !order.from_bottom) {
    return scanlines;
  }
  Image image = scanlines;
  if (order.by_columns) {
    std::swap(image.width, image.height);
  }
  const std::size_t pixel = static_cast<std::size_t>(image.channels) * bytes_per_value(image.type);
  for (int y = 0; y < image.height && !image.bytes.empty(); ++y) {
    for (int x = 0; x < image.width; ++x) {
      const int across = order.from_right ? image.width - 1 - x : x;
      const int down = order.from_bottom ? image.height - 1 - y : y;
      const auto line = static_cast<std::size_t>(order.by_columns ? across : down);
      const auto place = static_cast<std::size_t>(order.by_columns ? down : across);
      const std::size_t from = line * static_cast<std::size_t>(scanlines.width) + place;
      const std::size_t to = static_cast<std::size_t>(y) * static_cast<std::size_t>(image.width) +
                             static_cast<std::size_t>(x);
      std::memcpy(&image.bytes[to * pixel], &scanlines.bytes[from * pixel], pixel);
    }
  }
  return image;
}

}  // namespace core
