// The census of a task: parts run beside the slices of the picture; the thread that decides runs
// the parts that no thread has taken, so counts depend on the samples of the picture alone.
#include <memory>
#include <utility>

#include "core/accel/accel.h"
#include "core/base/cpu_time.h"
#include "core/integrators/census.h"
#include "core/render/picture/light_not_found.h"
#include "core/render/task/render_task_impl.h"

namespace core {
namespace {

/// Before, the error of a pixel is unknown.
constexpr int kSamplesBeforeCensus = 2;

int parts_at(const RenderSettings& settings, int samples) {
  return census_particles(settings, samples) / kCensusPart;
}

}  // namespace

std::unique_ptr<LightCensus> Renderer::start_census() const { return nullptr; }

std::optional<Slice> RenderTask::Impl::find_census_slice() {
  if (!census.is_wanted || census.is_being_made || pass.base < 1 ||
      pass.target < kSamplesBeforeCensus) {
    return std::nullopt;
  }
  if (census.census == nullptr) {
    census.is_being_made = true;
    ++in_flight;
    return Slice{-1, 0, 0, SliceKind::kCensus};
  }
  if (census.parts_out >= parts_at(settings(), pass.target)) {
    return std::nullopt;
  }
  ++in_flight;
  return Slice{census.parts_out++, 0, 0, SliceKind::kCensus};
}

/// Pre: no other thread makes it.
void RenderTask::Impl::make_census() {
  const double cpu_start = thread_cpu_seconds();
  std::shared_ptr<LightCensus> made = renderer->start_census();
  film->add_cpu_seconds(thread_cpu_seconds() - cpu_start);
  MutexLock lock(mutex);
  census.is_wanted = made != nullptr;
  census.is_being_made = false;
  census.census = std::move(made);
}

void RenderTask::Impl::run_census(const Slice& slice) {
  if (slice.tile < 0) {
    make_census();
  } else {
    std::shared_ptr<LightCensus> counted;
    {
      MutexLock lock(mutex);
      counted = census.census;
    }
    prepare_tracing_thread();
    const double cpu_start = thread_cpu_seconds();
    counted->trace(slice.tile * kCensusPart, (slice.tile + 1) * kCensusPart);
    film->add_cpu_seconds(thread_cpu_seconds() - cpu_start);
  }
  Due due;
  {
    MutexLock lock(mutex);
    --in_flight;
    note_clock();
    due = next_due();
  }
  advance(std::move(due));
}

/// Compares the picture with the particles that belong to its samples. A clock that has run out
/// leaves it at those that were counted.
std::optional<LightNotFound> RenderTask::Impl::count_particles(const Due& due, double confidence) {
  const bool is_over = due.step == Step::kEnd;
  CensusWork now;
  {
    MutexLock lock(mutex);
    now = census;
  }
  if (now.is_wanted && now.census == nullptr && !is_over &&
      (due.samples >= kSamplesBeforeCensus || due.samples >= policy_now().samples_max())) {
    make_census();
    MutexLock lock(mutex);
    now = census;
  }
  if (now.census == nullptr) {
    return std::nullopt;
  }
  if (!is_over) {
    const int parts = parts_at(settings(), due.samples);
    prepare_tracing_thread();
    const double cpu_start = thread_cpu_seconds();
    for (; now.parts_out < parts; ++now.parts_out) {
      now.census->trace(now.parts_out * kCensusPart, (now.parts_out + 1) * kCensusPart);
    }
    film->add_cpu_seconds(thread_cpu_seconds() - cpu_start);
    MutexLock lock(mutex);
    census.parts_out = now.parts_out;
  }
  if (now.parts_out == 0 || now.census->picture_unit() == 0) {
    return std::nullopt;
  }
  return core::light_not_found(*now.census, now.parts_out * kCensusPart, *film, renderer->view(),
                               confidence);
}

}  // namespace core
