/// Film: the statistics of a picture, tile by tile.
///
/// Tiles are 32x32, anchored at the full film's origin and cut by the crop. Per pixel and
/// replicate: sample count, running mean (linear RGB and alpha) and M2 of the luminance (Welford),
/// fed strictly in the order of the sample index. The content is therefore a function of the job
/// and of the number of samples of each tile, whatever the slices, threads and restarts were. Where
/// sampling is adaptive that number is the mean over the pixels of the film, and the plan of the
/// epoch (core/film/sample_plan.h) says what each pixel has by then. Replicate r of sample s is s %
/// R; half A is the even replicates, half B the odd ones.
///
/// Where light paths add to it, every tile also has integer sums (core/film/splats.h), and light
/// samples come in units: the tiles of the full film, those of the crop first and in their order,
/// since light that starts anywhere may end in the crop.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/film/half_sums.h"
#include "core/film/label_pixel.h"
#include "core/film/replicate_fit.h"
#include "core/film/replicate_pixel.h"
#include "core/film/sample_plan.h"
#include "core/film/splat_sums.h"
#include "core/film/splats.h"
#include "core/math/vec.h"
#include "core/meter/meter_chunk.h"
#include "core/settings/settings.h"

namespace core {

/// Means over the samples that hit something; `hits` counts them. depth in metres from the eye.
struct AuxPixel {
  Rgb albedo;
  Vec3 normal_world;
  float depth_m = 0;
  std::uint32_t hits = 0;
};

/// What one camera path found.
struct PathSample {
  Rgb radiance;
  float alpha = 1;
  Rgb albedo;
  Vec3 normal_world;
  float depth_m = 0;
  bool hit = false;
  FitSample fit;  ///< where something is fitted; its control is not in the radiance
};

/// Which mattes of Cryptomatte a film has, in this order.
struct MatteKinds {
  bool object = false;
  bool material = false;
  std::size_t count() const noexcept { return std::size_t{object} + std::size_t{material}; }
  friend bool operator==(const MatteKinds&, const MatteKinds&) = default;
};

/// One tile's statistics. Copyable: a slice works on a copy and commits it.
struct TileState {
  PixelRect rect;                      ///< in pixels of the full film
  int samples = 0;                     ///< per pixel of the film, all replicates together
  std::vector<ReplicatePixel> pixels;  ///< [pixel * R + replicate]
  std::vector<AuxPixel> aux;           ///< [pixel]; empty when no auxiliary layer is recorded
  PlanSpan span;                       ///< what `plan` is for; empty: every pixel gets the same
  std::vector<PixelPlan> plan;         ///< [pixel]; empty without a span
  int pilot_samples = 0;               ///< per pixel
  std::vector<PilotPixel> pilot;       ///< [pixel]; empty without pilot samples
  std::vector<ReplicateFit> fit;       ///< [pixel * R + replicate]; empty where nothing is fitted
  std::vector<Rgb> shares;  ///< means, [(pixel * R + replicate) * shares + share]; counts are
                            ///< those of `pixels`
  std::vector<LabelPixel> labels;      ///< [pixel]; empty when no layer of them is recorded
  std::vector<MattePixel> mattes;      ///< [pixel * MatteKinds::count() + kind]
  std::uint64_t rejected_samples = 0;  ///< non-finite ones, counted as zero
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
};

/// Samples that pixels have, all replicates together, those of the picture alone.
struct SampleCounts {
  std::uint32_t min = 0;
  std::uint32_t max = 0;
  std::uint64_t sum = 0;  // over the pixels
  double mean = 0;
};

/// The sums of all splats, and which light paths they are from.
struct SplatState {
  std::vector<int> light_samples;          ///< [unit]; empty in films of a file or a merge
  std::vector<std::uint64_t> light_paths;  ///< [replicate]
  /// [tile][pixel * R + replicate], then the same for each share of the light; empty: zeros.
  SplatTiles tiles;
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
};

/// A frozen copy of the statistics of a rectangle; splats are in the means.
struct FilmSnapshot {
  PixelRect rect;
  int replicates = 2;
  bool has_aux = false;
  bool has_splats = false;  ///< spreads within a replicate lack those of splats
  PixelErrors errors = PixelErrors::kIndependent;
  bool errors_over_white = false;
  std::vector<ReplicatePixel> pixels;  ///< [pixel * R + replicate], row by row over rect
  std::vector<AuxPixel> aux;
  std::vector<Rgb> shares;                ///< as in TileState
  std::vector<std::string> share_layers;  ///< their names
  bool has_labels = false;
  MatteKinds matte_kinds;
  std::vector<LabelPixel> labels;
  std::vector<MattePixel> mattes;  ///< as in TileState
  std::uint32_t revision = 0;
  /// Of the picture that this is a part of, where errors are to be those of the whole.
  std::optional<double> mean_luminance;

  std::size_t pixel_count() const noexcept {
    return static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  }
};

/// Thread-safe: any thread may read; a tile is written by the one thread that has its slice.
class Film {
 public:
  /// With room for plans, pilot samples and fits where the settings ask for them.
  explicit Film(const RenderSettings& settings);
  /// Of a file or of a merge, which have neither. errors: what samples do to neighbouring pixels.
  Film(const FilmSettings& settings, int replicates, PixelErrors errors = PixelErrors::kIndependent,
       bool has_splats = false);

  PixelRect crop() const noexcept { return crop_; }
  int full_width() const noexcept { return full_width_; }
  int full_height() const noexcept { return full_height_; }
  int replicates() const noexcept { return replicates_; }
  bool has_aux() const noexcept { return has_aux_; }
  PixelErrors errors() const noexcept { return errors_; }
  bool errors_over_white() const noexcept { return over_white_; }
  bool has_plan() const noexcept { return adaptive_ != AdaptiveType::kNone; }
  bool has_pilot() const noexcept { return adaptive_ == AdaptiveType::kPilot; }
  bool has_splats() const noexcept { return has_splats_; }
  bool has_fit() const noexcept { return fit_ != FitType::kNone; }
  const std::vector<LightShare>& shares() const noexcept { return shares_; }
  bool has_labels() const noexcept { return has_labels_; }
  MatteKinds matte_kinds() const noexcept { return matte_kinds_; }
  std::size_t label_bytes() const noexcept;  ///< of a pixel: labels and mattes
  int tile_count() const noexcept { return static_cast<int>(rects_.size()); }
  PixelRect tile_rect(int tile) const noexcept { return rects_[static_cast<std::size_t>(tile)]; }
  /// Of light samples; without splats the tiles.
  int unit_count() const noexcept { return static_cast<int>(unit_rects_.size()); }
  PixelRect unit_rect(int unit) const noexcept {
    return unit_rects_[static_cast<std::size_t>(unit)];
  }

  TileState tile(int tile) const;
  int tile_samples(int tile) const;
  std::uint32_t tile_revision(int tile) const;
  /// Replaces a tile and gives it the next revision of the film, which is returned.
  /// What samples cost that are taken back was spent all the same.
  std::uint32_t commit(int tile, TileState state);
  /// The same with the light samples of its unit, both or neither.
  std::uint32_t commit(int tile, TileState state, const LightBatch& light);
  /// Of units outside of the crop, or before their tiles; all at once.
  void commit_light(std::span<const LightBatch> light);
  int light_samples(int unit) const;
  /// Sums up the halves with the splats of now and gives every tile a new revision, if light was
  /// committed since the last time: tiles with their revisions. half_sums() stays until the next.
  std::vector<std::uint32_t> settle_splats();
  /// All at one time; no tile is empty.
  SplatState splats() const;
  /// Of the job's meter; empty: it has none.
  std::vector<MeterChunk> meter() const;
  int meter_chunk_count() const noexcept { return meter_chunk_count_; }
  MeterChunk meter_chunk(int chunk) const;
  void commit_meter(int chunk, MeterChunk state);
  std::size_t meter_points() const noexcept { return meter_points_; }
  /// Of a chunk: sums that it has once it has samples.
  std::size_t meter_sums(int chunk) const noexcept {
    const std::size_t first = static_cast<std::size_t>(chunk) * kMeterChunk;
    return std::min<std::size_t>(kMeterChunk, meter_points_ - first) * kMeterReplicates;
  }
  void restore_splats(SplatState state);
  /// A tile with its splats in the means.
  TileState shown_tile(int tile) const;
  std::uint32_t revision() const;
  /// Replaces a tile whose picture has not changed: pilot samples. It keeps its revision.
  void keep(int tile, TileState state);
  /// Gives every tile its plan, all at once: readers of tiles while plan_epoch() stays the same
  /// sees plans of one epoch. Pre: plans has one entry for each tile, and every tile has span.from
  /// samples.
  void install_plans(PlanSpan span, std::vector<std::vector<PixelPlan>> plans);
  std::uint32_t plan_epoch() const;
  /// Changes whenever anything of a tile does, its revision or not.
  std::uint64_t tile_version(int tile) const;
  SampleCounts sample_counts() const;
  /// Of all tiles, in their order: what ErrorEstimate is made from.
  std::vector<TileSums> half_sums() const;
  TileSums half_sums(int tile) const;
  double mean_luminance() const;  ///< of the pixels whose alpha is not 0
  double tile_samples_mean(int tile) const;
  /// Only when a film is loaded: later commits continue above `revision`.
  void restore(int tile, TileState state, std::uint32_t tile_revision);

  /// Pre: rect lies inside crop().
  FilmSnapshot snapshot(PixelRect rect) const;
  FilmSnapshot snapshot() const { return snapshot(crop_); }

  std::uint64_t rejected_samples() const;
  std::uint64_t rays() const;
  /// Of the samples, and what was spent beside them. Never falls.
  double cpu_seconds() const;
  void add_cpu_seconds(double seconds);  ///< spent for the picture, beside its samples
  double cpu_seconds_beside() const;
  std::size_t bytes() const noexcept;

  /// sha256 (hex) of the exact content: geometry of the film, counts, means, M2, auxiliary values.
  /// Not of rays and CPU seconds.
  std::string digest() const;

 private:
  void add_light(const LightBatch& light) REQUIRES(mutex_);
  SplatLayout splat_layout() const noexcept {
    return {crop_, rects_, replicates_, 1 + shares_.size()};
  }
  std::size_t splats_of(int tile) const noexcept;
  std::shared_ptr<const TileState> tile_state(int tile) const;
  /// To the part of a snapshot that lies in the tile.
  void add_folded_splats(std::size_t tile, FilmSnapshot& out) const REQUIRES(mutex_);
  double paths_per_pixel(std::size_t replicate) const REQUIRES(mutex_);
  struct Slot {
    /// Never null, never changed: copying it needs no lock.
    std::shared_ptr<const TileState> state;
    SampleCounts counts;
    TileSums sums;
    std::uint32_t revision = 0;
    std::uint64_t version = 0;
  };
  PixelRect crop_;
  int full_width_;
  int full_height_;
  int replicates_;
  bool has_aux_;
  bool has_splats_;
  std::vector<LightShare> shares_;
  bool has_labels_;
  MatteKinds matte_kinds_;
  PixelErrors errors_;
  bool over_white_;
  AdaptiveType adaptive_ = AdaptiveType::kNone;
  FitType fit_ = FitType::kNone;
  std::vector<PixelRect> rects_;
  std::vector<PixelRect> unit_rects_;
  std::size_t meter_points_ = 0;
  int meter_chunk_count_ = 0;
  mutable Mutex mutex_;
  std::vector<Slot> tiles_ GUARDED_BY(mutex_);
  std::uint32_t revision_ GUARDED_BY(mutex_) = 0;
  std::uint32_t plan_epoch_ GUARDED_BY(mutex_) = 0;
  std::uint64_t version_ GUARDED_BY(mutex_) = 0;
  double cpu_seconds_beside_ GUARDED_BY(mutex_) = 0;
  SplatState splats_ GUARDED_BY(mutex_);
  bool is_settled_ GUARDED_BY(mutex_) = true;
  std::vector<MeterChunk> meter_ GUARDED_BY(mutex_);
};

/// Adds a sample's shares to the means of its replicate, which has `count` samples with it.
/// means: of one pixel and replicate.
void add_shares(std::span<Rgb> means, std::span<const Rgb> sample, std::uint32_t count);
/// The snapshot with a share in place of the picture; its spreads within replicates are not known.
/// Empty: no share of it is that layer.
std::optional<FilmSnapshot> share_of(const FilmSnapshot& film, std::string_view layer);

/// The tiles that cover `crop`, row by row.
std::vector<PixelRect> tile_rects(PixelRect crop);

/// Of pixel number `pixel` of the snapshot.
HalfValue half_value(const FilmSnapshot& film, std::size_t pixel, int half);
/// Both, as errors are taken from them.
std::array<HalfValue, 2> error_halves(const FilmSnapshot& film, std::size_t pixel);
/// The picture's value: (A + B) / 2, whatever their counts, which may depend on the samples of the
/// other half; A alone where B is empty. (A - B)^2 / 4 estimates the variance of exactly this.
/// Alpha in [0,1].
HalfValue pixel_value(const FilmSnapshot& film, std::size_t pixel);
/// Variance of the luminance of pixel_value() if samples were independent, from their spread within
/// each replicate (stratified ones are better than that), and the degrees of freedom that it was
/// estimated with: 0, and nothing known, without a replicate of two samples.
struct SampleVariance {
  double of_mean = 0;
  double degrees = 0;
};
SampleVariance sample_variance(const FilmSnapshot& film, std::size_t pixel);

}  // namespace core
