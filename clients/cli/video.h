/// Videos, written by ffmpeg if it is installed.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "core/base/result.h"

namespace cli {

struct VideoOptions {
  std::string output;  ///< its extension selects the format: .mp4, .webm; replaced if it exists
  double frames_per_second = 24;
};

/// Returns kNotFound if ffmpeg is not on the PATH.
core::Status find_ffmpeg();

/// Writes a video of `count` PNG images, which frame(i) returns in order. Errors: those of
/// find_ffmpeg() and frame(); kInternal if ffmpeg fails, which it explains on stderr. Leaves no
/// output after an error.
core::Status write_video(const VideoOptions& options, std::size_t count,
                         const std::function<core::Result<std::string>(std::size_t)>& frame);

}  // namespace cli
