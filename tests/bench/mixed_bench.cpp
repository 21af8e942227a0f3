// The mixed image over the better one of the denoised and the plain image without fireflies, by
// error and by FLIP, and the words of the page: the error of plain images and their FLIP. Ten glTF
// files under two maps at 8, 16, 64 and 256 samples, by each denoiser; plain images also at 2
// and 4. Prints, never asserts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <numeric>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/compare/flip.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/oidn.h"
#include "core/denoise/oidn_helper.h"
#include "core/denoise/statistical.h"
#include "core/film/set_aside.h"
#include "core/layers/exposure.h"
#include "core/render/picture/feature_pass.h"
#include "tests/bench/asset_groups.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace {

using Image = std::vector<core::Rgb>;

constexpr std::array kCounts = {8, 16, 64, 256};
/// Of plain images alone: large errors.
constexpr std::array kFewSamples = {2, 4};

struct Named {
  std::string type;
  std::unique_ptr<core::Denoiser> denoiser;
};

Image image_of(const core::ColorPlanes& planes) {
  Image image;
  for (std::size_t p = 0; p < planes[0].size(); ++p) {
    image.emplace_back(planes[0][p], planes[1][p], planes[2][p]);
  }
  return image;
}

/// As shown: by the automatic exposure.
double flip_of(const Image& image, const test_support::Truth& truth, double exposure) {
  const auto gain = static_cast<float>(std::exp2(exposure));
  const auto shown = [&](const Image& linear) {
    Image out;
    for (const core::Rgb c : linear) {
      out.push_back(c * gain);
    }
    return out;
  };
  const auto map = core::flip_map(shown(image), shown(truth.mu), truth.width, truth.height);
  return std::accumulate(map.begin(), map.end(), 0.0) / static_cast<double>(map.size());
}

/// Ratios of all images of one denoiser.
struct Ratios {
  std::vector<double> by_error;
  std::vector<double> by_flip;
};

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values.empty()
             ? 0.0
             : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

/// Error and FLIP of an image.
struct Judged {
  double error = 0;
  double flip = 0;
};

double sum_of(const std::vector<Judged>& images, double Judged::*by) {
  return std::accumulate(images.begin(), images.end(), 0.0,
                         [by](double sum, const Judged& image) { return sum + image.*by; });
}

void measure(const bench::AssetGroup& group, int samples, const std::vector<Named>& denoisers,
             const core::FeaturePicture* features, const bench::AssetPlan& plan,
             std::vector<Ratios>& ratios, std::vector<Judged>& words) {
  struct Seen {
    std::vector<Judged> full;
    std::vector<Judged> mixed;
    std::vector<double> estimate;
  };
  std::vector<Seen> seen(denoisers.size());
  std::vector<Judged> plain;
  std::vector<Judged> calm;
  for (int i = 0; i < plan.renders; ++i) {
    core::View view = group.view;
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    const test_support::Picture picture = test_support::render(view, samples, plan.threads);
    const double exposure = core::brightness_of(*picture.film, view.settings.film).auto_exposure;
    const auto judge = [&](const Image& image) {
      return Judged{test_support::defined_error(image, group.truth),
                    flip_of(image, group.truth, exposure)};
    };
    plain.push_back(judge(test_support::image_of(picture.snapshot)));
    core::FilmSnapshot without = picture.snapshot;
    core::set_aside(without, without.rect);
    calm.push_back(judge(test_support::image_of(without)));
    for (std::size_t d = 0; d < denoisers.size(); ++d) {
      const auto made = core::denoise(picture.snapshot, features, *denoisers[d].denoiser,
                                      core::parallel_for(plan.threads));
      CHECK(made);
      seen[d].full.push_back(judge(image_of(made->picture.full)));
      seen[d].mixed.push_back(judge(image_of(made->picture.mixed)));
      seen[d].estimate.push_back(made->picture.interval(core::DenoiseMode::kMixed, 0.95).relative);
    }
  }
  words.insert(words.end(), plain.begin(), plain.end());
  const double n = plan.renders;
  std::printf("%-50s %3d  plain %.4f flip %.4f", group.name.c_str(), samples,
              sum_of(plain, &Judged::error) / n, sum_of(plain, &Judged::flip) / n);
  for (std::size_t d = 0; d < denoisers.size(); ++d) {
    const auto ratio = [&](double Judged::*by) {
      return sum_of(seen[d].mixed, by) / std::min(sum_of(seen[d].full, by), sum_of(calm, by));
    };
    ratios[d].by_error.push_back(ratio(&Judged::error));
    ratios[d].by_flip.push_back(ratio(&Judged::flip));
    std::printf("  %s: full %.4f mixed %.4f; over the better %.2f, flip %.2f",
                denoisers[d].type.c_str(), sum_of(seen[d].full, &Judged::error) / n,
                sum_of(seen[d].mixed, &Judged::error) / n, ratios[d].by_error.back(),
                ratios[d].by_flip.back());
  }
  std::printf("\n");
  std::fflush(stdout);
}

/// Prints quantiles of FLIP of plain images by their error.
void print_words(const std::vector<Judged>& words) {
  const std::array ends = {0.0, 0.01, 0.03, 0.1, 0.3, 1.0};
  for (std::size_t i = 0; i + 1 < ends.size(); ++i) {
    std::vector<double> flips;
    for (const Judged& image : words) {
      if (image.error >= ends[i] && image.error < ends[i + 1]) {
        flips.push_back(image.flip);
      }
    }
    std::printf("error %3.0f to %3.0f %%: %3zu images, FLIP %.3f in the median (%.3f to %.3f)\n",
                100 * ends[i], 100 * ends[i + 1], flips.size(), quantile(flips, 0.5),
                quantile(flips, 0), quantile(flips, 1));
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc > 2 && std::string(argv[1]) == "denoise") {  // the helper process
    return core::serve_oidn(0, argv[2]) ? 0 : 1;
  }
  std::vector<std::string> words(argv + 1, argv + argc);
  bench::AssetPlan plan;
  plan.is_short = std::erase(words, "--short") > 0;
  const auto number = [&](std::size_t i, int fallback) {
    return i < words.size() ? std::atoi(words[i].c_str()) : fallback;
  };
  plan.renders = number(0, plan.is_short ? 1 : 3);
  plan.width = number(1, 96);
  plan.threads = number(2, 2);
  std::vector<Named> denoisers;
  denoisers.push_back({"statistical", std::make_unique<core::StatisticalDenoiser>()});
  if (const std::string folder = core::find_oidn(); !folder.empty()) {
    denoisers.push_back(
        {"oidn", std::make_unique<core::OidnDenoiser>(core::OidnOptions{.folder = folder})});
  }
  std::vector<Ratios> ratios(denoisers.size());
  std::vector<Judged> plain;
  const bool is_there =
      bench::for_asset_groups(plan, bench::folder_of(argv[0]), [&](const bench::AssetGroup& group) {
        const auto features = core::feature_pass(group.view, core::parallel_for(plan.threads));
        CHECK(features);
        for (const int samples : kFewSamples) {
          measure(group, samples, {}, nullptr, plan, ratios, plain);
        }
        for (const int samples : kCounts) {
          measure(group, samples, denoisers, *features ? &**features : nullptr, plan, ratios,
                  plain);
        }
      });
  if (!is_there) {
    return 0;
  }
  for (std::size_t d = 0; d < denoisers.size(); ++d) {
    for (const auto& [name, of] :
         {std::pair{"error", &ratios[d].by_error}, std::pair{"FLIP", &ratios[d].by_flip}}) {
      std::printf(
          "mixed by %s over the better of full and plain, by %s: %.2f in the median, %.2f (90 %%), "
          "%.2f at most\n",
          denoisers[d].type.c_str(), name, quantile(*of, 0.5), quantile(*of, 0.9),
          quantile(*of, 1));
    }
  }
  print_words(plain);
  return 0;
}
