#include "core/image_io/hdr_header.h"

#include <cstdio>
#include <cstring>
#include <string>
#include <string_view>
#include <utility>

#include "core/image_io/image_io.h"

namespace core {

std::optional<HdrOrder> hdr_order(std::span<const std::byte> file) {
  const std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  const std::size_t gap = text.find("\n\n");  // an empty line ends the variables
  if (gap == std::string_view::npos) {
    return std::nullopt;
  }
  constexpr std::size_t kLineMax = 100;
  const std::string line(text.substr(gap + 2, kLineMax));
  char sign[2] = {};
  char axis[2] = {};
  int size[2] = {};
  const int read = std::sscanf(line.c_str(), "%c%c %d %c%c %d", &sign[0], &axis[0], &size[0],
                               &sign[1], &axis[1], &size[1]);
  const auto is_axis = [&](int i) {
    return (sign[i] == '+' || sign[i] == '-') && (axis[i] == 'X' || axis[i] == 'Y') && size[i] > 0;
  };
  if (read != 6 || !is_axis(0) || !is_axis(1) || axis[0] == axis[1]) {
    return std::nullopt;
  }
  const int x = axis[0] == 'X' ? 0 : 1;
  return HdrOrder{x == 0, sign[x] == '-', sign[1 - x] == '+'};
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
