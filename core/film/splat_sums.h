/// Splats summed up where they were made, to be sent: sums per pixel do not depend on how many
/// light paths they are from, nor on the order in which they come together.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/film/splats.h"

namespace core {

/// Where a film keeps its sums.
struct SplatLayout {
  PixelRect crop;
  std::span<const PixelRect> tiles;  ///< tile_rects(crop)
  int replicates = 2;
  std::size_t planes = 1;

  /// Sums of a tile: [(plane * pixels + pixel) * R + replicate].
  std::size_t size(std::size_t tile) const noexcept;
};

/// Pre: the integrator splats. tiles: tile_rects() of the crop; outlives it.
SplatLayout splat_layout(const RenderSettings& settings, std::span<const PixelRect> tiles);

/// [tile]; empty: zeros.
using SplatTiles = std::vector<std::vector<SplatPixel>>;

/// Adds the batch's splats to the sums; those outside of the crop are left out.
void add_splats(const SplatLayout& layout, const LightBatch& light, SplatTiles& sums);

/// Sums that are not 0, in their order: how many are passed over before, then r, g and b, each in
/// LEB128, numbers with a sign as zigzag.
std::string pack_sums(const SplatLayout& layout, const SplatTiles& sums);
/// Are they sums of the layout that so many light paths can bring?
bool are_sums_of(const SplatLayout& layout, std::string_view packed, std::uint64_t paths);
/// Pre: are_sums_of().
void add_sums(const SplatLayout& layout, std::string_view packed, SplatTiles& sums);

}  // namespace core
