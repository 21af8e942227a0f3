#include "tests/bench/coverage_assets.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/check.h"
#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "core/error/error_estimate.h"
#include "core/film/set_aside.h"
#include "core/integrators/registry.h"
#include "core/render/picture/feature_pass.h"
#include "tests/support/errors.h"
#include "tests/support/scenes.h"

namespace bench {
namespace {

/// Groups with fewer images that are not marked are not judged by these alone.
constexpr double kLeastUnmarked = 5;

/// Intervals of one kind of image over all groups.
class Totals {
 public:
  explicit Totals(const char* name) : name_(name) {}

  /// Prints the group: per cent covered, of all and of those that are not marked; the median of
  /// estimate over error; the mean width of the intervals over the error.
  void add(const std::string& group, const std::vector<core::ErrorInterval>& seen,
           const std::vector<double>& errors) {
    if (seen.empty()) {
      std::printf("                        -");
      return;
    }
    double covered = 0;
    double unmarked = 0;
    double unmarked_covered = 0;
    double width = 0;
    std::vector<double> ratios;
    for (std::size_t i = 0; i < seen.size(); ++i) {
      const bool is_covered = seen[i].low <= errors[i] && errors[i] <= seen[i].high;
      covered += is_covered ? 1 : 0;
      unmarked += seen[i].unreliable ? 0 : 1;
      unmarked_covered += is_covered && !seen[i].unreliable ? 1 : 0;
      width += (seen[i].high - seen[i].low) / errors[i];
      ratios.push_back(seen[i].relative / errors[i]);
    }
    const auto images = static_cast<double>(seen.size());
    all_.add(group, images, covered);
    unmarked_.add(group, unmarked, unmarked_covered);
    widths_ += width;
    std::sort(ratios.begin(), ratios.end());
    ratios_.insert(ratios_.end(), ratios.begin(), ratios.end());
    const std::string among_unmarked =
        unmarked > 0 ? std::to_string(std::lround(100 * unmarked_covered / unmarked)) : "-";
    std::printf("  %5.1f %4s %5.2f %5.2f", 100 * covered / images, among_unmarked.c_str(),
                ratios[ratios.size() / 2], width / images);
  }

  void print() {
    std::sort(ratios_.begin(), ratios_.end());
    std::printf(
        "%-10s estimate over error %.2f in the median (10%%: %.2f, 90%%: %.2f); intervals are %.2f "
        "errors wide in the mean\n",
        name_, share_of_ratios(0.5), share_of_ratios(0.1), share_of_ratios(0.9),
        widths_ / std::max(all_.count, 1.0));
    all_.print("all");
    unmarked_.print("not marked unreliable");
  }

 private:
  struct Images {
    double count = 0;
    double covered = 0;
    double least = 2;
    std::string worst = "-";

    void add(const std::string& group, double images, double inside) {
      count += images;
      covered += inside;
      if (images >= kLeastUnmarked && inside / images < least) {
        least = inside / images;
        worst = group;
      }
    }
    void print(const char* which) const {
      std::printf("           %s: %.0f images, covered %.1f %%, worst group %.1f %% (%s)\n", which,
                  count, 100 * covered / std::max(count, 1.0), 100 * std::min(least, 1.0),
                  worst.c_str());
    }
  };
  double share_of_ratios(double share) const {
    return ratios_.empty()
               ? 0.0
               : ratios_[static_cast<std::size_t>(share * static_cast<double>(ratios_.size() - 1))];
  }

  const char* name_;
  Images all_;
  Images unmarked_;
  std::vector<double> ratios_;
  double widths_ = 0;
};

struct Kinds {
  Totals plain{"plain"};
  Totals calm{"set aside"};
  Totals mixed{"mixed"};
  Totals full{"full"};
  void print() {
    plain.print();
    calm.print();
    mixed.print();
    full.print();
  }
};

std::vector<core::Rgb> image_of(const core::ColorPlanes& planes) {
  std::vector<core::Rgb> image;
  for (std::size_t p = 0; p < planes[0].size(); ++p) {
    image.emplace_back(planes[0][p], planes[1][p], planes[2][p]);
  }
  return image;
}

void measure(const AssetGroup& of, core::View view, const core::FeaturePicture& features,
             int samples, const AssetPlan& plan, Kinds& kinds) {
  if (!core::check_rules(view)) {
    return;  // it does not support the scene's media
  }
  std::vector<core::ErrorInterval> seen;
  std::array<std::vector<core::ErrorInterval>, 2> seen_clean;  // by DenoiseMode
  std::vector<double> plain;
  std::vector<double> calm;
  std::array<std::vector<double>, 2> clean;
  for (int i = 0; i < plan.renders; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    const test_support::Picture picture = test_support::render(view, samples, plan.threads);
    const core::FilmSnapshot& film = picture.snapshot;
    seen.push_back(picture.progress.error);
    plain.push_back(test_support::defined_error(film, of.truth));
    core::FilmSnapshot without = film;
    core::set_aside(without, without.rect);
    calm.push_back(test_support::defined_error(without, of.truth));
    if (!core::halves_show_error(view.settings)) {
      continue;  // the errors of its denoised images are unknown
    }
    const auto made = core::denoise(film, &features, core::StatisticalDenoiser(),
                                    core::parallel_for(plan.threads));
    CHECK(made);
    for (const auto mode : {core::DenoiseMode::kFull, core::DenoiseMode::kMixed}) {
      const auto m = static_cast<std::size_t>(mode);
      clean[m].push_back(
          test_support::defined_error(image_of(made->picture.planes(mode)), of.truth));
      seen_clean[m].push_back(made->picture.interval(mode, 0.95));
    }
  }
  const std::string group =
      of.name + ", " + view.settings.integrator + ", " + std::to_string(samples) + " samples";
  std::printf("%-72s", group.c_str());
  kinds.plain.add(group, seen, plain);
  kinds.calm.add(group, seen, calm);
  kinds.mixed.add(group, seen_clean[1], clean[1]);
  kinds.full.add(group, seen_clean[0], clean[0]);
  std::printf("\n");
  std::fflush(stdout);
}

}  // namespace

bool measure_asset_coverage(const AssetPlan& plan, const std::string& folder) {
  std::printf(
      "%d images a group, %d pixels wide; per cent covered, the same of images that are not marked "
      "unreliable, estimate over error (median), width over error (mean): plain, without "
      "fireflies, mixed, full\n",
      plan.renders, plan.width);
  Kinds kinds;
  const bool is_there = for_asset_groups(plan, folder, [&](const AssetGroup& group) {
    const auto features = core::feature_pass(group.view, core::parallel_for(plan.threads));
    CHECK(features && *features);
    for (const std::string_view integrator : {"path", "bdpt", "mlt", "sppm"}) {
      if (!plan.by.empty() && plan.by != integrator) {
        continue;
      }
      const core::View view = view_by(group.view, integrator);
      measure(group, view, **features, 16, plan, kinds);
      if (!plan.is_short || integrator == "path") {
        measure(group, view, **features, 64, plan, kinds);
      }
    }
  });
  if (is_there) {
    kinds.print();
  }
  return is_there;
}

}  // namespace bench
