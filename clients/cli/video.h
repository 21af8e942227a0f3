/// Videos, written by ffmpeg where it is installed.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "core/base/result.h"

namespace cli {

struct VideoOptions {
  std::string output;  ///< its extension chooses the format: .mp4, .webm; replaced if it exists
  double frames_per_second = 24;
};

/// Writes a video of `count` PNG images, which frame(i) gives in order. Errors: kNotFound where no
/// ffmpeg is on the PATH; kInternal where it fails, which it explains on stderr; those of frame().
/// After an error there is no output.
core::Status write_video(const VideoOptions& options, std::size_t count,
                         const std::function<core::Result<std::string>(std::size_t)>& frame);

}  // namespace cli
