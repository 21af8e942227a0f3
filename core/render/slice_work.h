/// SliceWork: a slice with all that its renderer needs beside the job, and what becomes of it.
///
/// The result is a function of the job and of the state before, so it may be made by any process of
/// the same build and arithmetic class. As bytes, little endian: "TSRWORK1", u32 slices, u32 0; for
/// each slice i32 tile, first and last sample, kind, the tile's rectangle (x, y, width, height),
/// samples, span (from, to), pilot samples; u32 pixels, auxiliary pixels, plans, pilot pixels,
/// fits, shares, labels, mattes; u64 rejected samples, u64 rays, f64 CPU seconds; then these arrays
/// as they are in memory. Last 64 bytes: sha256 (hex) of everything before.
#pragma once

#include <cstddef>
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
  double expected_seconds = 0;  ///< CPU time, from what the tile took so far
};

/// Brings work.state and work.light to the end of the slice. False, leaving them half done, when
/// stop was requested.
bool render_slice(const Renderer& renderer, SliceWork& work, std::stop_token stop);

/// Pre: no light paths. What the receiver knows is left out of a result: plans.
enum class WorkPart { kInput, kResult };
std::string encode_work(std::span<const SliceWork> work, WorkPart part);
/// Sizes are checked before memory is taken. Errors: kInvalidArgument.
Result<std::vector<SliceWork>> decode_work(std::string_view bytes);

/// Is `done` what rendering `given` can have made? Geometry, range, numbers of samples, finite
/// values; plans are taken over from `given`. Errors: kInvalidArgument, with what is wrong.
Status check_result(const SliceWork& given, const RenderSettings& settings, SliceWork& done);

}  // namespace core
