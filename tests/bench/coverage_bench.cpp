// Coverage of error intervals of images and of single pixels, by brightness: renders with different
// seeds, the true value for each being the mean of the others. Each sampler, with and without
// adaptive sampling, and the estimators that learn from their samples; or one integrator; or, with
// the scene `assets`, glTF files under two maps by several integrators, plain, without fireflies
// and denoised. `missed`: images whose interval does not contain the error although they are not
// marked as unreliable. Prints, never asserts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "core/error/error_estimate.h"
#include "core/error/pixel_error.h"
#include "core/film/set_aside.h"
#include "core/settings/registry.h"
#include "tests/bench/bench_views.h"
#include "tests/bench/named_view.h"
#include "tests/render/asset_files.h"
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

/// Intervals of one kind of image over all scenes.
struct Pooled {
  double images = 0;
  double covered = 0;
  double sure = 0;  ///< not marked unreliable
  double sure_covered = 0;
  double least = 100;  ///< per cent covered of a group
  std::vector<double> ratios;

  void add(const std::vector<core::ErrorInterval>& seen, const std::vector<double>& errors) {
    double here = 0;
    double ratio = 0;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const bool is_covered = seen[i].low <= errors[i] && errors[i] <= seen[i].high;
      here += is_covered ? 1 : 0;
      sure += seen[i].unreliable ? 0 : 1;
      sure_covered += is_covered && !seen[i].unreliable ? 1 : 0;
      ratio += seen[i].relative / errors[i] / static_cast<double>(seen.size());
    }
    const auto count = static_cast<double>(seen.size());
    images += count;
    covered += here;
    least = std::min(least, 100 * here / count);
    ratios.push_back(ratio);
    std::printf("  %5.1f (%.2f)", 100 * here / count, ratio);
  }
  void print(const char* name) {
    std::sort(ratios.begin(), ratios.end());
    std::printf(
        "%-10s %5.0f images covered %.1f %%, unmarked %.1f %%, worst group %.1f %%, "
        "estimate over error %.2f in the median\n",
        name, images, 100 * covered / std::max(images, 1.0),
        100 * sure_covered / std::max(sure, 1.0), least,
        ratios.empty() ? 0.0 : ratios[ratios.size() / 2]);
  }
};

/// Plain images, images without fireflies, and denoised ones (`mixed`).
struct Kinds {
  Pooled plain;
  Pooled calm;
  Pooled denoised;
};

void measure_asset(const std::string& scene, std::string_view integrator, int samples,
                   const Plan& plan, Kinds& kinds) {
  core::View view = bench::named_view(scene, plan.width, plan.width * 9 / 16);
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(integrator);
  view.settings.film = film;
  std::vector<core::FilmSnapshot> films;
  std::vector<std::vector<core::Rgb>> calm;
  std::vector<std::vector<core::Rgb>> clean;
  std::vector<core::ErrorInterval> plain_errors;
  std::vector<core::ErrorInterval> clean_errors;
  for (int i = 0; i < plan.renders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    films.push_back(test_support::render(view, samples, plan.threads).snapshot);
    const core::FilmSnapshot& seen = films.back();
    plain_errors.push_back(core::ErrorEstimate(core::half_sums(seen), seen.errors).image(0.95));
    core::FilmSnapshot without = seen;
    core::set_aside(without, without.rect);
    calm.push_back(test_support::image_of(without));
    const auto made =
        core::denoise(seen, nullptr, core::StatisticalDenoiser(), core::parallel_for(plan.threads));
    CHECK(made);
    clean.emplace_back();
    for (std::size_t p = 0; p < seen.pixel_count(); ++p) {
      const core::ColorPlanes& planes = made->picture.mixed;
      clean.back().emplace_back(planes[0][p], planes[1][p], planes[2][p]);
    }
    clean_errors.push_back(made->picture.interval(core::DenoiseMode::kMixed, 0.95));
  }
  const std::string file = scene.substr(0, scene.find(','));
  std::printf("%-28s %-10s %-5s %4d", file.substr(file.rfind('/') + 1).c_str(),
              scene.substr(scene.rfind('/') + 1, 9).c_str(), std::string(integrator).c_str(),
              samples);
  kinds.plain.add(plain_errors, test_support::errors_of(films));
  kinds.calm.add(plain_errors, test_support::errors_of(films, calm));
  kinds.denoised.add(clean_errors, test_support::errors_of(films, clean));
  std::printf("\n");
  std::fflush(stdout);
}

int measure_assets(const Plan& plan) {
  const auto folder = test_support::assets_folder();
  if (!folder) {
    std::printf("no folder of assets; TESSERA_ASSETS names it\n");
    return 1;
  }
  const std::string path = folder->string() + "/";
  Kinds kinds;
  std::printf("per cent covered (estimate over error): plain, without fireflies, denoised\n");
  for (const char* name :
       {"WaterBottle", "SunglassesKhronos", "2CylinderEngine", "blenderio_15_transmission",
        "gen_material_matrix", "Fox", "AnisotropyDiscTest", "DispersionTest", "blenderio_19_sheen",
        "blenderio_14_emission_strength"}) {
    for (const char* map : {"chinese_garden_1k", "qwantani_afternoon_puresky_1k"}) {
      const std::string scene = path + name + ".glb," + path + "env/" + map + ".hdr";
      for (const int samples : {16, 64}) {
        measure_asset(scene, "path", samples, plan, kinds);
      }
      measure_asset(scene, "bdpt", 16, plan, kinds);
      measure_asset(scene, "mlt", 16, plan, kinds);
    }
  }
  kinds.plain.print("plain");
  kinds.calm.print("set aside");
  kinds.denoised.print("denoised");
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  Plan plan;
  plan.renders = argc > 1 ? std::atoi(argv[1]) : plan.renders;
  plan.width = argc > 2 ? std::atoi(argv[2]) : plan.width;
  plan.threads = argc > 3 ? std::atoi(argv[3]) : plan.threads;
  const std::string only = argc > 4 ? argv[4] : "";        // one scene instead of all
  const std::string integrator = argc > 5 ? argv[5] : "";  // of that scene
  if (only == "assets") {
    return measure_assets(plan);
  }
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
    if (!only.empty() && only != scene) {
      continue;
    }
    const core::View view = bench::builtin_view(scene, plan.width);
    for (const int samples : {16, 64}) {
      measure(std::string(scene), view, samples, plan);
    }
    if (!only.empty()) {
      return 0;
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
