// Coverage of error intervals of images and of single pixels, by brightness: renders with different
// seeds, the true value for each being the mean of the others. Each sampler, with and without
// adaptive sampling, and the estimators that learn from their samples; or one integrator. Without
// the name of a scene (`builtin`: all of these), glTF files under maps (coverage_assets.h).
// `missed`: images whose interval does not contain the error although they are not marked as
// unreliable. Prints, never asserts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/error/error_estimate.h"
#include "core/error/pixel_error.h"
#include "core/integrators/registry.h"
#include "core/settings/choices.h"
#include "tests/bench/bench_views.h"
#include "tests/bench/coverage_assets.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

constexpr std::size_t kClasses = 5;

struct Plan {
  int renders = 200;
  int width = 64;
  int threads = 2;
};

/// The brightness class of each noisy pixel, from dark to bright; kClasses: the pixel has no noise.
std::vector<std::size_t> classes_of(const std::vector<double>& values,
                                    const std::vector<double>& variances) {
  const auto has_noise = [&](std::size_t p) {
    return variances[p] > 1e-10 * values[p] * values[p];
  };
  std::vector<double> sorted;
  for (std::size_t p = 0; p < values.size(); ++p) {
    if (has_noise(p)) {
      sorted.push_back(values[p]);
    }
  }
  std::sort(sorted.begin(), sorted.end());
  std::vector<std::size_t> out;
  for (std::size_t p = 0; p < values.size(); ++p) {
    const auto below = static_cast<std::size_t>(
        std::lower_bound(sorted.begin(), sorted.end(), values[p]) - sorted.begin());
    out.push_back(has_noise(p) ? below * kClasses / sorted.size() : kClasses);
  }
  return out;
}

double green(const core::FilmSnapshot& film, std::size_t pixel) {
  return static_cast<double>(core::pixel_value(film, pixel).mean.g);
}

void measure(const std::string& what, core::View view, int samples, const Plan& plan) {
  std::vector<core::FilmSnapshot> films;
  std::vector<double> sum;
  std::vector<double> squares;
  for (int i = 0; i < plan.renders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    films.push_back(test_support::render(view, samples, plan.threads).snapshot);
    sum.resize(films[0].pixel_count());
    squares.resize(films[0].pixel_count());
    for (std::size_t p = 0; p < sum.size(); ++p) {
      sum[p] += green(films.back(), p);
      squares[p] += green(films.back(), p) * green(films.back(), p);
    }
  }
  const auto others = static_cast<double>(plan.renders - 1);
  // The mean of the others has its own error.
  const double widened = std::sqrt(1 + 1 / others);
  std::array<double, kClasses + 1> inside{};
  std::array<double, kClasses + 1> all{};
  std::vector<int> hits(sum.size());
  const std::vector<double> errors = test_support::errors_of(films);
  std::vector<double> means(sum.size());
  std::vector<double> variances(sum.size());
  for (std::size_t p = 0; p < sum.size(); ++p) {
    means[p] = sum[p] / plan.renders;
    variances[p] = (squares[p] / plan.renders - means[p] * means[p]) * plan.renders / others;
  }
  const std::vector<std::size_t> classes = classes_of(means, variances);
  double image = 0;
  double estimate = 0;
  double unreliable = 0;
  double missed = 0;
  for (std::size_t i = 0; i < films.size(); ++i) {
    const core::FilmSnapshot& film = films[i];
    for (std::size_t p = 0; p < sum.size(); ++p) {
      const auto e = core::pixel_error(film, static_cast<int>(p) % film.rect.width,
                                       static_cast<int>(p) / film.rect.width);
      const double value = green(film, p);
      const double off = std::fabs(value - (sum[p] - value) / others);
      const double half_width = 0.5 * static_cast<double>(e.high.g - e.low.g);
      const bool in = off <= widened * half_width + 1e-6 * value;
      inside[classes[p]] += in ? 1 : 0;
      all[classes[p]] += 1;
      hits[p] += in ? 1 : 0;
    }
    const core::ErrorInterval e =
        core::ErrorEstimate(core::half_sums(film), film.errors).image(0.95);
    const bool is_covered = e.low <= errors[i] && errors[i] <= e.high;
    unreliable += e.unreliable ? 1.0 / plan.renders : 0;
    image += is_covered ? 1.0 / plan.renders : 0;
    missed += !is_covered && !e.unreliable ? 1.0 / plan.renders : 0;
    estimate += e.relative / errors[i] / plan.renders;
  }
  const auto below =
      std::count_if(hits.begin(), hits.end(), [&](int n) { return n < 0.9 * plan.renders; });
  std::printf("%-48s %4d", what.c_str(), samples);
  for (std::size_t k = 0; k < kClasses; ++k) {
    std::printf("  %5.1f", 100 * inside[k] / std::max(all[k], 1.0));
  }
  std::printf("   %4.1f   %5.1f  %+6.1f  %5.1f  %5.1f\n",
              100.0 * static_cast<double>(below) / static_cast<double>(hits.size()), 100 * image,
              100 * (estimate - 1), 100 * unreliable, 100 * missed);
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> words(argv + 1, argv + argc);
  const bool is_short = std::erase(words, "--short") > 0;
  // Returns the value of an option and removes both words.
  const auto value = [&](const char* name) {
    const auto at = std::find(words.begin(), words.end(), name);
    if (at == words.end() || at + 1 == words.end()) {
      return std::string();
    }
    const std::string out = *(at + 1);
    words.erase(at, at + 2);
    return out;
  };
  const std::string files = value("--only");
  const std::string by = value("--by");
  const auto word = [&](std::size_t i) { return i < words.size() ? words[i] : std::string(); };
  const auto number = [&](std::size_t i, int fallback) {
    return word(i).empty() ? fallback : std::atoi(word(i).c_str());
  };
  const std::string only = word(3);        // one scene instead of all
  const std::string integrator = word(4);  // of that scene
  if (only.empty()) {
    const bench::AssetPlan assets = {
        number(0, is_short ? 6 : 40), number(1, 96), number(2, 2), is_short, files, by};
    if (bench::measure_asset_coverage(assets, bench::folder_of(argv[0]))) {
      return 0;
    }
    std::printf("built-in scenes instead\n");
  }
  const Plan plan = {number(0, is_short ? 20 : 200), number(1, is_short ? 48 : 64), number(2, 2)};
  std::printf(
      "coverage of 95 %% intervals, %d renders, %d pixels wide\n"
      "%-48s  spp  %% of pixels, dark to bright             <90 %%   image  estimate  unreliable  "
      "missed\n",
      plan.renders, plan.width, "");
  if (!integrator.empty()) {
    core::View view = bench::builtin_view(only, plan.width);
    const core::FilmSettings film = view.settings.film;
    view.settings = core::default_settings(integrator);
    view.settings.film = film;
    for (const int samples : {8, 32, 128}) {
      measure(only + ", " + integrator, view, samples, plan);
    }
    return 0;
  }
  for (const std::string_view scene :
       {"cornell-box", "interior", "many-lights", "veach-mis", "glass"}) {
    if (!only.empty() && only != "builtin" && only != scene) {
      continue;
    }
    const core::View view = bench::builtin_view(scene, plan.width);
    for (const int samples : {16, 64}) {
      measure(std::string(scene), view, samples, plan);
    }
    if (is_short || (!only.empty() && only != "builtin")) {
      continue;
    }
    core::View adaptive = view;
    adaptive.settings.adaptive.type = core::AdaptiveType::kPilot;
    measure(std::string(scene) + ", pilot", adaptive, 64, plan);
    core::View optimal = view;
    optimal.settings.estimator.mis = core::MisType::kOptimal;
    measure(std::string(scene) + ", optimal MIS", optimal, 32, plan);
    core::View regression = view;
    regression.settings.estimator.control_variate = core::ControlVariateType::kRegression;
    measure(std::string(scene) + ", regression", regression, 32, plan);
  }
  if (is_short || (!only.empty() && only != "builtin")) {
    return 0;
  }
  for (const std::string_view scene : {"cornell-box", "interior"}) {
    for (const auto& sampler : core::samplers()) {
      core::View view = bench::builtin_view(scene, plan.width);
      view.settings.sampler = sampler.value;
      measure(std::string(scene) + ", " + std::string(sampler.name), view, 16, plan);
      view.settings.adaptive.type = core::AdaptiveType::kPilot;
      measure(std::string(scene) + ", " + std::string(sampler.name) + ", pilot", view, 64, plan);
    }
  }
  return 0;
}
