/// The optional parts of a film and the arrays of a tile, one row each. Whatever allocates,
/// measures, hashes, copies, writes or reads them walks the rows, in the order of files.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <tuple>
#include <vector>

#include "core/film/film.h"

namespace core {

/// One optional part: its flags in files, and the settings that ask for it.
struct RecordedPart {
  bool RecordedParts::*is_recorded;
  std::uint32_t file_flag;        ///< in films that are downloaded (core/film/film_format.h)
  std::uint32_t checkpoint_flag;  ///< in files of the server
  bool (*is_asked_for)(const FilmSettings& settings);
  void (*ask_for)(FilmSettings& settings);
};

inline constexpr std::array kRecordedParts = {
    RecordedPart{
        &RecordedParts::aux, 1U, 1U,
        [](const FilmSettings& settings) { return settings.has_aux(); },
        [](FilmSettings& settings) { settings.albedo = settings.normal = settings.depth = true; }},
    RecordedPart{&RecordedParts::first_hits, 128U, 1U << 19U,
                 [](const FilmSettings& settings) { return settings.has_first_hits(); },
                 [](FilmSettings& settings) { settings.object = true; }},
    RecordedPart{&RecordedParts::object_mattes, 16U, 1U << 17U,
                 [](const FilmSettings& settings) { return settings.object_mattes; },
                 [](FilmSettings& settings) { settings.object_mattes = true; }},
    RecordedPart{&RecordedParts::material_mattes, 32U, 1U << 18U,
                 [](const FilmSettings& settings) { return settings.material_mattes; },
                 [](FilmSettings& settings) { settings.material_mattes = true; }},
    RecordedPart{&RecordedParts::z_depth, 8U, 1U << 20U,
                 [](const FilmSettings& settings) { return settings.z_depth; },
                 [](FilmSettings& settings) { settings.z_depth = true; }},
};

inline RecordedParts parts_asked_for(const FilmSettings& settings) noexcept {
  RecordedParts parts;
  for (const RecordedPart& row : kRecordedParts) {
    parts.*row.is_recorded = row.is_asked_for(settings);
  }
  return parts;
}
/// Makes the settings ask for these parts and no others.
inline void ask_for(const RecordedParts& parts, FilmSettings& settings) noexcept {
  settings.albedo = settings.normal = settings.depth = false;  // by default, they are recorded
  for (const RecordedPart& row : kRecordedParts) {
    if (parts.*row.is_recorded) {
      row.ask_for(settings);
    }
  }
}
/// flag: the member of the rows.
inline std::uint32_t flags_of(const RecordedParts& parts,
                              std::uint32_t RecordedPart::*flag) noexcept {
  std::uint32_t flags = 0;
  for (const RecordedPart& row : kRecordedParts) {
    flags |= parts.*row.is_recorded ? row.*flag : 0U;
  }
  return flags;
}
inline RecordedParts parts_in(std::uint32_t flags, std::uint32_t RecordedPart::*flag) noexcept {
  RecordedParts parts;
  for (const RecordedPart& row : kRecordedParts) {
    parts.*row.is_recorded = (flags & row.*flag) != 0;
  }
  return parts;
}

/// What a tile of a film records.
struct TileShape {
  std::size_t replicates = 2;
  std::size_t shares = 0;
  RecordedParts recorded;
  bool has_plan = false;
  bool has_pilot = false;
  bool has_fit = false;
};

inline TileShape shape_of(const FilmShape& film) noexcept {
  return {.replicates = static_cast<std::size_t>(film.replicates()),
          .shares = film.shares().size(),
          .recorded = film.recorded(),
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
  /// The values of a pixel are those of its replicates, in their order.
  bool is_by_replicate = false;
};

inline constexpr std::tuple kTilePlanes = {
    TilePlane<ReplicatePixel>{&TileState::pixels, &FilmSnapshot::pixels,
                              [](const TileShape& shape) { return shape.replicates; }, false, true},
    TilePlane<AuxPixel>{&TileState::aux, &FilmSnapshot::aux,
                        [](const TileShape& shape) { return std::size_t{shape.recorded.aux}; }},
    TilePlane<PixelPlan>{&TileState::plan, nullptr,
                         [](const TileShape& shape) { return std::size_t{shape.has_plan}; }},
    TilePlane<PilotPixel>{&TileState::pilot, nullptr,
                          [](const TileShape& shape) { return std::size_t{shape.has_pilot}; }},
    TilePlane<ReplicateFit>{
        &TileState::fit, nullptr,
        [](const TileShape& shape) { return shape.has_fit ? shape.replicates : 0; }, false, true},
    TilePlane<Rgb>{&TileState::shares, &FilmSnapshot::shares,
                   [](const TileShape& shape) { return shape.replicates * shape.shares; }, true,
                   true},
    TilePlane<FirstHitPixel>{
        &TileState::first_hits, &FilmSnapshot::first_hits,
        [](const TileShape& shape) { return std::size_t{shape.recorded.first_hits}; }, true},
    TilePlane<MattePixel>{
        &TileState::mattes, &FilmSnapshot::mattes,
        [](const TileShape& shape) { return shape.recorded.matte_kinds().count(); }, true},
    TilePlane<float>{&TileState::z_depths, &FilmSnapshot::z_depths,
                     [](const TileShape& shape) { return std::size_t{shape.recorded.z_depth}; },
                     true},
};
static_assert(sizeof(ReplicatePixel) == 24 && sizeof(AuxPixel) == 32 && sizeof(PixelPlan) == 8 &&
                  sizeof(PilotPixel) == 32 && sizeof(ReplicateFit) == 48 && sizeof(Rgb) == 12 &&
                  sizeof(FirstHitPixel) == 44 && sizeof(MattePixel) == 72,
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
