#include "core/render/pass_plan.h"

#include <algorithm>

namespace core {

int next_look(int samples, int replicates) {
  for (long per = 1;; per *= 2) {
    if (per * replicates > samples) {
      return static_cast<int>(per * replicates);
    }
    const long half_more = per + per / 2;
    if (per >= 2 && half_more * replicates > samples) {
      return static_cast<int>(half_more * replicates);
    }
  }
}

int look_count(int samples_max, int replicates) {
  int looks = 0;
  for (int at = next_look(0, replicates); at <= samples_max; at = next_look(at, replicates)) {
    ++looks;
  }
  return std::max(looks, 1);
}

int pass_end(int samples, int samples_max, int replicates) {
  if (samples < 2) {
    return std::min(samples + 1, samples_max);
  }
  const int step = std::max(2, samples / 8 / 2 * 2);
  int end = samples + step;
  end += end % 2;
  end = std::min(end, next_look(samples, replicates));
  return std::min(end, samples_max);
}

}  // namespace core
