// Jobs that stop at an error target, 100 seeds each on the built-in scenes: fraction of runs whose
// true error, against a reference of many samples, is at most the target, and the median of its
// ratio to the target; fraction flagged as unreliable. Prints, never asserts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/render/task/render_task.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/settings/registry.h"
#include "tests/bench/bench_views.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

constexpr double kConfidence = 0.95;
constexpr int kReferenceSamples = 4096;

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
  const int width = argc > 2 ? std::atoi(argv[2]) : 96;
  const int threads = argc > 3 ? std::atoi(argv[3]) : 2;
  // Targets, as fractions of the error at 64 samples, and optionally a single scene.
  const std::vector<double> shares =
      argc > 4 ? std::vector<double>{std::atof(argv[4])} : std::vector<double>{1.6, 0.6};
  const std::string only = argc > 5 ? argv[5] : "";
  const std::array<std::pair<const char*, core::AdaptiveType>, 2> kinds = {
      {{"none", core::AdaptiveType::kNone}, {"pilot", core::AdaptiveType::kPilot}}};
  std::printf(
      "error targets, confidence %.2f, %d seeds, %d pixels wide: met; true error over target: "
      "median, 95th percentile, most; samples\n",
      kConfidence, seeds, width);
  for (const core::BuiltinScene& builtin : core::builtin_scenes()) {
    if (!only.empty() && builtin.name != only) {
      continue;
    }
    core::View view = bench::builtin_view(builtin.name, width);
    view.settings.seed = 999;
    const auto probe = test_support::render(view, 64, threads);
    const double at_64 = probe.progress.error.relative;
    if (!(at_64 > 0)) {
      std::printf("%-12s no noise\n", std::string(builtin.name).c_str());
      continue;
    }
    const auto truth =
        test_support::truth_of(test_support::render(view, kReferenceSamples, threads).snapshot);
    for (const double share : shares) {
      for (const auto& [name, type] : kinds) {
        view.settings.adaptive.type = type;
        core::StopRules stop;
        stop.relative_error = at_64 * share;
        stop.confidence = kConfidence;
        std::vector<double> ratios;
        double samples = 0;
        int unreliable = 0;
        for (int i = 0; i < seeds; ++i) {
          view.settings.seed = static_cast<std::uint64_t>(i) + 1;
          const auto picture = test_support::render(view, stop, threads);
          ratios.push_back(test_support::defined_error(picture.snapshot, truth) /
                           *stop.relative_error);
          samples += picture.progress.samples_mean / seeds;
          unreliable += picture.progress.error.unreliable ? 1 : 0;
        }
        std::sort(ratios.begin(), ratios.end());
        const auto met = std::upper_bound(ratios.begin(), ratios.end(), 1.0) - ratios.begin();
        std::printf(
            "%-12s target %.4f  %-5s  met %5.1f %%  median %.2f  p95 %.2f  most %.2f  samples "
            "%.0f  unreliable %d\n",
            std::string(builtin.name).c_str(), *stop.relative_error, name,
            100.0 * static_cast<double>(met) / static_cast<double>(ratios.size()),
            ratios[ratios.size() / 2], ratios[ratios.size() * 95 / 100], ratios.back(), samples,
            unreliable);
        std::fflush(stdout);
      }
    }
    view.settings.adaptive.type = core::AdaptiveType::kNone;
  }
  return 0;
}
