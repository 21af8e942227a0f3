/// FilmShape: what is known of a film before its first sample: geometry, what it records, and
/// therefore its size. A function of the job's settings.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

#include "core/film/meter_chunk.h"
#include "core/film/replicate_fit.h"
#include "core/settings/settings.h"

namespace core {

/// The Cryptomatte layers of a film, in this order.
struct MatteKinds {
  bool object = false;
  bool material = false;
  std::size_t count() const noexcept { return std::size_t{object} + std::size_t{material}; }
  friend bool operator==(const MatteKinds&, const MatteKinds&) = default;
};

/// The optional parts of a film, which the settings ask for; rows in core/film/tile_planes.h.
struct RecordedParts {
  bool aux = false;         ///< albedo, normal or depth
  bool first_hits = false;  ///< first-hit ids, position, texture coordinates or motion
  bool object_mattes = false;
  bool material_mattes = false;
  bool z_depth = false;
  MatteKinds matte_kinds() const noexcept { return {object_mattes, material_mattes}; }
  friend bool operator==(const RecordedParts&, const RecordedParts&) = default;
};

class FilmShape {
 public:
  /// With plans, pilot samples and fits if the settings ask for them. errors: whether samples
  /// correlate the errors of neighbouring pixels. film_shape() gives both of a job's integrator.
  FilmShape(const RenderSettings& settings, PixelErrors errors, bool has_splats);
  /// For films from a file or a merge, which have no plans, pilot samples or fits.
  FilmShape(const FilmSettings& settings, int replicates, PixelErrors errors, bool has_splats);

  PixelRect crop() const noexcept { return crop_; }
  int full_width() const noexcept { return full_width_; }
  int full_height() const noexcept { return full_height_; }
  int replicates() const noexcept { return replicates_; }
  const RecordedParts& recorded() const noexcept { return recorded_; }
  bool has_aux() const noexcept { return recorded_.aux; }
  PixelErrors errors() const noexcept { return errors_; }
  bool errors_over_white() const noexcept { return over_white_; }
  bool has_plan() const noexcept { return adaptive_ != AdaptiveType::kNone; }
  bool has_pilot() const noexcept { return adaptive_ == AdaptiveType::kPilot; }
  bool has_splats() const noexcept { return has_splats_; }
  bool has_fit() const noexcept { return fit_ != FitType::kNone; }
  const std::vector<LightShare>& shares() const noexcept { return shares_; }
  bool has_first_hits() const noexcept { return recorded_.first_hits; }
  MatteKinds matte_kinds() const noexcept { return recorded_.matte_kinds(); }
  const std::vector<PixelRect>& tile_rects() const noexcept { return rects_; }
  int tile_count() const noexcept { return static_cast<int>(rects_.size()); }
  PixelRect tile_rect(int tile) const noexcept { return rects_[static_cast<std::size_t>(tile)]; }
  /// Units of light samples; equal to the tiles if the film has no splats.
  int unit_count() const noexcept { return static_cast<int>(unit_rects_.size()); }
  PixelRect unit_rect(int unit) const noexcept {
    return unit_rects_[static_cast<std::size_t>(unit)];
  }
  int meter_chunk_count() const noexcept { return meter_chunk_count_; }
  std::size_t meter_points() const noexcept { return meter_points_; }
  /// Returns the number of sums of a chunk that has samples.
  std::size_t meter_sums(int chunk) const noexcept {
    const std::size_t first = static_cast<std::size_t>(chunk) * kMeterChunk;
    return std::min<std::size_t>(kMeterChunk, meter_points_ - first) * kMeterReplicates;
  }
  /// Returns the memory of the film when every tile has samples.
  std::size_t bytes() const noexcept;

 private:
  PixelRect crop_;
  int full_width_;
  int full_height_;
  int replicates_;
  RecordedParts recorded_;
  bool has_splats_;
  std::vector<LightShare> shares_;
  PixelErrors errors_;
  bool over_white_;
  AdaptiveType adaptive_ = AdaptiveType::kNone;
  FitType fit_ = FitType::kNone;
  std::vector<PixelRect> rects_;
  std::vector<PixelRect> unit_rects_;
  std::size_t meter_points_ = 0;
  int meter_chunk_count_ = 0;
};

/// Returns the tiles that cover `crop`, row by row.
std::vector<PixelRect> tile_rects(PixelRect crop);

}  // namespace core
