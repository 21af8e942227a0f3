#include <utility>

#include "core/film/film.h"

namespace core {

std::vector<MeterChunk> Film::meter() const {
  MutexLock lock(mutex_);
  return meter_;
}

MeterChunk Film::meter_chunk(int chunk) const {
  MutexLock lock(mutex_);
  return meter_[static_cast<std::size_t>(chunk)];
}

void Film::commit_meter(int chunk, MeterChunk state) {
  MutexLock lock(mutex_);
  std::swap(meter_[static_cast<std::size_t>(chunk)], state);
}

}  // namespace core
