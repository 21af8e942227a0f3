#include "core/film/splat_sums.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/film/half_sums.h"

namespace core {
namespace {

__extension__ using Bits = unsigned __int128;
constexpr int kBits = 128;

void put(std::string& bytes, Bits value) {
  for (; value >= 0x80U; value >>= 7U) {
    bytes.push_back(static_cast<char>(0x80U | static_cast<unsigned>(value & 0x7fU)));
  }
  bytes.push_back(static_cast<char>(value));
}

Bits zigzag(SplatSum sum) {
  return (static_cast<Bits>(sum) << 1U) ^ static_cast<Bits>(sum >> (kBits - 1));
}

SplatSum from_zigzag(Bits bits) {
  return static_cast<SplatSum>((bits >> 1U) ^ (~(bits & 1U) + 1U));
}

std::optional<Bits> take(std::string_view& bytes) {
  Bits value = 0;
  for (unsigned shift = 0; shift < kBits && !bytes.empty(); shift += 7) {
    const auto byte = static_cast<unsigned char>(bytes.front());
    bytes.remove_prefix(1);
    value |= static_cast<Bits>(byte & 0x7fU) << shift;
    if (byte < 0x80U) {
      return value;
    }
  }
  return std::nullopt;
}

/// Calls visit(tile, index, sums). Returns false if it refuses one, or if they do not fit the
/// layout.
template <typename Visit>
bool each_sum(const SplatLayout& layout, std::string_view packed, Visit&& visit) {
  std::size_t tile = 0;
  std::size_t index = 0;
  while (!packed.empty()) {
    const auto skipped = take(packed);
    SplatPixel pixel;
    for (SplatSum& sum : pixel.sum) {
      const auto bits = take(packed);
      if (!bits) {
        return false;
      }
      sum = from_zigzag(*bits);
    }
    if (!skipped || *skipped > ~std::uint32_t{0}) {
      return false;
    }
    index += static_cast<std::size_t>(*skipped);
    while (tile < layout.tiles.size() && index >= layout.size(tile)) {
      index -= layout.size(tile++);
    }
    if (tile == layout.tiles.size() || !visit(tile, index, pixel)) {
      return false;
    }
    ++index;
  }
  return true;
}

}  // namespace

std::size_t SplatLayout::size(std::size_t tile) const noexcept {
  const PixelRect& r = tiles[tile];
  return static_cast<std::size_t>(r.width) * static_cast<std::size_t>(r.height) * planes *
         static_cast<std::size_t>(replicates);
}

SplatLayout splat_layout(const RenderSettings& settings, std::span<const PixelRect> tiles) {
  return {settings.film.area(), tiles, settings.replicates, 1 + settings.film.shares.size()};
}

void add_splats(const SplatLayout& layout, const LightBatch& light, SplatTiles& sums) {
  const PixelRect& crop = layout.crop;
  const auto r = static_cast<std::size_t>(layout.replicates);
  const int left = crop.x / kTileSize;
  const int columns = (crop.x + crop.width - 1) / kTileSize - left + 1;
  for (std::size_t k = 0; k < light.splats.size(); ++k) {
    for (const Splat& splat : light.splats[k]) {
      const int x = splat.x - crop.x;
      const int y = splat.y - crop.y;
      if (x < 0 || y < 0 || x >= crop.width || y >= crop.height) {
        continue;
      }
      const auto tile = static_cast<std::size_t>(
          (splat.y / kTileSize - crop.y / kTileSize) * columns + splat.x / kTileSize - left);
      const PixelRect& rect = layout.tiles[tile];
      const auto pixel =
          static_cast<std::size_t>((splat.y - rect.y) * rect.width + splat.x - rect.x);
      sums[tile].resize(layout.size(tile));  // on first use
      const std::size_t plane = static_cast<std::size_t>(splat.plane) *
                                static_cast<std::size_t>(rect.width) *
                                static_cast<std::size_t>(rect.height);
      add_splat(sums[tile][(plane + pixel) * r + k], splat.value);
    }
  }
}

std::string pack_sums(const SplatLayout& layout, const SplatTiles& sums) {
  std::string bytes;
  std::size_t skipped = 0;
  for (std::size_t tile = 0; tile < sums.size(); ++tile) {
    skipped += sums[tile].empty() ? layout.size(tile) : 0;
    for (const SplatPixel& pixel : sums[tile]) {
      if (pixel.sum == SplatPixel{}.sum) {
        ++skipped;
        continue;
      }
      put(bytes, std::exchange(skipped, 0));
      for (const SplatSum sum : pixel.sum) {
        put(bytes, zigzag(sum));
      }
    }
  }
  return bytes;
}

bool are_sums_of(const SplatLayout& layout, std::string_view packed, std::uint64_t paths) {
  // Each path has at most 2^10 vertices, each below kSplatMax (splats.h).
  constexpr unsigned kPathBits = 10 + 34 + 40;
  const SplatSum most = static_cast<SplatSum>(std::min(paths, std::uint64_t{1} << 42U))
                        << kPathBits;
  return each_sum(layout, packed, [most](std::size_t, std::size_t, const SplatPixel& pixel) {
    return std::all_of(pixel.sum.begin(), pixel.sum.end(),
                       [most](SplatSum sum) { return -most <= sum && sum <= most; });
  });
}

void add_sums(const SplatLayout& layout, std::string_view packed, SplatTiles& sums) {
  each_sum(layout, packed, [&](std::size_t tile, std::size_t index, const SplatPixel& pixel) {
    sums[tile].resize(layout.size(tile));  // on first use
    for (std::size_t c = 0; c < pixel.sum.size(); ++c) {
      sums[tile][index].sum[c] += pixel.sum[c];
    }
    return true;
  });
}

}  // namespace core
