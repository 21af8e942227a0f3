#include "core/render/choose_integrator.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "core/render/render_task.h"
#include "core/samplers/streams.h"
#include "core/scene/scene_data.h"
#include "core/settings/registry.h"

namespace core {
namespace {

/// Pixels of a pilot: enough to compare tiles, and few compared with an image.
constexpr double kPixels = 64.0 * 64.0;
constexpr int kSamples = 16;
/// Required advantage of bdpt: the variances of pilots are only this accurate, and path offers
/// adaptive sampling and intervals of denoised images, which the correlated pixels of bdpt do not
/// allow.
constexpr double kAdvantage = 1.5;

struct Candidate {
  std::string_view integrator;
  double ray_weight;  ///< CPU seconds per ray, including shading, relative to path's
};
/// A ray of bdpt took 1.5 to 3.4 times the CPU time of a ray of path in cornell-box, interior,
/// glass, keyhole and caustic-pool; the geometric mean is 2.4.
constexpr std::array<Candidate, 2> kCandidates = {{{"path", 1.0}, {"bdpt", 2.4}}};

class NullSink final : public RenderSink {
  void on_tile(int, std::uint32_t) override {}
  void on_pass(const ConvergencePoint&) override {}
  void on_finished(StopReason) override {}
};

View pilot_view(const View& view, std::string_view integrator) {
  View small = view;
  RenderSettings settings = default_settings(integrator);
  settings.film = view.settings.film;
  settings.film.crop.reset();
  settings.film.shares.clear();
  settings.film.albedo = settings.film.normal = settings.film.depth = false;
  const double factor =
      std::min(1.0, std::sqrt(kPixels / settings.film.width / settings.film.height));
  const auto scaled = [factor](int side) {
    return std::max(1, static_cast<int>(std::lround(side * factor)));
  };
  settings.film.width = scaled(settings.film.width);
  settings.film.height = scaled(settings.film.height);
  settings.max_depth = view.settings.max_depth;
  settings.sampler = view.settings.sampler;
  settings.seed = kChoiceStream;
  small.settings = std::move(settings);
  return small;
}

/// Renders a pilot on this thread.
Result<std::shared_ptr<Film>> render_pilot(const View& view) {
  auto renderer = Renderer::create(view);
  if (!renderer) {
    return renderer.error();
  }
  auto film = std::make_shared<Film>(view.settings);
  TaskOptions options;
  options.stop.samples_per_pixel = rounded_samples(view.settings, kSamples);
  NullSink sink;
  RenderTask task(*std::move(renderer), film, std::move(options), sink);
  while (!task.finished()) {
    if (const auto slice = task.take()) {
      task.run(*slice);
    }
  }
  return film;
}

struct PairSums {
  std::array<double, 2> noise{};
  std::array<double, 2> light{};
  double apart = 0;                ///< squared differences
  std::array<double, 2> signal{};  ///< products of the halves: squared signal without bias from
                                   ///< noise
  double pixels = 0;
};

/// Returns the sums of a tile of both images.
PairSums sums_of(const FilmSnapshot& a, const FilmSnapshot& b, const PixelRect& tile) {
  PairSums sums;
  const std::array<const FilmSnapshot*, 2> films = {&a, &b};
  for (int y = tile.y; y < tile.y + tile.height; ++y) {
    for (int x = tile.x; x < tile.x + tile.width; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(a.rect.width) +
                     static_cast<std::size_t>(x);
      std::array<Rgb, 2> means;
      for (std::size_t k = 0; k < 2; ++k) {
        const Rgb one = half_value(*films[k], i, 0).mean;
        const Rgb other = half_value(*films[k], i, 1).mean;
        means[k] = (one + other) * 0.5F;
        sums.light[k] += static_cast<double>(luminance(means[k]));
        for (int c = 0; c < 3; ++c) {
          const auto apart = static_cast<double>(one[c] - other[c]);
          sums.noise[k] += apart * apart / 4;
          sums.signal[k] += static_cast<double>(one[c]) * static_cast<double>(other[c]);
        }
      }
      for (int c = 0; c < 3; ++c) {
        const auto apart = static_cast<double>(means[0][c] - means[1][c]);
        sums.apart += apart * apart;
      }
      ++sums.pixels;
    }
  }
  return sums;
}

std::string in_words(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3g", value);
  return text;
}

/// Returns the reason why no pilot is needed; empty if one is.
std::string without_pilot(const View& view) {
  if (view.settings.spectral) {
    return "spectral is true";
  }
  const SceneData& scene = view.scene->data();
  const auto& materials = scene.materials;
  if (scene.has_scattering || view.settings.fog) {
    return "the scene has scattering media";
  }
  const bool disperses = std::any_of(materials.begin(), materials.end(),
                                     [](const Material& m) { return m.factors.dispersion > 0; });
  return disperses ? "the scene has dispersion" : "";
}

}  // namespace

std::array<double, 2> paired_variances(const FilmSnapshot& a, const FilmSnapshot& b) {
  std::vector<PairSums> tiles;
  double light = 0;
  double pixels = 0;
  for (const PixelRect& rect : tile_rects({0, 0, a.rect.width, a.rect.height})) {
    tiles.push_back(sums_of(a, b, rect));
    light += std::max(tiles.back().light[0], tiles.back().light[1]);
    pixels += tiles.back().pixels;
  }
  constexpr double kFloor = 0.05;  // as in the error of an image
  const double least = 3 * (kFloor * light / pixels) * (kFloor * light / pixels);
  std::array<double, 2> variances{};
  for (const PairSums& tile : tiles) {
    const double scale =
        tile.pixels / pixels /
        std::max(std::max({tile.signal[0], tile.signal[1], 0.0}) + tile.pixels * least,
                 std::numeric_limits<double>::min());
    const double missed = std::max(tile.apart - tile.noise[0] - tile.noise[1], 0.0);
    const std::size_t darker = tile.light[0] < tile.light[1] ? 0 : 1;
    for (std::size_t k = 0; k < 2; ++k) {
      variances[k] += scale * (tile.noise[k] + (k == darker ? missed : 0));
    }
  }
  return variances;
}

Result<IntegratorChoice> choose_integrator(const View& view) {
  IntegratorChoice choice;
  choice.integrator = kCandidates[0].integrator;
  if (const std::string why = without_pilot(view); !why.empty()) {
    choice.reason = "'path', since " + why;
    return choice;
  }
  std::array<std::shared_ptr<Film>, 2> films;
  for (std::size_t k = 0; k < 2; ++k) {
    auto film = render_pilot(pilot_view(view, kCandidates[k].integrator));
    if (!film) {
      return film.error();
    }
    films[k] = *std::move(film);
  }
  const auto variances = paired_variances(films[0]->snapshot(), films[1]->snapshot());
  for (std::size_t k = 0; k < 2; ++k) {
    const double samples = static_cast<double>(films[k]->sample_counts().sum);
    const double work = static_cast<double>(films[k]->rays()) / samples * kCandidates[k].ray_weight;
    const double cost = variances[k] * work;
    choice.pilots[k] = {kCandidates[k].integrator, variances[k], work,
                        cost > 0 ? 1 / cost : std::numeric_limits<double>::infinity()};
  }
  const auto& [path, bdpt] = choice.pilots;
  const bool takes_bdpt = bdpt.efficiency > kAdvantage * path.efficiency;
  choice.integrator = (takes_bdpt ? bdpt : path).integrator;
  choice.reason = "'" + std::string(choice.integrator) + "', since pilots of " +
                  std::to_string(kSamples) + " samples have an efficiency 1 / (V T) of " +
                  in_words(path.efficiency) + " (path) and " + in_words(bdpt.efficiency) +
                  " (bdpt), and bdpt is chosen only if it is " + in_words(kAdvantage) +
                  " times as efficient";
  return choice;
}

Result<std::string> settle_integrator(View& view) {
  if (view.settings.integrator != kAutomaticIntegrator) {
    return std::string();
  }
  const auto choice = choose_integrator(view);
  if (!choice) {
    return choice.error();
  }
  view.settings.integrator = choice->integrator;
  return "integrator.type: 'auto' chose " + choice->reason + ".";
}

}  // namespace core
