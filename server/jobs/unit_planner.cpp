#include "server/jobs/unit_planner.h"

#include <algorithm>
#include <memory>
#include <vector>

#include "core/render/units/result_size.h"
#include "server/jobs/job.h"
#include "server/jobs/render_run.h"
#include "server/workers/work_options.h"

namespace server {
namespace {

/// Largest part of the film in a unit: sending its result at 1 Gbit/s takes a twentieth of the
/// longest unit's time.
constexpr double kUnitBytesMost = kUnitSecondsMost / 20 * 125e6;
/// Each unit is a share of the remaining pass, so that the last ones are short and end at about the
/// same time. Source: Hummel, Schonberg and Flynn 1992, "Factoring", whose share is 1/2.
constexpr int kShareOfRest = 2;
/// Returns the pixel samples of the slices.
double samples_of(const core::Film& film, const std::vector<core::Slice>& slices) {
  double samples = 0;
  for (const core::Slice& slice : slices) {
    if (slice.tile < film.unit_count()) {
      const core::PixelRect rect = film.unit_rect(slice.tile);
      samples +=
          static_cast<double>(rect.width) * rect.height * (slice.last_sample - slice.first_sample);
    }
  }
  return samples;
}

}  // namespace

std::optional<UnitPlanner::Named> UnitPlanner::next(int slots) {
  for (const std::shared_ptr<SliceSource>& source : scheduler_.in_turn()) {
    const auto run = std::dynamic_pointer_cast<RenderRun>(source);
    const JobPointer job = run ? run->job() : nullptr;
    if (!job) {
      continue;
    }
    const int shares = kShareOfRest * slots;
    const double seconds =
        std::clamp(run->task().seconds_to_hand_out() / shares, kSecondsLeast, kUnitSecondsMost);
    // The time of the first slices is unknown, so the film also limits the unit.
    const core::Film& film = *run->film();
    const int fitting =
        static_cast<int>(kUnitBytesMost * film.tile_count() / static_cast<double>(film.bytes()));
    const std::uint64_t sums = core::result_bytes_max(film, 0);
    const std::uint64_t allowed = (kResultBytesMax - std::min(kResultBytesMax, sums)) /
                                  (core::result_bytes_max(film, 1) - sums);
    const auto most =
        static_cast<std::size_t>(std::max(1, std::min(film.tile_count() / shares, fitting)));
    RenderRun::Lent lent = run->lend(seconds, std::min<std::size_t>(most, allowed));
    if (lent.slices.empty()) {
      continue;
    }
    scheduler_.charge(*source, lent.expected_seconds);
    WorkUnit unit;
    unit.run = run;
    unit.job = job;
    unit.pixel_samples = samples_of(film, lent.slices);
    unit.slices = std::move(lent.slices);
    unit.expected_seconds = lent.expected_seconds;
    return Named{job->id() + "." + run_name_ + "." + std::to_string(++last_), std::move(unit)};
  }
  return std::nullopt;
}

}  // namespace server
