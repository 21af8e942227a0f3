// Benchmarks of the renderer alone. Prints, never asserts: times depend on the machine and its
// load.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <utility>

#include <sys/resource.h>

#include "core/accel/accel.h"
#include "core/base/cpu_time.h"
#include "core/error/error_estimate.h"
#include "core/samplers/path_sampler.h"
#include "core/settings/choices.h"
#include "tests/bench/embree_share.h"
#include "tests/bench/hall.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using Clock = std::chrono::steady_clock;

/// CPU time of a group of random numbers, where a 2-D point is half a group: the numbers of a path
/// of two bounces, five groups for each start. Best of five.
void measure_samplers() {
  constexpr int kPaths = 100'000;
  constexpr int kGroups = 5;
  for (const auto& entry : core::samplers()) {
    double best = 1e9;
    float sum = 0;
    for (int round = 0; round < 5; ++round) {
      core::PathSampler sampler(entry.value, 2, 1);
      const double start = core::thread_cpu_seconds();
      for (int i = 0; i < kPaths; ++i) {
        sampler.start(i / 64 % 512, i / 64 / 512, i % 64);
        for (int group = 0; group < kGroups; ++group) {
          const core::Vec4 u = sampler.get_4d(group);
          sum += u.x + u.y + u.z + u.w;
        }
      }
      best = std::min(best, core::thread_cpu_seconds() - start);
    }
    const double ns = best / kPaths / kGroups * 1e9;
    std::printf(
        "sampler      %-16s %6.1f ns per 2-D point, %6.1f per four numbers (mean of all %.4f)\n",
        std::string(entry.name).c_str(), ns / 2, ns,
        static_cast<double>(sum) / (5.0 * kPaths * kGroups * 4));
  }
}

double since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

core::View cornell_view(int side) {
  core::View view = test_support::view_of(test_support::cornell(), side, side);
  test_support::look_at(view, {0.5F, 0.5F, 2.4F}, {0.5F, 0.5F, 0}, 39);
  view.settings.max_depth = 9;
  return view;
}

void measure(const char* name, const core::View& view, int samples, int threads) {
  const bench::EmbreeShare embree;
  const auto start = Clock::now();
  const test_support::Picture p = test_support::render(view, samples, threads);
  const double seconds = since(start);
  const auto& film = view.settings.film;
  const double count = static_cast<double>(film.width) * film.height * p.progress.samples_mean;
  std::printf(
      "%-12s %6.3f Msamples/s  %6.2f Mrays/s  %5.2f rays/sample  %2.0f %% of CPU in Embree  "
      "relative RMSE %.4f  efficiency %.3f\n",
      name, count / seconds / 1e6, static_cast<double>(p.progress.rays) / seconds / 1e6,
      static_cast<double>(p.progress.rays) / count, 100 * embree.share(), p.progress.error.relative,
      p.progress.efficiency());
}

/// CPU time of an error check of a film of 1920x1080, and of its sums, which are computed when
/// tiles are committed.
void measure_look() {
  core::FilmSettings settings;
  settings.width = 1920;
  settings.height = 1080;
  settings.albedo = settings.normal = settings.depth = false;
  core::Film film(settings, 2);
  test_support::Random random(1);
  double committing = 0;
  for (int t = 0; t < film.tile_count(); ++t) {
    core::TileState tile = film.tile(t);
    for (core::ReplicatePixel& p : tile.pixels) {
      const float v = random.uniform();
      p = {v, v, v, 1, 0, 1};
    }
    const double start = core::thread_cpu_seconds();
    core::tile_light(tile.rect, tile.pixels, 2);
    committing += core::thread_cpu_seconds() - start;
    film.commit(t, std::move(tile));
  }
  const double start = core::thread_cpu_seconds();
  const core::ErrorEstimate estimate(film);
  const core::ErrorInterval e = estimate.image(0.95);
  const double bound = estimate.worst_tile(0.95);
  std::printf(
      "look         1920x1080: %.4f s, after %.4f s for the sums of all tiles (error %.3f, worst "
      "tile at most %.3f)\n",
      core::thread_cpu_seconds() - start, committing, e.relative, bound);
}

}  // namespace

int main(int argc, char** argv) {
  const int samples = argc > 1 ? std::atoi(argv[1]) : 16;
  const int threads = argc > 2 ? std::atoi(argv[2]) : 2;
  const int side = argc > 3 ? std::atoi(argv[3]) : 512;
  std::printf("Embree %s, %d threads, %dx%d, %d samples per pixel, max_depth 9, box filter\n",
              core::embree_version(), threads, side, side, samples);
  measure_samplers();
  measure_look();
  const core::View cornell = cornell_view(side);
  measure("cornell-box", cornell, samples, threads);

  const auto start = Clock::now();
  const double before = peak_mb();
  const auto scene = test_support::build(bench::hall());
  std::printf(
      "hall         %zu triangles, built in %.2f s, %.1f bytes per triangle, peak memory %.0f MB "
      "(%.0f before)\n",
      scene->summary().triangles, since(start),
      static_cast<double>(scene->summary().bytes) / static_cast<double>(scene->summary().triangles),
      peak_mb(), before);
  core::View view = test_support::view_of(scene, side, side);
  view.settings.max_depth = 9;
  view.environment = test_support::constant_sky({1, 1, 1});
  measure("hall", view, samples, threads);

  const core::Film film(core::FilmSettings{}, 2);
  std::printf("film         %.1f bytes per pixel with albedo, normal and depth; 48 without\n",
              static_cast<double>(film.bytes()) / (960.0 * 540.0));
  std::printf("peak memory  %.0f MB\n", peak_mb());
  return 0;
}
