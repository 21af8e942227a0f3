/// SliceWork: a slice with all state that its renderer needs in addition to the job, and its
/// result.
///
/// The result is a function of the job and of that state, so any process of the same build and
/// arithmetic class can compute it. As bytes, little endian: "TSRWORK5", u32 slices, u32 0; for
/// each slice i32 tile, first and last sample, kind, the tile's rectangle (x, y, width, height),
/// samples, span (from, to), pilot samples; u32 pixels, auxiliary pixels, plans, pilot pixels,
/// fits, shares, first hits, mattes, depths; u64 rejected samples, u64 rays, f64 CPU seconds; of
/// light paths i32 unit, its rectangle, first and last sample; of a meter i32 chunk, samples; u32
/// bytes of splats' sums, sums of the meter; u32 1 if the tile has no sample yet, else 0; u64, u64,
/// f64 of both, as above; then these arrays as in memory, without those of a tile that has no
/// samples, splats as in core/film/splat_sums.h. Last u32: CRC-32 (as in zlib) of everything
/// before; it only detects damage, and does not authenticate the sender.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/task/render_task.h"

namespace core {

struct SliceWork {
  Slice slice;      ///< ends where this work ends
  TileState state;  ///< of the tile; without pixels if the unit is outside the crop
  PixelRect unit;   ///< where light paths start
  LightBatch light;
  int chunk = -1;  ///< of the meter, for slices of it
  MeterChunk meter;
  double expected_seconds = 0;  ///< CPU time, extrapolated from previous slices
};

/// Renders work.state, work.light and work.meter to the end of the slice. Returns false, with
/// incomplete state, if stop was requested. Pre: it does not look up photons.
bool render_slice(const Renderer& renderer, SliceWork& work, std::stop_token stop);

/// Pre: splats are summed up. Omits data that the receiver has: plans in results, and in inputs the
/// pixels of tiles that have no samples.
enum class WorkPart { kInput, kResult };
/// Adds one slice at a time, so that earlier ones need not stay in memory.
class WorkWriter {
 public:
  WorkWriter(WorkPart part, std::size_t slices);
  void add(const SliceWork& work);
  /// Must be called once, after add() for each of the slices.
  std::string finish();

 private:
  WorkPart part_;
  std::size_t left_;
  std::string bytes_;
};
std::string encode_work(std::span<const SliceWork> work, WorkPart part);
/// Sizes of results are checked before memory is allocated. Errors: kInvalidArgument.
Result<std::vector<SliceWork>> decode_work(std::string_view bytes, WorkPart part);

/// sha256 (hex) of the result, without its times.
std::string content_digest(std::vector<SliceWork> done);

/// Checks that `done` is a possible result of rendering the slices: geometry, range, numbers of
/// samples, finite values; fills in the plans. given(i): input of slice i, called once for each, in
/// order. Errors: kInvalidArgument, with the reason.
Status check_result(std::size_t slices, const std::function<SliceWork(std::size_t)>& given,
                    const RenderSettings& settings, std::span<SliceWork> done);

}  // namespace core
