/// Sums of splats for transmission: their size per pixel is independent of the number of light
/// paths, and their value of the order of summation.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/splats.h"

namespace core {

/// The layout of a film's splat sums.
struct SplatLayout {
  PixelRect crop;
  std::span<const PixelRect> tiles;  ///< tile_rects(crop)
  int replicates = 2;
  std::size_t planes = 1;

  /// Returns the number of sums of a tile, indexed [(plane * pixels + pixel) * R + replicate].
  std::size_t size(std::size_t tile) const noexcept;
};

/// Pre: the integrator splats, and `tiles` is tile_rects() of the crop and outlives the layout.
SplatLayout splat_layout(const RenderSettings& settings, std::span<const PixelRect> tiles);

/// [tile]; empty: zeros.
using SplatTiles = std::vector<std::vector<SplatPixel>>;

/// Adds the batch's splats to the sums. Ignores splats outside the crop.
void add_splats(const SplatLayout& layout, const LightBatch& light, SplatTiles& sums);

/// Encodes the nonzero sums in order: the number of zero sums skipped, then r, g and b, each in
/// LEB128, signed numbers in zigzag form.
std::string pack_sums(const SplatLayout& layout, const SplatTiles& sums);
/// Returns whether `packed` holds sums of the layout that this many light paths can produce.
bool are_sums_of(const SplatLayout& layout, std::string_view packed, std::uint64_t paths);
/// Pre: are_sums_of().
void add_sums(const SplatLayout& layout, std::string_view packed, SplatTiles& sums);

}  // namespace core
