#include "server/jobs/pilot.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <vector>

#include "core/base/statistics.h"
#include "core/film/meter_chunk.h"
#include "core/integrators/registry.h"
#include "core/render/task/eta.h"
#include "core/settings/sample_sets.h"
#include "server/observe/clock.h"

namespace server {
namespace {

constexpr double kPixels = 64.0 * 64.0;
constexpr int kSamples = 16;
constexpr double kSeconds = 0.5;
constexpr std::chrono::seconds kPatience{5};
constexpr double kMachine = 1.25;
/// Slowest decrease of the error: that of independent samples.
constexpr double kIndependent = 0.5;
/// Largest measured factor by which adaptive sampling, which the pilot does not use, reduces the
/// number of samples (tests/bench/run --targets).
constexpr double kAdaptiveGain = 2;

int scaled(int pixels, double factor) {
  return std::max(1, static_cast<int>(std::lround(pixels * factor)));
}

/// Rounds up for samplers without prefixes, which render only whole sets.
int whole_sets(const core::RenderSettings& settings) {
  return core::rounded_samples(settings, kSamples);
}

double pixels_of(const core::PixelRect& rect) {
  return static_cast<double>(rect.width) * static_cast<double>(rect.height);
}

}  // namespace

PathCost path_cost(const core::Film& film) {
  std::vector<double> costs;
  double cpu_seconds = 0;
  double samples = 0;
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const core::TileState state = film.tile(tile);
    const double count = static_cast<double>(state.samples) * pixels_of(state.rect);
    if (count > 0) {
      costs.push_back(state.cpu_seconds / count);
      cpu_seconds += state.cpu_seconds;
      samples += count;
    }
  }
  PathCost cost;
  cost.mean = samples > 0 ? cpu_seconds / samples : 0;
  double squares = 0;
  for (const double each : costs) {
    squares += (each - cost.mean) * (each - cost.mean);
  }
  const auto n = static_cast<double>(costs.size());
  const double spread =
      n > 2 ? core::student_t_quantile(0.975, n - 1) * std::sqrt(squares / (n - 1) / n)
            : cost.mean / 2;
  cost.low = std::max(0.0, cost.mean - spread) / kMachine;
  cost.high = (cost.mean + spread) * kMachine;
  return cost;
}

api::JobSpec pilot_spec(api::JobSpec spec) {
  core::FilmSettings& film = spec.render.film;
  const core::PixelRect crop = film.area();
  const double factor = std::min(1.0, std::sqrt(kPixels / pixels_of(crop)));
  film.width = scaled(film.width, factor);
  film.height = scaled(film.height, factor);
  if (film.crop) {
    core::PixelRect small;
    small.width = std::min(film.width, scaled(crop.width, factor));
    small.height = std::min(film.height, scaled(crop.height, factor));
    small.x = std::min(static_cast<int>(crop.x * factor), film.width - small.width);
    small.y = std::min(static_cast<int>(crop.y * factor), film.height - small.height);
    film.crop = small;
  }
  spec.render.adaptive.type = core::AdaptiveType::kNone;
  spec.render.meter = {};
  return spec;
}

Pilot::Pilot(std::shared_ptr<const core::Renderer> renderer)
    : film_(core::make_film(renderer->view().settings)),
      task_(renderer, film_,
            core::TaskOptions{.stop = {.samples_per_pixel = whole_sets(renderer->view().settings),
                                       .seconds = kSeconds},
                              .slice_target_seconds = 0.005,
                              .points_before = {}},
            *this) {}

bool Pilot::run_slice() {
  try {
    const auto slice = task_.take();
    if (!slice) {
      return false;
    }
    task_.run(*slice);
  } catch (const std::exception&) {
    end();  // Usually std::bad_alloc; the waiting thread finds pixels without samples.
    return false;
  }
  return true;
}

void Pilot::on_finished(core::StopReason /*reason*/) { end(); }

void Pilot::end() {
  const core::MutexLock lock(mutex_);
  is_done_ = true;
  done_.notify_all();
}

bool Pilot::wait(const std::stop_token& stop) {
  {
    const core::MutexLock lock(mutex_);
    done_.wait_for(mutex_, stop, kPatience, [this]() REQUIRES(mutex_) { return is_done_; });
  }
  task_.cancel();
  return task_.progress().samples_min > 0;
}

api::CostView Pilot::estimate(const api::JobSpec& spec, int threads, int samples_max) const {
  const core::Progress progress = task_.progress();
  const core::StopRules& stop = spec.stop;
  const double most = samples_max;
  double samples = stop.samples_per_pixel.value_or(samples_max);
  double samples_low = samples;
  double samples_high = samples;
  // The denoised (mixed) picture is at least as good as the plain one, so it needs at most these
  // samples.
  const double target = std::max(stop.relative_error.value_or(0), stop.denoised_error.value_or(0));
  if (target > 0) {
    std::vector<core::SeenError> seen;
    for (const core::ConvergencePoint& point : task_.points()) {
      seen.push_back({static_cast<double>(point.samples_per_pixel), point.error.relative});
    }
    const double most_samples = std::max(samples, 1.0);
    const double exponent = core::error_exponent(seen);
    const auto needed = [&](double error, double falls) {
      const double at = progress.samples_mean;
      return std::isfinite(error)
                 ? std::clamp(core::samples_for_error(at, error, target, falls), 1.0, most_samples)
                 : at;
    };
    const double gain = spec.render.adaptive.type == core::AdaptiveType::kNone ? 1 : kAdaptiveGain;
    samples_low = std::max(1.0, needed(progress.error.low, exponent) / gain);
    samples_high = needed(progress.error.high, kIndependent);
    samples = needed(progress.error.high, exponent);
  }
  const PathCost cost = path_cost(*film_);
  const double pixels = pixels_of(spec.render.film.area()) +
                        static_cast<double>(spec.render.meter.count()) * core::kMeterReplicates;
  api::CostView out;
  out.samples_per_pixel = std::min(samples, most);
  out.cpu_seconds = pixels * out.samples_per_pixel * cost.mean;
  out.seconds = out.cpu_seconds / threads;
  out.seconds_low = pixels * std::min(samples_low, most) * cost.low / threads;
  out.seconds_high = pixels * std::min(samples_high, most) * cost.high / threads;
  double limit = stop.seconds.value_or(INFINITY);
  if (stop.deadline_unix_seconds) {
    limit = std::min(limit, std::max(0.0, *stop.deadline_unix_seconds - unix_now()));
  }
  if (stop.cpu_seconds) {
    limit = std::min(limit, *stop.cpu_seconds / threads);
  }
  if (out.seconds > limit) {
    out.samples_per_pixel *= limit / out.seconds;
    out.cpu_seconds *= limit / out.seconds;
  }
  for (double* seconds : {&out.seconds, &out.seconds_low, &out.seconds_high}) {
    *seconds = std::min(*seconds, limit);
  }
  out.pilot_cpu_seconds = progress.cpu_seconds;
  return out;
}

}  // namespace server
