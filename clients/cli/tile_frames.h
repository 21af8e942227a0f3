/// Parses application/vnd.tessera.tiles that arrives in pieces: the linear tiles of a job.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace cli {

struct TileFrame {
  int x = 0;  ///< pixels of the full film
  int y = 0;
  int width = 0;
  int height = 0;
  bool is_end = false;
  bool has_alpha = false;
  /// Linear means, plane by plane, rows from the top: r, g, b and, with has_alpha, a (associated).
  std::vector<float> planes;
};

class TileParser {
 public:
  /// Returns the frames completed by this piece. Errors: kInvalidArgument if it is not a tile
  /// stream or a checksum is wrong; nothing more can be read then.
  core::Result<std::vector<TileFrame>> feed(std::string_view piece);
  /// Discards the incomplete frame of an interrupted connection.
  void restart() { pending_.clear(); }

 private:
  std::string pending_;
};

}  // namespace cli
