/// The arrays of a tile, one row each. Whatever allocates, measures, hashes, copies, writes or
/// reads them walks the rows, in the order of files and messages.
#pragma once

#include <cstddef>
#include <tuple>
#include <vector>

#include "core/film/film.h"

namespace core {

/// What a tile of a film records.
struct TileShape {
  std::size_t replicates = 2;
  std::size_t shares = 0;
  std::size_t mattes = 0;
  bool has_aux = false;
  bool has_labels = false;
  bool has_plan = false;
  bool has_pilot = false;
  bool has_fit = false;
};

inline TileShape shape_of(const Film& film) noexcept {
  return {.replicates = static_cast<std::size_t>(film.replicates()),
          .shares = film.shares().size(),
          .mattes = film.matte_kinds().count(),
          .has_aux = film.has_aux(),
          .has_labels = film.has_labels(),
          .has_plan = film.has_plan(),
          .has_pilot = film.has_pilot(),
          .has_fit = film.has_fit()};
}

template <typename Value>
struct TilePlane {
  std::vector<Value> TileState::*values;
  /// Null: the array serves the rendering only; it is in checkpoints and units of work, but neither
  /// in the digest nor in images.
  std::vector<Value> FilmSnapshot::*in_snapshot;
  /// Returns the number of values of a pixel.
  std::size_t (*per_pixel)(const TileShape& shape);
  bool is_after_splats = false;  ///< in files, where the tile's splats follow the first arrays
};

inline constexpr std::tuple kTilePlanes = {
    TilePlane<ReplicatePixel>{&TileState::pixels, &FilmSnapshot::pixels,
                              [](const TileShape& shape) { return shape.replicates; }},
    TilePlane<AuxPixel>{&TileState::aux, &FilmSnapshot::aux,
                        [](const TileShape& shape) { return std::size_t{shape.has_aux}; }},
    TilePlane<PixelPlan>{&TileState::plan, nullptr,
                         [](const TileShape& shape) { return std::size_t{shape.has_plan}; }},
    TilePlane<PilotPixel>{&TileState::pilot, nullptr,
                          [](const TileShape& shape) { return std::size_t{shape.has_pilot}; }},
    TilePlane<ReplicateFit>{
        &TileState::fit, nullptr,
        [](const TileShape& shape) { return shape.has_fit ? shape.replicates : 0; }},
    TilePlane<Rgb>{&TileState::shares, &FilmSnapshot::shares,
                   [](const TileShape& shape) { return shape.replicates * shape.shares; }, true},
    TilePlane<LabelPixel>{&TileState::labels, &FilmSnapshot::labels,
                          [](const TileShape& shape) { return std::size_t{shape.has_labels}; },
                          true},
    TilePlane<MattePixel>{&TileState::mattes, &FilmSnapshot::mattes,
                          [](const TileShape& shape) { return shape.mattes; }, true},
};
static_assert(sizeof(ReplicatePixel) == 24 && sizeof(AuxPixel) == 32 && sizeof(PixelPlan) == 8 &&
                  sizeof(PilotPixel) == 32 && sizeof(ReplicateFit) == 48 && sizeof(Rgb) == 12 &&
                  sizeof(LabelPixel) == 44 && sizeof(MattePixel) == 72,
              "files, messages and digests hold these as they are in memory");
inline constexpr std::size_t kTilePlaneCount = std::tuple_size_v<decltype(kTilePlanes)>;

template <typename Visit>
void for_each_plane(const Visit& visit) {
  std::apply([&](const auto&... plane) { (visit(plane), ...); }, kTilePlanes);
}

/// Visits the arrays of which a film consists when it is complete.
template <typename Visit>
void for_each_kept_plane(const Visit& visit) {
  for_each_plane([&](const auto& plane) {
    if (plane.in_snapshot != nullptr) {
      visit(plane);
    }
  });
}

/// Calls visit(array) for the arrays of a tile before its splats, or for those after them.
template <typename Tile, typename Visit>
void visit_arrays(Tile& tile, bool is_after_splats, const Visit& visit) {
  for_each_plane([&](const auto& plane) {
    if (plane.is_after_splats == is_after_splats) {
      visit(tile.*plane.values);
    }
  });
}
/// As above, for kept arrays.
template <typename Tile, typename Visit>
void visit_kept_arrays(Tile& tile, bool is_after_splats, const Visit& visit) {
  for_each_kept_plane([&](const auto& plane) {
    if (plane.is_after_splats == is_after_splats) {
      visit(tile.*plane.values);
    }
  });
}

/// Returns the bytes of a pixel in all arrays. bytes_of(plane): of one value.
template <typename BytesOf>
std::size_t pixel_bytes(const TileShape& shape, const BytesOf& bytes_of) {
  std::size_t sum = 0;
  for_each_plane([&](const auto& plane) { sum += plane.per_pixel(shape) * bytes_of(plane); });
  return sum;
}
template <typename Value>
constexpr std::size_t value_bytes(const TilePlane<Value>&) noexcept {
  return sizeof(Value);
}

/// Gives the arrays the lengths for that many pixels.
inline void resize_planes(TileState& state, std::size_t pixels, const TileShape& shape) {
  for_each_plane(
      [&](const auto& plane) { (state.*plane.values).resize(pixels * plane.per_pixel(shape)); });
}

}  // namespace core
