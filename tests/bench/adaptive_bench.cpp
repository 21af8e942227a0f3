// 1 / (V T) of adaptive sampling against uniform sample counts, over the built-in scenes, in one
// run. Prints, never asserts. V: mean over pixels and channels of the variance over seeds, over
// (mean^2 + 0.01); T: CPU seconds, including the pilot.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/scene_io/builtin_scenes.h"
#include "tests/bench/bench_views.h"
#include "tests/support/scenes.h"

namespace {

struct Run {
  std::vector<core::Rgb> pixels;
  double cpu_seconds = 0;
};

struct Variant {
  const char* name;
  core::AdaptiveSettings settings;
};

Run render(core::View view, const core::AdaptiveSettings& adaptive, int samples, int seed) {
  view.settings.adaptive = adaptive;
  view.settings.seed = static_cast<std::uint64_t>(seed);
  const test_support::Picture picture = test_support::render(view, samples);
  Run run;
  run.cpu_seconds = picture.progress.cpu_seconds;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    run.pixels.push_back(core::pixel_value(picture.snapshot, i).mean);
  }
  return run;
}

/// V T of each seed.
std::vector<double> costs(const std::vector<Run>& runs, const std::vector<core::Rgb>& mu) {
  const auto seeds = static_cast<double>(runs.size());
  std::vector<double> out;
  for (const Run& run : runs) {
    double sum = 0;
    for (std::size_t i = 0; i < mu.size(); ++i) {
      core::Rgb mean;
      for (const Run& other : runs) {
        mean += other.pixels[i] * static_cast<float>(1 / seeds);
      }
      for (int c = 0; c < 3; ++c) {
        const auto d = static_cast<double>(run.pixels[i][c] - mean[c]);
        sum += d * d / (static_cast<double>(mu[i][c] * mu[i][c]) + 0.01);
      }
    }
    out.push_back(sum / (3 * static_cast<double>(mu.size())) * seeds / (seeds - 1) *
                  run.cpu_seconds);
  }
  return out;
}

double mean_of(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) {
    sum += v / static_cast<double>(values.size());
  }
  return sum;
}

double error_of(const std::vector<double>& values) {
  const double mean = mean_of(values);
  double sum = 0;
  for (const double v : values) {
    sum += (v - mean) * (v - mean);
  }
  const auto n = static_cast<double>(values.size());
  return std::sqrt(sum / (n - 1) / n) / mean;
}

}  // namespace

int main(int argc, char** argv) {
  const int samples = argc > 1 ? std::atoi(argv[1]) : 256;
  const int seeds = argc > 2 ? std::atoi(argv[2]) : 6;
  const int width = argc > 3 ? std::atoi(argv[3]) : 192;
  const int height = width * 9 / 16;
  using enum core::AdaptiveType;
  const std::array variants = {
      Variant{"none", {kNone}},
      Variant{"pilot", {kPilot}},
      Variant{"pilot, tiles", {kPilot, 32, core::Granularity::kTile, 0}},
  };
  std::printf(
      "adaptive sampling, %dx%d, %d samples per pixel, %d seeds: 1/(V T) over that of none "
      "(standard error)\n",
      width, height, samples, seeds);
  std::array<double, variants.size()> logs{};
  for (const core::BuiltinScene& builtin : core::builtin_scenes()) {
    const core::View view = bench::builtin_view(builtin.name, width, height);
    std::array<std::vector<Run>, variants.size()> runs;
    for (int seed = 1; seed <= seeds; ++seed) {
      for (std::size_t v = 0; v < variants.size(); ++v) {
        runs[v].push_back(
            render(view, variants[v].settings, samples, seed + 1000 * static_cast<int>(v)));
      }
    }
    // The expected value is the same for all runs.
    std::vector<core::Rgb> mu(runs[0][0].pixels.size());
    for (std::size_t v = 0; v < variants.size(); ++v) {
      for (const Run& run : runs[v]) {
        for (std::size_t i = 0; i < mu.size(); ++i) {
          mu[i] += run.pixels[i] *
                   static_cast<float>(1.0 / (static_cast<double>(seeds) * variants.size()));
        }
      }
    }
    const std::vector<double> plain = costs(runs[0], mu);
    std::printf("%-14s", std::string(builtin.name).c_str());
    for (std::size_t v = 1; v < variants.size(); ++v) {
      const std::vector<double> these = costs(runs[v], mu);
      const double ratio = mean_of(plain) / mean_of(these);
      logs[v] += std::log(ratio) / static_cast<double>(core::builtin_scenes().size());
      std::printf("  %s %.2f (%.2f)", variants[v].name, ratio,
                  ratio * std::hypot(error_of(plain), error_of(these)));
    }
    std::printf("\n");
    std::fflush(stdout);
  }
  std::printf("geometric mean");
  for (std::size_t v = 1; v < variants.size(); ++v) {
    std::printf("  %s %.2f", variants[v].name, std::exp(logs[v]));
  }
  std::printf("\n");
  return 0;
}
