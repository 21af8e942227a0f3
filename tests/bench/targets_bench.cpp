// Jobs that stop at an error target, each with many seeds: fraction of runs whose true error,
// against a reference of many samples, is at most the target, and the median of its ratio to the
// target; fraction flagged as unreliable. On ten glTF files under two maps, or on built-in scenes.
// Prints, never asserts.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "core/render/task/render_task.h"
#include "core/scene_io/builtin_scenes.h"
#include "tests/bench/asset_groups.h"
#include "tests/bench/bench_views.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

constexpr double kConfidence = 0.95;
constexpr int kReferenceSamples = 4096;
/// Little noise is left to see (the guide's table of errors and words).
constexpr double kAssetTarget = 0.05;

struct Group {
  std::string name;
  core::View view;
  test_support::Truth truth;
};

struct Plan {
  int seeds = 100;
  int threads = 2;
  std::vector<double> shares;  ///< targets, as fractions of the error at 64 samples
  std::optional<double> target;
};

/// Ratios of true errors to targets, over all groups.
struct Totals {
  double runs = 0;
  double met = 0;
  std::vector<double> medians;
};

void measure(core::View view, const std::string& name, const test_support::Truth& truth,
             double target, const Plan& plan, Totals& totals) {
  core::StopRules stop;
  stop.relative_error = target;
  stop.confidence = kConfidence;
  std::vector<double> ratios;
  double samples = 0;
  int unreliable = 0;
  for (int i = 0; i < plan.seeds; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    const auto picture = test_support::render(view, stop, plan.threads);
    ratios.push_back(test_support::defined_error(picture.snapshot, truth) / target);
    samples += picture.progress.samples_mean / plan.seeds;
    unreliable += picture.progress.error.unreliable ? 1 : 0;
  }
  std::sort(ratios.begin(), ratios.end());
  const auto met = std::upper_bound(ratios.begin(), ratios.end(), 1.0) - ratios.begin();
  totals.runs += plan.seeds;
  totals.met += static_cast<double>(met);
  totals.medians.push_back(ratios[ratios.size() / 2]);
  const bool is_pilot = view.settings.adaptive.type == core::AdaptiveType::kPilot;
  std::printf(
      "%-52s target %.4f  %-5s  met %5.1f %%  median %.2f  p95 %.2f  most %.2f  samples %.0f  "
      "unreliable %d\n",
      name.c_str(), target, is_pilot ? "pilot" : "none",
      100.0 * static_cast<double>(met) / static_cast<double>(ratios.size()),
      ratios[ratios.size() / 2], ratios[ratios.size() * 95 / 100], ratios.back(), samples,
      unreliable);
  std::fflush(stdout);
}

void measure(const Group& group, const Plan& plan, Totals& totals) {
  core::View view = group.view;
  view.settings.seed = 999;
  const double at_64 = test_support::render(view, 64, plan.threads).progress.error.relative;
  if (!(at_64 > 0)) {
    std::printf("%-52s no noise\n", group.name.c_str());
    return;
  }
  std::vector<double> targets;
  for (const double share : plan.shares) {
    targets.push_back(share * at_64);
  }
  if (plan.target) {
    targets.push_back(*plan.target);
  }
  for (const double target : targets) {
    for (const core::AdaptiveType type : {core::AdaptiveType::kNone, core::AdaptiveType::kPilot}) {
      view.settings.adaptive.type = type;
      measure(view, group.name, group.truth, target, plan, totals);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  const bool is_short = std::erase(words, "--short") > 0;
  const auto word = [&](std::size_t i) { return i < words.size() ? words[i] : std::string(); };
  const auto number = [&](std::size_t i, int fallback) {
    return word(i).empty() ? fallback : std::atoi(word(i).c_str());
  };
  const std::string scene = word(4);
  Plan plan = {number(0, is_short ? 5 : 100), number(2, 2), {1.6, 0.6}, {}};
  const int width = number(1, 96);
  if (!word(3).empty()) {
    plan.shares = {std::atof(word(3).c_str())};
  }
  std::printf(
      "error targets, confidence %.2f, %d seeds, %d pixels wide: met; true error over target: "
      "median, 95th percentile, most; samples\n",
      kConfidence, plan.seeds, width);
  Totals totals;
  const bench::AssetPlan assets = {plan.seeds, width, plan.threads, is_short, {}, {}};
  const bool is_done =
      scene.empty() && bench::for_asset_groups(
                           assets, bench::folder_of(argv[0]), [&](const bench::AssetGroup& group) {
                             plan.target = kAssetTarget;
                             measure({group.name, group.view, group.truth}, plan, totals);
                           });
  for (const core::BuiltinScene& builtin : core::builtin_scenes()) {
    if (is_done || (!scene.empty() && scene != "builtin" && builtin.name != scene)) {
      continue;
    }
    const core::View view = bench::builtin_view(builtin.name, width);
    measure({std::string(builtin.name), view,
             test_support::truth_of(
                 test_support::render(view, kReferenceSamples, plan.threads).snapshot)},
            plan, totals);
  }
  std::sort(totals.medians.begin(), totals.medians.end());
  if (!totals.medians.empty()) {
    std::printf("all: met %.1f %% of %.0f; medians %.2f to %.2f, in the median %.2f\n",
                100 * totals.met / totals.runs, totals.runs, totals.medians.front(),
                totals.medians.back(), totals.medians[totals.medians.size() / 2]);
  }
  return 0;
}
