/// DueSample: names a sample of a tile that has to be traced next.
#pragma once

#include <cstddef>

namespace core {

struct DueSample {
  int x = 0;  ///< pixel of the full film
  int y = 0;
  int sample = 0;
  std::size_t pixel = 0;  ///< index within the tile
};

}  // namespace core
