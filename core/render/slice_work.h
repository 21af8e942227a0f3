/// SliceWork: a slice with all that its renderer needs beside the job, and what becomes of it.
///
/// The result is a function of the job and of the state before, so it may be made by any process of
/// the same build and arithmetic class. As bytes, little endian: "TSRWORK4", u32 slices, u32 0; for
/// each slice i32 tile, first and last sample, kind, the tile's rectangle (x, y, width, height),
/// samples, span (from, to), pilot samples; u32 pixels, auxiliary pixels, plans, pilot pixels,
/// fits, shares, labels, mattes; u64 rejected samples, u64 rays, f64 CPU seconds; of light paths
/// i32 unit, its rectangle, first and last sample; of a meter i32 chunk, samples; u32 bytes of
/// splats' sums, sums of the meter; u32 1 where no sample has come into the tile yet, else 0; u64,
/// u64, f64 of both, as above; then these arrays as they are in memory, without those of a tile
/// that has no samples, splats as core/film/splat_sums.h says. Last u32: CRC-32 (as zlib has it) of
/// everything before, against damage alone: who may bring results is not asked of their bytes.
#pragma once

#include <cstddef>
#include <functional>
#include <span>
#include <stop_token>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/render/render_task.h"

namespace core {

struct SliceWork {
  Slice slice;      ///< ends where this work ends
  TileState state;  ///< of the tile; without pixels: the unit is outside of the crop
  PixelRect unit;   ///< where light paths start
  LightBatch light;
  int chunk = -1;  ///< of the meter, where the slice is of that
  MeterChunk meter;
  double expected_seconds = 0;  ///< CPU time, from what it took so far
};

/// Brings work.state, work.light and work.meter to the end of the slice. False, leaving them half
/// done, when stop was requested. Pre: it looks up no photons.
bool render_slice(const Renderer& renderer, SliceWork& work, std::stop_token stop);

/// Pre: splats are summed up. What the receiver knows is left out: of a result the plans, of an
/// input the pixels of tiles that have no samples.
enum class WorkPart { kInput, kResult };
/// One slice after the other: none has to stay in memory for the next.
class WorkWriter {
 public:
  WorkWriter(WorkPart part, std::size_t slices);
  void add(const SliceWork& work);
  /// Call it once, after as many add() as there are slices.
  std::string finish();

 private:
  WorkPart part_;
  std::size_t left_;
  std::string bytes_;
};
std::string encode_work(std::span<const SliceWork> work, WorkPart part);
/// Sizes of results are checked before memory is taken. Errors: kInvalidArgument.
Result<std::vector<SliceWork>> decode_work(std::string_view bytes, WorkPart part);

/// sha256 (hex) of the result, without the time that it took.
std::string content_digest(std::vector<SliceWork> done);

/// Is `done` what rendering the slices can have made? Geometry, range, numbers of samples, finite
/// values; plans are taken over. given(i): what slice i needed, asked for once each, in their
/// order. Errors: kInvalidArgument, with what is wrong.
Status check_result(std::size_t slices, const std::function<SliceWork(std::size_t)>& given,
                    const RenderSettings& settings, std::span<SliceWork> done);

}  // namespace core
