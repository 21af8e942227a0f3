/// ImageRows: an image computed row by row.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace core {

/// Rows may be requested repeatedly and in any order.
struct ImageRows {
  int width = 0;
  int height = 0;
  std::vector<std::string> channel_names;
  /// Returns width * channels values, interleaved, valid until the next call.
  std::function<const float*(int y)> row;

  int channels() const noexcept { return static_cast<int>(channel_names.size()); }
};

}  // namespace core
