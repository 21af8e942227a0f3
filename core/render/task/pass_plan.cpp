#include "core/render/task/pass_plan.h"

#include <algorithm>

#include "core/settings/sample_sets.h"

namespace core {
namespace {

long rounded_up(long samples, int unit) { return (samples + unit - 1) / unit * unit; }

}  // namespace

int next_check(int samples, int replicates, int unit, int steps) {
  for (long per = 1;; per *= 2) {
    const long cuts = std::min(per, static_cast<long>(steps));
    for (long k = 0; k < cuts; ++k) {
      const long check = rounded_up((per + per * k / cuts) * replicates, unit);
      if (check > samples) {
        return static_cast<int>(check);
      }
    }
  }
}

int pass_end(int samples, int samples_max, int replicates, int unit) {
  if (unit > 1) {
    const int step = std::max(unit, samples / 8 / unit * unit);
    const auto end = static_cast<int>(rounded_up(static_cast<long>(samples) + step, unit));
    return std::min({end, next_check(samples, replicates, unit), samples_max});
  }
  if (samples < 2) {
    return std::min(samples + 1, samples_max);
  }
  const int step = std::max(2, samples / 8 / 2 * 2);
  int end = samples + step;
  end += end % 2;
  end = std::min(end, next_check(samples, replicates));
  return std::min(end, samples_max);
}

int whole_sets(int limit, int unit) { return limit < unit ? limit : limit / unit * unit; }

int first_epoch(const RenderSettings& settings) {
  constexpr int kLeast = 20;  // two samples of the pilot stream, because one has no variance
  return next_check(std::max(settings.adaptive.min_samples, kLeast) - 1, settings.replicates,
                    sample_unit(settings));
}

int plan_step(const RenderSettings& settings) {
  return std::max(sample_unit(settings), settings.replicates) / 2;
}

int pilot_samples_at(int from) { return from / 10; }

}  // namespace core
