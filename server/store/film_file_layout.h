/// Contents of film files: heads, points and slots as stored on disk, and their sizes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>

#include "core/film/tile_planes.h"
#include "core/render/task/progress.h"

namespace server {

inline constexpr std::uint64_t kAlign = 4096;
inline constexpr std::size_t kPointsMax = 2048;
inline constexpr std::size_t kArithmeticBytesMax = 256;
/// Part of the room for points holds the arithmetic text.
inline constexpr std::size_t kPointsWritten = kPointsMax - 8;
inline constexpr std::array<char, 4> kHeadMagic = {'T', 'S', 'F', '3'};
/// Magic of heads whose points have errors of another definition; the points are left out.
inline constexpr std::array<char, 4> kSecondHeadMagic = {'T', 'S', 'F', '2'};
/// Magic of heads without cpu_seconds_beside.
inline constexpr std::array<char, 4> kFirstHeadMagic = {'T', 'S', 'F', '1'};
inline constexpr std::size_t kFirstHeadBytes = 64;
inline bool is_head(const std::array<char, 4>& magic) {
  return magic == kHeadMagic || magic == kSecondHeadMagic || magic == kFirstHeadMagic;
}
inline constexpr std::array<char, 4> kSlotMagic = {'T', 'S', 'S', '1'};

/// Format from when the two halves of a pixel could have different counts; now both are equal.
struct StoredPlan {
  std::array<std::uint32_t, 2> from{};
  std::array<std::uint32_t, 2> to{};
};

inline constexpr std::int32_t kPlan = 2;
inline constexpr std::int32_t kPilot = 4;
inline constexpr std::int32_t kFit = 8;
inline constexpr std::int32_t kSplats = 16;
inline constexpr std::int32_t kMeter = 32;
/// The number of shares begins at this bit, and ends below those of core::kRecordedParts but the
/// first.
inline constexpr std::int32_t kSharesShift = 8;

inline std::int32_t parts_of(const core::FilmShape& film) {
  return static_cast<std::int32_t>(
             core::flags_of(film.recorded(), &core::RecordedPart::checkpoint_flag)) |
         (film.has_plan() ? kPlan : 0) | (film.has_pilot() ? kPilot : 0) |
         (film.has_fit() ? kFit : 0) | (film.has_splats() ? kSplats : 0) |
         (film.meter_chunk_count() > 0 ? kMeter : 0) |
         (static_cast<std::int32_t>(film.shares().size()) << kSharesShift);
}

/// Precedes each head. The CRC covers everything after itself.
struct HeadFields {
  std::array<char, 4> magic = kHeadMagic;
  std::uint32_t crc = 0;
  std::uint32_t bytes = 0;  ///< Size of the whole head.
  std::uint32_t sequence = 0;
  std::int32_t full_width = 0;
  std::int32_t full_height = 0;
  std::int32_t x = 0;
  std::int32_t y = 0;
  std::int32_t width = 0;
  std::int32_t height = 0;
  std::int32_t replicates = 0;
  std::int32_t parts = 0;  ///< Possible parts of a tile: recorded ones, kPlan, kPilot, kFit,
                           ///< kSplats, kMeter, shares.
  std::uint32_t tile_count = 0;
  std::uint32_t point_count = 0;
  double elapsed_seconds = 0;
  double cpu_seconds_beside = 0;  ///< CPU time of the film that its tiles do not include.
};
static_assert(sizeof(HeadFields) == kFirstHeadBytes + sizeof(double));

struct PointFields {
  double elapsed_seconds = 0;
  double cpu_seconds = 0;
  std::uint64_t rays = 0;
  double grain = 0;
  double doubt = 0;
  double reach = 0;
  std::int32_t samples_per_pixel = 0;
  std::int32_t form = 0;  ///< core::ErrorForm
};
static_assert(sizeof(PointFields) == 56);
inline PointFields fields_of(const core::ConvergencePoint& point) {
  return {.elapsed_seconds = point.elapsed_seconds,
          .cpu_seconds = point.cpu_seconds,
          .rays = point.rays,
          .grain = point.error.grain,
          .doubt = point.error.doubt,
          .reach = point.error.reach,
          .samples_per_pixel = point.samples_per_pixel,
          .form = static_cast<std::int32_t>(point.error.form)};
}
inline core::ConvergencePoint point_of(const PointFields& fields) {
  const bool is_of_squares = fields.form == static_cast<std::int32_t>(core::ErrorForm::kSquares);
  return {.samples_per_pixel = fields.samples_per_pixel,
          .elapsed_seconds = fields.elapsed_seconds,
          .cpu_seconds = fields.cpu_seconds,
          .rays = fields.rays,
          .error = core::error_interval(
              fields.grain, fields.doubt, fields.reach,
              is_of_squares ? core::ErrorForm::kSquares : core::ErrorForm::kHalves)};
}

/// Precedes the meter's sums: for each chunk its fields, then its sums.
struct MeterFields {
  std::array<char, 4> magic = {'T', 'S', 'M', '1'};
  std::uint32_t crc = 0;
  std::uint32_t bytes = 0;  ///< Size of the whole part.
  std::uint32_t sequence = 0;
};
struct MeterChunkFields {
  std::int64_t samples = 0;
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
};

struct SlotFields {
  std::array<char, 4> magic = kSlotMagic;
  std::uint32_t crc = 0;
  std::uint32_t bytes = 0;  ///< Size of the whole slot.
  std::uint32_t sequence = 0;
  std::uint32_t tile = 0;
  std::uint32_t revision = 0;
  std::int32_t samples = 0;
  std::int32_t pilot_samples = 0;  ///< 0: no pilot pixels follow.
  std::uint64_t rejected_samples = 0;
  std::uint64_t rays = 0;
  double cpu_seconds = 0;
  std::int32_t span_from = 0;
  std::int32_t span_to = 0;  ///< 0: no plan follows.
};
static_assert(sizeof(SlotFields) == 64);

inline std::size_t pixels_of(const core::PixelRect& rect) {
  return static_cast<std::size_t>(rect.width) * static_cast<std::size_t>(rect.height);
}

/// Returns the size of a value as it is stored.
template <typename Value>
constexpr std::size_t stored_bytes(const core::TilePlane<Value>&) {
  return std::is_same_v<Value, core::PixelPlan> ? sizeof(StoredPlan) : sizeof(Value);
}
/// Returns the bytes of a pixel, with its splats.
inline std::size_t stored_pixel_bytes(const core::FilmShape& film, const core::TileShape& shape) {
  const std::size_t splats = film.has_splats() ? shape.replicates * (1 + shape.shares) : 0;
  return core::pixel_bytes(shape, [](const auto& plane) { return stored_bytes(plane); }) +
         splats * sizeof(core::SplatPixel);
}

/// Returns the bytes in the head for light samples of each unit, light paths of each replicate,
/// rejected splats, and rays.
inline std::size_t splat_head_bytes(const core::FilmShape& film) {
  return film.has_splats()
             ? static_cast<std::size_t>(film.unit_count()) * sizeof(std::int32_t) +
                   (static_cast<std::size_t>(film.replicates()) + 2) * sizeof(std::uint64_t)
             : 0;
}

/// Returns the size of the meter's part; 0: there is none.
inline std::size_t meter_size(const core::FilmShape& film) {
  return film.meter_chunk_count() > 0
             ? sizeof(MeterFields) +
                   static_cast<std::size_t>(film.meter_chunk_count()) * sizeof(MeterChunkFields) +
                   film.meter_points() * core::kMeterReplicates * sizeof(core::MeterSum)
             : 0;
}

/// Returns the arrays in a slot, according to its fields: plans and pilots may be absent.
inline core::TileShape shape_of(const core::FilmShape& film, const SlotFields& fields) {
  core::TileShape shape = core::shape_of(film);
  shape.has_plan = fields.span_to != 0;
  shape.has_pilot = fields.pilot_samples != 0;
  return shape;
}

/// Returns the size of a whole slot, according to its fields.
inline std::size_t slot_size(const core::FilmShape& film, const core::PixelRect& rect,
                             const SlotFields& fields) {
  return sizeof fields + pixels_of(rect) * stored_pixel_bytes(film, shape_of(film, fields));
}

}  // namespace server
