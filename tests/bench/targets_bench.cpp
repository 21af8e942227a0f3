// Jobs that end by an error target, 100 seeds each on the built-in scenes: how often the true error, against a reference
// of many samples, is at most the target, and its median over the target. Prints, never asserts.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/base/check.h"
#include "core/film/error_estimate.h"
#include "core/render/light_edges.h"
#include "core/render/render_task.h"
#include "core/render/registry.h"
#include "core/scene_io/builtin_scenes.h"
#include "tests/support/scenes.h"

namespace {

constexpr double kConfidence = 0.95;
constexpr int kReferenceSamples = 4096;  // what it is off by is taken off
constexpr float kFewMeetings = 16;
constexpr int kRareSamples = 65536;

core::View view_of(const core::BuiltinScene& builtin, int width) {
  auto description = core::load_gltf(builtin.make_glb(), {}, {});
  CHECK(description);
  auto scene = core::Scene::build(std::move(*description), 2);
  CHECK(scene);
  core::View view;
  view.scene = *scene;
  view.settings.film.width = width;
  view.settings.film.height = width * 9 / 16;
  const core::SceneSummary& facts = (*scene)->summary();
  if (facts.lights.empty() && !facts.has_emissive_strength) {
    view.environment = test_support::constant_sky(core::Rgb(1));
  }
  return view;
}

/// Two independent estimates of each pixel's expected value; half of their sum is the reference.
using Reference = std::vector<std::array<core::Rgb, 2>>;

/// Of many samples, and of very many where few of them matter: at the rims of lights, which a sample in thousands meets, and where the picture
/// itself is in doubt. A reference that has not met such a rim would call a picture wrong that has.
Reference reference_of(core::View view, int threads) {
  view.settings.seed = 999;
  view.settings.adaptive.type = core::AdaptiveType::kNone;
  const auto film = test_support::render(view, kReferenceSamples, threads).snapshot;
  Reference out;
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    out.push_back({core::half_value(film, p, 0).mean, core::half_value(film, p, 1).mean});
  }
  auto renderer = core::Renderer::create(view);
  CHECK(renderer);
  const core::LightEdges edges = (*renderer)->light_edge_search()->finish({});
  std::vector<std::uint32_t> rare = core::ErrorEstimate(film, edges).doubtful();
  for (const core::LightEdge& edge : edges) {
    if (std::min(edge.coverage, 1 - edge.coverage) * kReferenceSamples < kFewMeetings) {
      rare.push_back(edge.pixel);
    }
  }
  for (const core::ProbedPixel& probe : (*renderer)->probe(rare, kRareSamples, {})) {
    out[probe.pixel] = probe.means;
  }
  return out;
}

/// Relative RMSE against the reference, less what that is off by itself.
double true_error(const core::FilmSnapshot& seen, const Reference& reference) {
  double sum = 0;
  for (std::size_t p = 0; p < reference.size(); ++p) {
    const core::Rgb truth = (reference[p][0] + reference[p][1]) * 0.5F;
    const core::Rgb value = core::pixel_value(seen, p).mean;
    const core::Rgb d = reference[p][0] - reference[p][1];
    for (int c = 0; c < 3; ++c) {
      const auto off = static_cast<double>(value[c] - truth[c]);
      const auto mu = static_cast<double>(truth[c]);
      sum += (off * off - static_cast<double>(d[c] * d[c]) / 4) / (mu * mu + 0.01);
    }
  }
  return std::sqrt(std::max(sum, 0.0) / (3.0 * static_cast<double>(reference.size())));
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 100;
  const int width = argc > 2 ? std::atoi(argv[2]) : 96;
  const int threads = argc > 3 ? std::atoi(argv[3]) : 2;
  // Targets, as shares of the error at 64 samples, and the scene: one instead of all.
  const std::vector<double> shares = argc > 4 ? std::vector<double>{std::atof(argv[4])} : std::vector<double>{1.6, 0.6};
  const std::string only = argc > 5 ? argv[5] : "";
  const std::array<std::pair<const char*, core::AdaptiveType>, 2> kinds = {
      {{"none", core::AdaptiveType::kNone}, {"pilot", core::AdaptiveType::kPilot}}};
  std::printf("error targets, confidence %.2f, %d seeds, %d pixels wide: met; true error over target: median, 95th percentile, most; samples\n",
              kConfidence, seeds, width);
  for (const core::BuiltinScene& builtin : core::builtin_scenes()) {
    if (!only.empty() && builtin.name != only) {
      continue;
    }
    core::View view = view_of(builtin, width);
    view.settings.seed = 999;
    const auto probe = test_support::render(view, 64, threads);
    const double at_64 = probe.progress.error.relative_rmse;
    if (!(at_64 > 0)) {
      std::printf("%-12s no noise\n", std::string(builtin.name).c_str());
      continue;
    }
    const Reference reference = reference_of(view, threads);
    for (const double share : shares) {
      for (const auto& [name, type] : kinds) {
        view.settings.adaptive.type = type;
        core::StopRules stop;
        stop.relative_error = at_64 * share;
        stop.confidence = kConfidence;
        std::vector<double> ratios;
        double samples = 0;
        for (int i = 0; i < seeds; ++i) {
          view.settings.seed = static_cast<std::uint64_t>(i) + 1;
          const auto picture = test_support::render(view, stop, threads);
          ratios.push_back(true_error(picture.snapshot, reference) / *stop.relative_error);
          samples += picture.progress.samples_mean / seeds;
        }
        std::sort(ratios.begin(), ratios.end());
        const auto met = std::upper_bound(ratios.begin(), ratios.end(), 1.0) - ratios.begin();
        std::printf("%-12s target %.4f  %-5s  met %5.1f %%  median %.2f  p95 %.2f  most %.2f  samples %.0f\n",
                    std::string(builtin.name).c_str(), *stop.relative_error, name,
                    100.0 * static_cast<double>(met) / static_cast<double>(ratios.size()), ratios[ratios.size() / 2],
                    ratios[ratios.size() * 95 / 100], ratios.back(), samples);
        std::fflush(stdout);
      }
    }
    view.settings.adaptive.type = core::AdaptiveType::kNone;
  }
  return 0;
}
