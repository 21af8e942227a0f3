/// match_pass: finds where another image of a series shows the surfaces of this one.
#pragma once

#include "core/base/parallel_for.h"
#include "core/base/result.h"
#include "core/denoise/frame_match.h"
#include "core/render/picture/view.h"

namespace core {

/// Another image of the series.
struct OtherFrame {
  const View* view = nullptr;
  /// The file at the time of that image, from the origin of this one's scene; null: nothing moves.
  const MotionTarget* target = nullptr;
};

/// Follows the point under the centre of each pixel of `view`'s crop to the other image, and looks
/// from there whether it is seen: the surface under the centre of its pixel must be the same part
/// of the same object, and lie within a pixel's width of the same tangent plane. Both images have
/// crops of the same size; shutters are taken as they open. Same result for any number of threads.
/// Errors: those of the cameras.
Result<FrameMatch> match_pass(const View& view, const OtherFrame& other,
                              const ParallelFor& parallel);

}  // namespace core
