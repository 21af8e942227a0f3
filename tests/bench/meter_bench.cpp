// Coverage of the meter's 95 % intervals: six points in three scenes made by code, each with many
// seeds, also among the readings that are not marked unreliable. The true value is the mean of two
// long measurements. `unseen`: readings marked because light that no path has found may be more
// than a quarter; the others are marked by their randomisations. Prints, never asserts.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/film/meter_reading.h"
#include "core/integrators/registry.h"
#include "core/render/picture/unsampled_light.h"
#include "core/render/task/render_task.h"
#include "tests/support/caustic.h"
#include "tests/support/scenes.h"

namespace {

constexpr int kReferencePaths = 16384;  ///< a randomisation

struct Probe {
  const char* name;
  core::Vec3 at;
};
struct Scene {
  std::string name;
  core::View view;
  std::vector<Probe> probes;
};

core::View in_box(core::SceneDescription scene) {
  core::View view = test_support::view_of(std::move(scene), 1, 1);
  test_support::look_at(view, {0.5F, 0.5F, 2}, {0.5F, 0.5F, 0}, 40);
  view.settings.max_depth = 6;
  return view;
}

core::SceneDescription mirror_room() {
  core::SceneDescription scene = test_support::cornell();
  scene.materials.push_back(test_support::mirror());
  scene.meshes[0].primitives.push_back(test_support::sphere(
      {0.7F, 0.45F, 0.65F}, 0.14F, 24, false, static_cast<int>(scene.materials.size()) - 1));
  return scene;
}

std::vector<Scene> scenes() {
  core::View caustic = test_support::caustic();
  caustic.settings.film.width = caustic.settings.film.height = 1;
  return {
      {"matte box", in_box(test_support::cornell()), {{"floor in front", {0.5F, 0.001F, 0.9F}}}},
      {"box with a mirror ball",
       in_box(mirror_room()),
       {{"floor in front", {0.5F, 0.001F, 0.9F}},
        {"under the ball", {0.9F, 0.001F, 0.65F}},
        {"corner", {0.05F, 0.001F, 0.05F}}}},
      {"lamp over a glass ball",
       caustic,
       {{"under the ball", {0, 0.001F, 0}}, {"beside it", {1.2F, 0.001F, 0.3F}}}}};
}

std::vector<core::MeterReading> measured(core::View view, int paths, std::uint64_t seed,
                                         int threads) {
  view.settings.seed = seed;
  const auto film = test_support::render(view, paths, threads).film;
  return core::meter_readings(core::meter_points(view.settings.meter), film->meter(),
                              core::unsampled_path_light(view));
}

struct Count {
  int covered = 0;
  int all = 0;
  void add(bool is_covered) {
    covered += is_covered ? 1 : 0;
    ++all;
  }
};

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 60;
  const int threads = argc > 2 ? std::atoi(argv[2]) : 2;
  std::printf("meter, 95 %% intervals, %d seeds\n", seeds);
  Count total;
  Count total_unmarked;
  for (const Scene& scene : scenes()) {
    core::View view = scene.view;
    for (const Probe& probe : scene.probes) {
      view.settings.meter.points.push_back({core::Place(probe.at), {0, 1, 0}});
    }
    const auto one = measured(view, kReferencePaths, 1001, threads);
    const auto other = measured(view, kReferencePaths, 1002, threads);
    for (const int paths : {32, 64, 256}) {
      std::vector<Count> all(scene.probes.size());
      std::vector<Count> unmarked(scene.probes.size());
      std::vector<std::vector<double>> widths(scene.probes.size());
      const double unseen = 3.689 * core::unsampled_path_light(view) / (16.0 * paths);
      std::vector<int> marked_unseen(scene.probes.size());
      for (int seed = 1; seed <= seeds; ++seed) {
        const auto readings = measured(view, paths, static_cast<std::uint64_t>(seed), threads);
        for (std::size_t i = 0; i < readings.size(); ++i) {
          const double truth = 0.5 * (one[i].illuminance + other[i].illuminance);
          const core::MeterReading& r = readings[i];
          const bool is_covered = r.low <= truth && truth <= r.high;
          all[i].add(is_covered);
          total.add(is_covered);
          if (!r.unreliable) {
            unmarked[i].add(is_covered);
            total_unmarked.add(is_covered);
          }
          marked_unseen[i] += unseen > 0.25 * r.illuminance ? 1 : 0;
          widths[i].push_back((r.high - r.low) / truth);
        }
      }
      for (std::size_t i = 0; i < all.size(); ++i) {
        std::nth_element(widths[i].begin(), widths[i].begin() + seeds / 2, widths[i].end());
        std::printf(
            "%-24s %-16s %5d paths: covered %2d of %d, unmarked %2d of %2d, marked unseen %2d, "
            "width %.2f; true %.4g (two differ by %.1f %%)\n",
            scene.name.c_str(), scene.probes[i].name, paths, all[i].covered, all[i].all,
            unmarked[i].covered, unmarked[i].all, marked_unseen[i],
            widths[i][static_cast<std::size_t>(seeds / 2)],
            0.5 * (one[i].illuminance + other[i].illuminance),
            100 * std::abs(one[i].illuminance / other[i].illuminance - 1));
      }
      std::fflush(stdout);
    }
  }
  std::printf("all: covered %.1f %% of %d; not marked: %.1f %% of %d\n",
              100.0 * total.covered / total.all, total.all,
              100.0 * total_unmarked.covered / std::max(total_unmarked.all, 1), total_unmarked.all);
  return 0;
}
