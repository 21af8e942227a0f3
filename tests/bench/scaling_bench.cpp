// Speedup of a job over threads: scaling_bench [SCENE [SAMPLES [WIDTH]]] (cornell-box, 64, 960).
//
// Measured: speed relative to one thread, with all threads of this machine. Simulated, for more
// threads: a task gives its slices to virtual threads, one process renders each of them and records
// its CPU seconds, and the slice that ends first in virtual time is delivered first. The work of a
// thread between two slices (taking one, committing it, decisions at the end of a pass) counts as
// if it held one lock throughout, which is more than the real task does; only the tile's copy and
// its sums, which each thread makes itself, are timed separately. Memory and caches of large
// machines are not simulated.
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <optional>
#include <queue>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/base/cpu_time.h"
#include "core/film/film.h"
#include "core/film/half_sums.h"
#include "core/integrators/registry.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "core/render/units/slice_work.h"
#include "tests/bench/named_view.h"
#include "tests/support/tasks.h"

namespace {

/// A separate job for every run.
struct Job {
  Job(std::shared_ptr<const core::Renderer> renderer, int samples)
      : film(core::make_film(renderer->view().settings)) {
    const core::TaskOptions options = test_support::samples(samples);
    slice_seconds = options.slice_target_seconds;
    task = std::make_unique<core::RenderTask>(std::move(renderer), film, options, sink);
  }
  core::NullSink sink;
  std::shared_ptr<core::Film> film;
  double slice_seconds;
  std::unique_ptr<core::RenderTask> task;
};

double wall_seconds(const std::shared_ptr<const core::Renderer>& renderer, int samples,
                    int threads) {
  const Job job(renderer, samples);
  const auto began = std::chrono::steady_clock::now();
  core::run_to_end(*job.task, threads);
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
}

/// CPU seconds of the work of a slice without a lock, excluding samples.
struct Unlocked {
  double copy = 0;
  double sums = 0;
};

template <typename F>
double cpu_seconds(const F& what) {
  const double began = core::thread_cpu_seconds();
  what();
  return core::thread_cpu_seconds() - began;
}

double sums_of(const core::Film& film, const core::TileState& state) {
  return core::tile_light(state.rect, state.pixels, film.replicates()).roots;
}

/// Measured with memory in the cache.
Unlocked unlocked_work(const std::shared_ptr<const core::Renderer>& renderer) {
  const Job job(renderer, 2);
  core::run_to_end(*job.task, 1);
  constexpr int kTimes = 1000;
  Unlocked out;
  for (int i = 0; i < kTimes; ++i) {
    core::TileState state;
    out.copy += cpu_seconds([&] { state = job.film->tile(0); }) / kTimes;
    out.sums += cpu_seconds([&] { return sums_of(*job.film, state); }) / kTimes;
  }
  return out;
}

struct Simulated {
  double seconds = 0;         ///< virtual time, to the end of the job
  double render_seconds = 0;  ///< of slices
  double own_seconds = 0;     ///< of other work without a lock
  double locked_seconds = 0;
  double waited_seconds = 0;  ///< for the lock
  int slices = 0;
  double efficiency(int threads) const {
    return (render_seconds + own_seconds + locked_seconds) / (threads * seconds);
  }
};

struct Delivery {
  double at = 0;
  std::size_t work = 0;
  bool operator>(const Delivery& other) const { return at > other.at; }
};

Simulated simulate(const std::shared_ptr<const core::Renderer>& renderer, int samples, int threads,
                   const Unlocked& unlocked) {
  const Job job(renderer, samples);
  core::RenderTask& task = *job.task;
  Simulated out;
  double lock_free = 0;
  std::vector<double> idle(static_cast<std::size_t>(threads), 0.0);  // idle since this time
  std::vector<core::SliceWork> works;
  std::priority_queue<Delivery, std::vector<Delivery>, std::greater<>> out_there;
  // Runs from virtual time `at`: `alone` without the lock, then with the lock the time of `both`
  // minus `again`, the time of repeating the unlocked part with its memory in the cache. Returns
  // the time at which it is done.
  const auto run = [&](double at, const auto& alone, double again, const auto& both) {
    const double own = cpu_seconds(alone);
    const double locked = std::max(cpu_seconds(both) - again, 0.0);
    const double from = std::max(at + own, lock_free);
    out.waited_seconds += from - at - own;
    out.own_seconds += own;
    out.locked_seconds += locked;
    lock_free = from + locked;
    return lock_free;
  };
  while (true) {
    while (!idle.empty()) {
      const auto first = std::min_element(idle.begin(), idle.end());
      std::optional<core::SliceWork> work;
      const std::optional<core::Slice> slice = task.take();
      const double at = run(
          *first, [&] { return slice ? job.film->tile(slice->tile).rays : 0; },
          slice ? unlocked.copy : 0,
          [&] {
            if (slice) {
              work = task.prepare(*slice, job.slice_seconds);
            }
          });
      if (!work) {
        break;
      }
      idle.erase(first);
      const double began = core::thread_cpu_seconds();
      CHECK(core::render_slice(*renderer, *work, {}));
      const double took = core::thread_cpu_seconds() - began;
      out.render_seconds += took;
      ++out.slices;
      out_there.push({at + took, works.size()});
      works.push_back(std::move(*work));
    }
    if (out_there.empty()) {
      break;
    }
    const Delivery next = out_there.top();
    out_there.pop();
    core::SliceWork done = std::exchange(works[next.work], core::SliceWork{});
    const double at = run(
        next.at, [&] { return sums_of(*job.film, done.state); }, unlocked.sums,
        [&] { task.accept(std::move(done)); });
    // Idle threads ask again when slices may be available.
    for (double& since : idle) {
      since = std::max(since, at);
    }
    idle.push_back(at);
    out.seconds = std::max(out.seconds, at);
  }
  CHECK(task.finished());
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const std::string scene = argc > 1 ? argv[1] : "cornell-box";
  const int samples = argc > 2 ? std::atoi(argv[2]) : 64;
  const int width = argc > 3 ? std::atoi(argv[3]) : 960;
  if (samples < 1 || width < 16) {
    std::fputs("scaling_bench [SCENE [SAMPLES [WIDTH]]]\n", stderr);
    return 2;
  }
  const int height = width * 9 / 16;
  auto renderer = core::settled_renderer(bench::named_view(scene, width, height));
  CHECK(renderer);
  const auto cores = static_cast<int>(std::max(std::thread::hardware_concurrency(), 1U));
  std::printf("%s, %d x %d, %d samples\n", scene.c_str(), width, height, samples);
  wall_seconds(*renderer, 2, cores);  // warms up
  double of_one = 0;
  for (int threads = 1; threads <= cores; threads *= 2) {
    const double seconds = wall_seconds(*renderer, samples, threads);
    of_one = threads == 1 ? seconds : of_one;
    std::printf("measured,  %2d threads: %7.2f s, efficiency %5.1f %%\n", threads, seconds,
                100 * of_one / (threads * seconds));
  }
  const Unlocked unlocked = unlocked_work(*renderer);
  for (const int threads : {1, 2, 8, 32, 64}) {
    const Simulated s = simulate(*renderer, samples, threads, unlocked);
    std::printf(
        "simulated, %2d threads: %7.2f s, efficiency %5.1f %%; %6d slices of %5.2f ms, %4.1f us "
        "with a lock, %4.1f without; waiting for it %4.2f %%\n",
        threads, s.seconds, 100 * s.efficiency(threads), s.slices,
        1e3 * s.render_seconds / s.slices, 1e6 * s.locked_seconds / s.slices,
        1e6 * s.own_seconds / s.slices, 100 * s.waited_seconds / (threads * s.seconds));
  }
  return 0;
}
