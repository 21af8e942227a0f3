/// Film: the statistics of an image, tile by tile.
///
/// Tiles are 32x32 pixels, anchored at the origin of the full film and clipped to the crop. Each
/// replicate of a pixel stores its sample count, the running mean (linear RGB and alpha) and M2 of
/// the luminance (Welford), updated strictly in the order of sample indices. The content therefore
/// depends only on the job and on the number of samples of each tile, not on slices, threads or
/// restarts. With adaptive sampling that number is the mean over the pixels of the film, and the
/// plan of the epoch (core/film/sample_plan.h) gives the count of each pixel. Sample s belongs to
/// replicate s % R. Half A holds the even replicates, half B the odd ones.
///
/// If the integrator splats, every tile also has integer sums (core/film/splats.h). Light samples
/// are then grouped into units: the tiles of the full film, those of the crop first and in their
/// order, because a light path from anywhere may end in the crop.
#pragma once

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
#include "core/film/film_shape.h"
#include "core/film/first_hit_pixel.h"
#include "core/film/half_sums.h"
#include "core/film/meter_chunk.h"
#include "core/film/replicate_fit.h"
#include "core/film/replicate_pixel.h"
#include "core/film/sample_plan.h"
#include "core/film/splat_sums.h"
#include "core/film/splats.h"
#include "core/math/vec.h"
#include "core/settings/settings.h"

namespace core {

/// Means over the samples that hit a surface; `hits` counts them. Depth is measured from the
/// camera.
struct AuxPixel {
  Rgb albedo;
  Vec3 normal_world;
  float depth_m = 0;
  std::uint32_t hits = 0;
};

/// The result of one camera path.
struct PathSample {
  Rgb radiance;
  float alpha = 1;
  Rgb albedo;
  Vec3 normal_world;
  float depth_m = 0;
  bool hit = false;
  FitSample fit;  ///< for fitted control variates; radiance does not include its control
};

/// Statistics of one tile. Copyable: a slice works on a copy and commits it.
struct TileState {
  PixelRect rect;                      ///< in pixels of the full film
  int samples = 0;                     ///< per pixel of the film, summed over replicates
  std::vector<ReplicatePixel> pixels;  ///< [pixel * R + replicate]
  std::vector<AuxPixel> aux;           ///< [pixel]; empty if no auxiliary layer is recorded
  PlanSpan span;                       ///< the epoch of `plan`; empty: all pixels get equal counts
  std::vector<PixelPlan> plan;         ///< [pixel]; empty without a span
  int pilot_samples = 0;               ///< per pixel
  std::vector<PilotPixel> pilot;       ///< [pixel]; empty if there are no pilot samples
  std::vector<ReplicateFit> fit;       ///< [pixel * R + replicate]; empty if nothing is fitted
  std::vector<Rgb> shares;  ///< means, [(pixel * R + replicate) * shares + share]; `pixels` has the
                            ///< counts
  std::vector<FirstHitPixel> first_hits;  ///< [pixel]; empty if no layer of them is recorded
  std::vector<MattePixel> mattes;         ///< [pixel * MatteKinds::count() + kind]
  std::vector<float> z_depths;  ///< [pixel]; metres along the camera's axis, of the same hits
  std::uint64_t rejected_samples = 0;  ///< non-finite samples, counted as zero
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
};

/// Sample counts of the pixels, summed over replicates, without pilot samples.
struct SampleCounts {
  std::uint32_t min = 0;
  std::uint32_t max = 0;
  std::uint64_t sum = 0;  // over the pixels
  double mean = 0;
};

/// The sums of all splats, and the number of light paths that made them.
struct SplatState {
  std::vector<int> light_samples;          ///< [unit]; empty in films from a file or a merge
  std::vector<std::uint64_t> light_paths;  ///< [replicate]
  /// [tile][pixel * R + replicate], then the same for each share of the light. Empty means zeros.
  SplatTiles tiles;
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
};

/// A frozen copy of the statistics of a rectangle. The means include splats.
struct FilmSnapshot {
  PixelRect rect;
  int replicates = 2;
  RecordedParts recorded;
  bool has_splats = false;  ///< spreads within a replicate then exclude splats
  PixelErrors errors = PixelErrors::kIndependent;
  bool errors_over_white = false;
  std::vector<ReplicatePixel> pixels;  ///< [pixel * R + replicate], row by row over rect
  std::vector<AuxPixel> aux;
  std::vector<Rgb> shares;                ///< as in TileState
  std::vector<std::string> share_layers;  ///< layer names of `shares`
  std::vector<FirstHitPixel> first_hits;
  std::vector<MattePixel> mattes;  ///< as in TileState
  std::vector<float> z_depths;     ///< as in TileState
  std::uint32_t revision = 0;
  /// F of the whole image (core/film/half_sums.h), for a part of it.
  std::optional<double> error_floor;

  std::size_t pixel_count() const noexcept {
    return static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
  }
};

/// Thread-safe. Any thread may read; only the thread that holds a tile's slice writes the tile.
class Film : public FilmShape {
 public:
  explicit Film(FilmShape shape);
  Film(const RenderSettings& settings, PixelErrors errors, bool has_splats)
      : Film(FilmShape(settings, errors, has_splats)) {}
  Film(const FilmSettings& settings, int replicates, PixelErrors errors = PixelErrors::kIndependent,
       bool has_splats = false)
      : Film(FilmShape(settings, replicates, errors, has_splats)) {}

  TileState tile(int tile) const;
  int tile_samples(int tile) const;
  std::uint32_t tile_revision(int tile) const;
  /// Replaces a tile and returns its new revision. CPU time of samples that are taken back still
  /// counts.
  std::uint32_t commit(int tile, TileState state);
  /// Also commits the light samples of the tile's unit; both or neither.
  std::uint32_t commit(int tile, TileState state, const LightBatch& light);
  /// Commits light samples of units outside the crop, or ahead of their tiles, all at once.
  void commit_light(std::span<const LightBatch> light);
  int light_samples(int unit) const;
  /// If light was committed since the last call, gives every tile a new revision and returns the
  /// tiles with their revisions. error_floor() counts splats as of the last call.
  std::vector<std::uint32_t> publish_splats();
  /// Returns a consistent copy in which no tile is empty.
  SplatState splats() const;
  /// Returns the job's meter; empty if it has none.
  std::vector<MeterChunk> meter() const;
  MeterChunk meter_chunk(int chunk) const;
  void commit_meter(int chunk, MeterChunk state);
  void restore_splats(SplatState state);
  /// Returns a tile whose means include its splats. In films without splats, a tile without samples
  /// has no pixels.
  std::shared_ptr<const TileState> shown_tile(int tile) const;
  std::uint32_t revision() const;
  /// Replaces a tile whose image is unchanged (pilot samples). Its revision stays.
  void keep(int tile, TileState state);
  /// Installs the plans of all tiles at once: while plan_epoch() stays the same, readers see plans
  /// of one epoch. Pre: `plans` has one entry per tile, and every tile has span.from samples.
  void install_plans(PlanSpan span, std::vector<std::vector<PixelPlan>> plans);
  std::uint32_t plan_epoch() const;
  /// Changes with every change of the tile, even if its revision stays.
  std::uint64_t tile_version(int tile) const;
  SampleCounts sample_counts() const;
  /// Computes the sums of all tiles in order, relative to error_floor().
  std::vector<TileSums> half_sums() const;
  TileSums half_sums(int tile) const;
  /// F of the image (core/film/half_sums.h); reads the tiles committed since the last call.
  double error_floor() const;
  double tile_samples_mean(int tile) const;
  /// For loading a film only: later commits continue above `revision`.
  void restore(int tile, TileState state, std::uint32_t tile_revision);

  enum class Planes : std::uint8_t { kAll, kLight };  ///< kLight: `pixels` and `shares` alone
  /// Pre: rect lies inside crop().
  FilmSnapshot snapshot(PixelRect rect, Planes planes = Planes::kAll) const;
  FilmSnapshot snapshot() const { return snapshot(crop()); }

  std::uint64_t rejected_samples() const;
  std::uint64_t rays() const;
  /// CPU time of the samples and of all other work for the image. Never decreases.
  double cpu_seconds() const;
  void add_cpu_seconds(double seconds);  ///< for work other than samples
  double cpu_seconds_beside() const;

  /// Returns the sha256 (hex) of the exact content: geometry, counts, means, M2 and auxiliary
  /// values, but not ray counts or CPU seconds.
  std::string digest() const;

 private:
  void add_light(const LightBatch& light) REQUIRES(mutex_);
  SplatLayout splat_layout() const noexcept {
    return {crop(), tile_rects(), replicates(), 1 + shares().size()};
  }
  std::size_t splats_of(int tile) const noexcept;
  std::shared_ptr<const TileState> tile_state(int tile) const;
  /// Adds the splats of a tile to the part of the snapshot that lies in it.
  void add_folded_splats(std::size_t tile, FilmSnapshot& out) const REQUIRES(mutex_);
  double paths_per_pixel(std::size_t replicate) const REQUIRES(mutex_);
  TileSums sums_of(int tile, double floor) const;
  friend class FilmShape;  // counts slots
  struct Slot {
    /// Never null and never modified, so it can be copied without the lock.
    std::shared_ptr<const TileState> state;
    SampleCounts counts;
    /// Of `state`, computed when error_floor() first asks for it; with splats, as of
    /// publish_splats().
    std::optional<TileLight> light;
    std::uint32_t revision = 0;
    std::uint64_t version = 0;
  };
  mutable Mutex mutex_;
  mutable std::vector<Slot> tiles_ GUARDED_BY(mutex_);
  std::uint32_t revision_ GUARDED_BY(mutex_) = 0;
  std::uint32_t plan_epoch_ GUARDED_BY(mutex_) = 0;
  std::uint64_t version_ GUARDED_BY(mutex_) = 0;
  double cpu_seconds_beside_ GUARDED_BY(mutex_) = 0;
  SplatState splats_ GUARDED_BY(mutex_);
  bool is_published_ GUARDED_BY(mutex_) = true;
  std::vector<MeterChunk> meter_ GUARDED_BY(mutex_);
};

/// Adds a sample's shares to the running means of its pixel and replicate. count: samples of the
/// replicate, including this one.
void add_shares(std::span<Rgb> means, std::span<const Rgb> sample, std::uint32_t count);
/// Returns the snapshot with a share as its image; spreads within replicates are unknown then.
/// Empty if no share belongs to that layer.
std::optional<FilmSnapshot> share_of(const FilmSnapshot& film, std::string_view layer);

/// Returns the half's value at index `pixel` of the snapshot.
inline HalfValue half_value(const FilmSnapshot& film, std::size_t pixel, int half) {
  const auto r = static_cast<std::size_t>(film.replicates);
  return half_value(std::span(film.pixels).subspan(pixel * r, r), half);
}
/// Returns both halves of a pixel as error estimates use them.
std::array<HalfValue, 2> error_halves(const FilmSnapshot& film, std::size_t pixel);
/// Returns the value of both halves together.
inline HalfValue pixel_value(const FilmSnapshot& film, std::size_t pixel) {
  return pixel_value(half_value(film, pixel, 0), half_value(film, pixel, 1));
}
/// Variance of the luminance of pixel_value(), estimated from the spread within each replicate as
/// if samples were independent (stratified samples do better), and its degrees of freedom. Zero
/// degrees, and an unknown variance, if no replicate has two samples.
struct SampleVariance {
  double of_mean = 0;
  double degrees = 0;
};
SampleVariance sample_variance(const FilmSnapshot& film, std::size_t pixel);

}  // namespace core
