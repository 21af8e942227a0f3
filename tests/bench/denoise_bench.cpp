// Measures the gain of denoising and the quality of its error estimates, for six scenes and each
// denoiser: the true error of the plain, the denoised and the mixed image at 4 to 256 samples, with
// seconds and the gain at equal time; the time until 5% is reached; and the coverage of the
// intervals over a given number of seeds. The truth is a reference with many samples, whose own
// error is removed by means of its halves. Prints, never asserts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <string>
#include <vector>

#include <sys/resource.h>

#include "core/base/check.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/oidn.h"
#include "core/denoise/oidn_helper.h"
#include "core/denoise/statistical.h"
#include "core/image_io/image_codec.h"
#include "core/render/picture/feature_pass.h"
#include "tests/bench/asset_groups.h"
#include "tests/bench/bench_views.h"
#include "tests/support/asset_files.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

constexpr std::array kCounts = {4, 16, 64, 256};
constexpr double kTarget = 0.05;

struct Plan {
  int seeds = 20;
  int width = 96;
  int threads = 2;
  int reference = 8192;  ///< samples
  std::string folder;    ///< folder of the references, ends with a slash
};

/// Totals over all printed cells.
struct Pooled {
  double cells = 0;
  double covered = 0;
  double least = 100;
  double off = 0;   ///< sum of estimate / truth - 1 over the cells, in percent
  double size = 0;  ///< sum of its absolute values
};

core::View asset_view(const Plan& plan) {
  const std::filesystem::path folder = *test_support::assets_folder();
  auto description = test_support::load_asset(folder / "Fox.glb");
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view;
  view.scene = *scene;
  view.environment = test_support::load_sky(folder / "env" / "venice_sunset_256.hdr");
  view.settings.film.width = plan.width;
  view.settings.film.height = plan.width * 9 / 16;
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = false;
  return view;
}

double true_error(const core::ColorPlanes& seen, const test_support::Truth& reference) {
  std::vector<core::Rgb> image;
  for (std::size_t p = 0; p < reference.mu.size(); ++p) {
    image.emplace_back(seen[0][p], seen[1][p], seen[2][p]);
  }
  return test_support::defined_error(image, reference);
}

core::ColorPlanes plain_planes(const core::FilmSnapshot& film) {
  core::ColorPlanes out;
  out.fill(core::Plane(film.pixel_count()));
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    const core::Rgb v = core::pixel_value(film, p).mean;
    out[0][p] = v.r;
    out[1][p] = v.g;
    out[2][p] = v.b;
  }
  return out;
}

test_support::Picture render(core::View view, int samples, int seed, int threads) {
  view.settings.seed = static_cast<std::uint64_t>(seed);
  return test_support::render(view, samples, threads);
}

struct Scene {
  std::string name;
  core::View view;
  test_support::Truth reference;
  core::FeaturePicture features;
  double feature_seconds = 0;  ///< CPU
};

/// Returns the CPU seconds of this program and of the helpers that it waited for.
double cpu_seconds() {
  double out = 0;
  for (const int whose : {RUSAGE_SELF, RUSAGE_CHILDREN}) {
    rusage used{};
    CHECK(getrusage(whose, &used) == 0);
    for (const timeval& time : {used.ru_utime, used.ru_stime}) {
      out += static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
    }
  }
  return out;
}

Scene prepare(std::string name, core::View view, const Plan& plan) {
  Scene out;
  out.name = std::move(name);
  out.view = std::move(view);
  out.reference = bench::kept_truth(plan.folder, out.name, out.view, plan.reference, plan.threads);
  const double begin = cpu_seconds();
  auto features = core::feature_pass(out.view, core::parallel_for(plan.threads));
  CHECK(features && *features);
  out.features = std::move(**features);
  out.feature_seconds = cpu_seconds() - begin;
  return out;
}

struct Named {
  std::string type;
  std::unique_ptr<core::Denoiser> denoiser;
};
using Denoisers = std::vector<Named>;

/// Seconds and error of an image.
using Spent = std::pair<double, double>;

/// Returns, as text, the seconds at which the error reaches the target, if it falls as a power
/// between the sample counts.
std::string seconds_to_target(const std::vector<Spent>& spent) {
  const auto text = [](double seconds) {
    std::array<char, 32> out{};
    std::snprintf(out.data(), out.size(), "%.2f", seconds);
    return std::string(out.data());
  };
  for (std::size_t i = 0; i < spent.size(); ++i) {
    const auto [seconds, error] = spent[i];
    if (error > kTarget) {
      continue;
    }
    if (i == 0) {
      return "at most " + text(seconds);
    }
    const auto [before, worse] = spent[i - 1];
    const double share = std::log(kTarget / worse) / std::log(error / worse);
    return text(before * std::pow(seconds / before, share));
  }
  return "not reached in " + text(spent.back().first);
}

void print_header(const Denoisers& denoisers) {
  std::printf("| scene | samples | render s | plain |");
  std::string rule = "| --- | ---: | ---: | ---: |";
  for (const Named& denoiser : denoisers) {
    std::printf(" %s s | full | mixed | gain |", denoiser.type.c_str());
    rule += " ---: | ---: | ---: | ---: |";
  }
  std::printf("\n%s\n", rule.c_str());
}

/// Prints the rows of a scene. Returns a row with the times at which the plain image and the mixed
/// image of each denoiser reach the target.
std::string print_rows(const Scene& scene, const Denoisers& denoisers, const Plan& plan) {
  std::vector<Spent> plain;
  std::vector<std::vector<Spent>> mixed(denoisers.size());
  for (const int samples : kCounts) {
    const double start = cpu_seconds();
    const test_support::Picture picture = render(scene.view, samples, 1, plan.threads);
    const double seconds = cpu_seconds() - start;
    const double error = true_error(plain_planes(picture.snapshot), scene.reference);
    plain.emplace_back(seconds, error);
    std::printf("| %s | %d | %.2f | %.4f |", scene.name.c_str(), samples, seconds, error);
    for (std::size_t d = 0; d < denoisers.size(); ++d) {
      const double begin = cpu_seconds();
      const auto made = core::denoise(picture.snapshot, &scene.features, *denoisers[d].denoiser,
                                      core::parallel_for(plan.threads));
      const double more = cpu_seconds() - begin + scene.feature_seconds;
      CHECK(made);
      mixed[d].emplace_back(seconds + more, true_error(made->picture.mixed, scene.reference));
      // In the denoiser's time the plain image would have received more samples.
      const double gain = std::pow(error / mixed[d].back().second, 2) * seconds / (seconds + more);
      std::printf(" %.2f | %.4f | %.4f | %.2f |", more,
                  true_error(made->picture.full, scene.reference), mixed[d].back().second, gain);
    }
    std::printf("\n");
  }
  std::fflush(stdout);
  std::string row = "| " + scene.name + " | " + seconds_to_target(plain) + " |";
  for (const auto& of_denoiser : mixed) {
    row += " " + seconds_to_target(of_denoiser) + " |";
  }
  return row;
}

void print_targets(const Denoisers& denoisers, const std::vector<std::string>& rows) {
  std::printf("\n| seconds to %.0f %% | plain |", 100 * kTarget);
  std::string rule = "| --- | ---: |";
  for (const Named& denoiser : denoisers) {
    std::printf(" mixed, %s |", denoiser.type.c_str());
    rule += " ---: |";
  }
  std::printf("\n%s\n", rule.c_str());
  for (const std::string& row : rows) {
    std::printf("%s\n", row.c_str());
  }
  std::fflush(stdout);
}

/// One cell of the coverage table.
void print_cell(const Scene& scene, const std::vector<core::MadeDenoised>& made,
                core::DenoiseMode mode, int samples, Pooled& pooled) {
  const auto seeds = static_cast<double>(made.size());
  double truth = 0;
  double estimate = 0;
  double inside = 0;
  double width = 0;
  for (const core::MadeDenoised& m : made) {
    const double error = true_error(m.picture.planes(mode), scene.reference);
    const core::ErrorInterval e = m.picture.interval(mode, 0.95);
    truth += error / seeds;
    estimate += e.relative / seeds;
    inside += e.low <= error && error <= e.high ? 100 / seeds : 0;
    width += (e.high - e.low) / seeds;
  }
  width /= truth;
  const double off = estimate / truth - 1;
  std::printf("%-12s %-12s %-5s %5d  true %.4f  estimate %+5.1f %%  covered %5.1f %%  width %.2f\n",
              scene.name.c_str(), made[0].by.type.c_str(),
              mode == core::DenoiseMode::kFull ? "full" : "mixed", samples, truth, 100 * off,
              inside, width);
  pooled.cells += 1;
  pooled.covered += inside;
  pooled.least = std::min(pooled.least, inside);
  pooled.off += 100 * off;
  pooled.size += std::fabs(100 * off);
}

void print_coverage(const Scene& scene, const Denoisers& denoisers, int samples, const Plan& plan,
                    Pooled& pooled) {
  std::vector<std::vector<core::MadeDenoised>> made(denoisers.size());
  std::vector<std::vector<double>> ratios(
      denoisers.size());  // mixed over the better of plain and full
  for (int seed = 1; seed <= plan.seeds; ++seed) {
    const core::FilmSnapshot film = render(scene.view, samples, seed, plan.threads).snapshot;
    const double plain = true_error(plain_planes(film), scene.reference);
    for (std::size_t d = 0; d < denoisers.size(); ++d) {
      auto one = core::denoise(film, &scene.features, *denoisers[d].denoiser,
                               core::parallel_for(plan.threads));
      CHECK(one);
      made[d].push_back(*std::move(one));
      const core::DenoisedPicture& picture = made[d].back().picture;
      ratios[d].push_back(true_error(picture.mixed, scene.reference) /
                          std::min(plain, true_error(picture.full, scene.reference)));
    }
  }
  for (std::size_t d = 0; d < denoisers.size(); ++d) {
    print_cell(scene, made[d], core::DenoiseMode::kFull, samples, pooled);
    print_cell(scene, made[d], core::DenoiseMode::kMixed, samples, pooled);
    const auto middle = ratios[d].begin() + static_cast<std::ptrdiff_t>(ratios[d].size() / 2);
    std::nth_element(ratios[d].begin(), middle, ratios[d].end());
    std::printf("%-12s %-12s mixed %5d  over the better of plain and full, median: %.2f\n",
                scene.name.c_str(), denoisers[d].type.c_str(), samples, *middle);
  }
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::string(argv[1]) == "denoise") {  // the helper process
    return core::serve_oidn(0, argv[2]) ? 0 : 1;
  }
  Plan plan;
  plan.folder = bench::folder_of(argv[0]);
  plan.seeds = argc > 1 ? std::atoi(argv[1]) : plan.seeds;
  plan.width = argc > 2 ? std::atoi(argv[2]) : plan.width;
  plan.threads = argc > 3 ? std::atoi(argv[3]) : plan.threads;
  plan.reference = argc > 4 ? std::atoi(argv[4]) : plan.reference;
  const std::string only = argc > 5 ? argv[5] : "";  // scene instead of all
  const std::vector<int> counts = argc > 6 ? std::vector{std::atoi(argv[6])} : std::vector{32, 128};
  // Load the image module now, before a concurrent build replaces it: built-in scenes contain
  // images.
  if (const auto codec = core::image_codec(); !codec) {
    std::fprintf(stderr, "%s\n", codec.error().message.c_str());
    return 1;
  }
  Denoisers denoisers;
  denoisers.push_back({"statistical", std::make_unique<core::StatisticalDenoiser>()});
  if (const std::string folder = core::find_oidn(); !folder.empty()) {
    denoisers.push_back(
        {"oidn", std::make_unique<core::OidnDenoiser>(core::OidnOptions{.folder = folder})});
  }
  std::vector<Scene> scenes;
  std::vector<std::string> targets;
  print_header(denoisers);
  for (const std::string name :
       {"cornell-box", "interior", "many-lights", "glass", "veach-mis", "asset"}) {
    const bool is_asset = name == "asset";
    if ((!only.empty() && only != name) || (is_asset && !test_support::assets_folder())) {
      continue;
    }
    scenes.push_back(
        prepare(name, is_asset ? asset_view(plan) : bench::builtin_view(name, plan.width), plan));
    targets.push_back(print_rows(scenes.back(), denoisers, plan));
  }
  print_targets(denoisers, targets);
  Pooled pooled;
  for (const Scene& scene : scenes) {
    for (const int samples : counts) {
      if (plan.seeds > 0) {
        print_coverage(scene, denoisers, samples, plan, pooled);
      }
    }
  }
  if (pooled.cells > 0) {
    std::printf(
        "%.0f cells: covered %.1f %%, at least %.1f %%; estimates off by %+.1f %%, %.1f %% in "
        "size\n",
        pooled.cells, pooled.covered / pooled.cells, pooled.least, pooled.off / pooled.cells,
        pooled.size / pooled.cells);
  }
  return 0;
}
