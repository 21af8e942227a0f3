// What denoising is worth, and whether its errors are true: for each scene the true error of the
// plain picture and of every denoiser's, full and mixed, at 4 to 256 samples with the denoiser's
// seconds; and how often the intervals hold the truth, at 32 and 128 samples. The truth comes from
// a reference of many samples, whose own error is taken out by its halves. Prints, never asserts.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/oidn.h"
#include "core/denoise/oidn_helper.h"
#include "core/denoise/statistical.h"
#include "core/render/feature_pass.h"
#include "core/scene_io/builtin_scenes.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

constexpr int kReferenceFactor = 32;  ///< samples of the reference over the most of the table
constexpr int kMostSamples = 256;

struct Plan {
  int seeds = 20;
  int width = 96;
  int threads = 2;
};

core::View view_of(std::string_view name, int width) {
  const core::BuiltinScene* builtin = core::find_builtin_scene(name);
  CHECK(builtin != nullptr);
  auto description = core::load_gltf(builtin->make_glb(), {}, {});
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view;
  view.scene = *scene;
  view.settings.film.width = width;
  view.settings.film.height = width * 9 / 16;
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = false;
  const core::SceneSummary& facts = (*scene)->summary();
  if (facts.lights.empty() && !facts.has_emissive_strength) {
    view.environment = test_support::constant_sky(core::Rgb(1));
  }
  return view;
}

/// (X - RA) (X - RB), the halves of the reference being independent, and what it is divided by.
std::vector<test_support::PixelTruth> truth_of(const core::ColorPlanes& seen,
                                               const core::FilmSnapshot& reference) {
  std::vector<test_support::PixelTruth> out(reference.pixel_count());
  for (std::size_t p = 0; p < out.size(); ++p) {
    const core::Rgb x = {seen[0][p], seen[1][p], seen[2][p]};
    const core::Rgb a = core::half_value(reference, p, 0).mean;
    const core::Rgb b = core::half_value(reference, p, 1).mean;
    const core::HalfValue mean = core::pixel_value(reference, p);
    out[p] = {(x - a) * (x - b), a * b, static_cast<double>(luminance(mean.mean)), mean.alpha > 0};
  }
  return out;
}

double true_error(const core::ColorPlanes& seen, const core::FilmSnapshot& reference) {
  return test_support::defined_error(truth_of(seen, reference), reference.rect.width,
                                     reference.rect.height);
}

core::ColorPlanes plain_planes(const core::FilmSnapshot& film) {
  core::ColorPlanes out;
  for (core::Plane& plane : out) {
    plane.resize(film.pixel_count());
  }
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    const core::Rgb v = core::pixel_value(film, p).mean;
    out[0][p] = v.r;
    out[1][p] = v.g;
    out[2][p] = v.b;
  }
  return out;
}

core::FilmSnapshot render(core::View view, int samples, std::uint64_t seed, int threads) {
  view.settings.seed = seed;
  return test_support::render(view, samples, threads).snapshot;
}

struct Scene {
  std::string name;
  core::View view;
  core::FilmSnapshot reference;
  core::FeaturePicture features;
};

Scene prepare(std::string_view name, const Plan& plan) {
  Scene out;
  out.name = name;
  out.view = view_of(name, plan.width);
  out.reference =
      render(out.view, kMostSamples * kReferenceFactor, std::uint64_t{1} << 40U, plan.threads);
  auto features = core::feature_pass(out.view, core::parallel_for(plan.threads));
  CHECK(features && *features);
  out.features = std::move(**features);
  return out;
}

void print_table(const Scene& scene, const core::Denoiser& denoiser, const Plan& plan) {
  for (const int samples : {4, 16, 64, kMostSamples}) {
    const core::FilmSnapshot film = render(scene.view, samples, 1, plan.threads);
    const auto begin = std::chrono::steady_clock::now();
    const auto picture =
        core::denoise(film, &scene.features, denoiser, core::parallel_for(plan.threads));
    const double seconds =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    CHECK(picture);
    const core::ErrorInterval full = picture->interval(core::DenoiseMode::kFull, 0.95);
    const core::ErrorInterval mixed = picture->interval(core::DenoiseMode::kMixed, 0.95);
    std::printf("%-12s %-12s %5d  %7.4f  %7.4f [%.4f %.4f]  %7.4f [%.4f %.4f]  %6.2f\n",
                scene.name.c_str(), std::string(denoiser.name()).c_str(), samples,
                true_error(plain_planes(film), scene.reference),
                true_error(picture->full, scene.reference), full.low, full.high,
                true_error(picture->mixed, scene.reference), mixed.low, mixed.high, seconds);
    std::fflush(stdout);
  }
}

/// Of one mode over the seeds.
struct Coverage {
  double covered = 0;
  double estimate = 0;  ///< of the square
  double truth = 0;
  double plain = 0;
  double median = 0;
};

void print_coverage(const Scene& scene, const core::Denoiser& denoiser, int samples,
                    const Plan& plan) {
  std::vector<core::DenoisedPicture> pictures;
  double plain = 0;
  for (int i = 0; i < plan.seeds; ++i) {
    const core::FilmSnapshot film =
        render(scene.view, samples, static_cast<std::uint64_t>(i) + 1, plan.threads);
    auto picture = core::denoise(film, &scene.features, denoiser, core::parallel_for(plan.threads));
    CHECK(picture);
    pictures.push_back(*std::move(picture));
    const double error = true_error(plain_planes(film), scene.reference);
    plain += error * error / plan.seeds;
  }
  for (const core::DenoiseMode mode : {core::DenoiseMode::kFull, core::DenoiseMode::kMixed}) {
    double truth = 0;
    double estimate = 0;
    for (const core::DenoisedPicture& picture : pictures) {
      const double error = true_error(picture.planes(mode), scene.reference);
      truth += error * error / plan.seeds;
      const double value = picture.interval(mode, 0.95).relative_rmse;
      estimate += value * value / plan.seeds;
    }
    double inside = 0;
    double width = 0;
    for (const core::DenoisedPicture& picture : pictures) {
      const core::ErrorInterval e = picture.interval(mode, 0.95);
      inside += e.low <= std::sqrt(truth) && std::sqrt(truth) <= e.high ? 100.0 / plan.seeds : 0;
      width += (e.high - e.low) / std::sqrt(truth) / plan.seeds;
    }
    std::printf(
        "%-12s %-12s %-5s %5d  plain %.4f  true %.4f  estimate %+5.1f %%  covered %5.1f %%"
        "  width %.2f\n",
        scene.name.c_str(), std::string(denoiser.name()).c_str(),
        mode == core::DenoiseMode::kFull ? "full" : "mixed", samples, std::sqrt(plain),
        std::sqrt(truth), 100 * (std::sqrt(estimate / truth) - 1), inside, width);
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::string(argv[1]) == "denoise") {  // the helper process
    return core::serve_oidn(0, argv[2]) ? 0 : 1;
  }
  Plan plan;
  plan.seeds = argc > 1 ? std::atoi(argv[1]) : plan.seeds;
  plan.width = argc > 2 ? std::atoi(argv[2]) : plan.width;
  plan.threads = argc > 3 ? std::atoi(argv[3]) : plan.threads;
  const std::string only = argc > 4 ? argv[4] : "";  // scene instead of all
  std::vector<std::unique_ptr<core::Denoiser>> denoisers;
  denoisers.push_back(std::make_unique<core::StatisticalDenoiser>());
  if (const std::string folder = core::find_oidn(); !folder.empty()) {
    denoisers.push_back(std::make_unique<core::OidnDenoiser>(core::OidnOptions{.folder = folder}));
  }
  std::printf(
      "%-12s %-12s   spp    plain     full  95 %% interval    mixed  95 %% interval  seconds\n",
      "scene", "denoiser");
  for (const core::BuiltinScene& builtin : core::builtin_scenes()) {
    if (!only.empty() && only != builtin.name) {
      continue;
    }
    const Scene scene = prepare(builtin.name, plan);
    for (const auto& denoiser : denoisers) {
      print_table(scene, *denoiser, plan);
      for (const int samples : {32, 128}) {
        if (plan.seeds > 0) {
          print_coverage(scene, *denoiser, samples, plan);
        }
      }
    }
  }
  return 0;
}
