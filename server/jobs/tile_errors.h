/// TileErrors: the relative error of each tile, worked out when somebody asks and kept until the
/// tile changes, so that many watchers cost as much as one.
#pragma once

#include <cstdint>
#include <map>

#include "core/base/mutex.h"
#include "core/film/film.h"

namespace server {

class TileErrors {
 public:
  /// Relative RMSE of a tile; NaN while it is unknown. Pooled over the tile and a rim around it.
  float of(const core::Film& film, int tile);

 private:
  struct Known {
    std::uint32_t revision = 0;
    float error = 0;
  };
  core::Mutex mutex_;
  std::map<int, Known> known_ GUARDED_BY(mutex_);
};

}  // namespace server
