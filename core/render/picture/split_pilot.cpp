#include "core/render/picture/split_pilot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "core/accel/accel.h"
#include "core/film/camera_sample.h"
#include "core/film/half_sums.h"
#include "core/light_samplers/light_sampler.h"
#include "core/math/numbers.h"

namespace core {
namespace {

constexpr std::uint64_t kStream = 0x5b117;  ///< separates the pilot's random numbers from the
                                            ///< image's

/// Variances of the luminance in one pixel.
struct PixelVariances {
  double mean = 0;
  double branch = 0;
  double total = 0;
};

}  // namespace

int best_split_count(const SplitCosts& costs) {
  int best = 1;
  double least = 0;
  const double most = kSplitCostMost * (costs.prefix_rays + costs.branch_rays);
  for (int n = 1; n <= kMeasuredSplitMost && costs.branch_rays > 0; n *= 2) {
    const double cost = costs.prefix_rays + n * costs.branch_rays;
    if (cost > most) {
      break;
    }
    const double work = (costs.prefix_variance + costs.branch_variance / n) * cost;
    if (n == 1 || work < least) {
      best = n;
      least = work;
    }
  }
  return best;
}

std::optional<SplitCosts> measure_split(const Camera& camera, const Integrator& plain,
                                        const RenderSettings& settings, int count,
                                        const std::stop_token& stop,
                                        std::span<const double> means) {
  prepare_tracing_thread();
  const FilterSampler filter(settings.film.filter);
  PathSampler sampler(SamplerType::kIndependent, 2, hash_combine(settings.seed, kStream));
  std::vector<PixelVariances> pixels;
  pixels.reserve(static_cast<std::size_t>(count));
  std::uint64_t rays = 0;
  int paths = 0;
  for (int i = 0; i < count; ++i) {
    if (stop.stop_requested()) {
      return std::nullopt;
    }
    // Spreads pixels evenly over the film: the R2 sequence (Roberts 2018).
    const double u = 0.5 + i * 0.7548776662466927;
    const double v = 0.5 + i * 0.5698402909980532;
    const int x = std::min(static_cast<int>((u - std::floor(u)) * settings.film.width),
                           settings.film.width - 1);
    const int y = std::min(static_cast<int>((v - std::floor(v)) * settings.film.height),
                           settings.film.height - 1);
    double value[2][2] = {};
    for (int way = 0; way < 2; ++way) {
      const CameraSample at = start_camera_sample(sampler, filter, x, y, 2 * i + way);
      const Camera::CameraRay ray = camera.ray(at.film_px, at.lens);
      for (int branch = 0; branch < 2; ++branch) {
        const PathSample sample = plain.trace(ray, sampler.branch(branch, 2), rays);
        value[way][branch] =
            is_finite(sample.radiance) ? static_cast<double>(luminance(sample.radiance)) : 0;
        ++paths;
      }
    }
    // Two paths of one camera ray differ only by the branch; paths of two rays differ by both.
    const auto half_square = [](double a, double b) { return 0.5 * (a - b) * (a - b); };
    const double within =
        0.5 * (half_square(value[0][0], value[0][1]) + half_square(value[1][0], value[1][1]));
    const double total =
        0.5 * (half_square(value[0][0], value[1][0]) + half_square(value[0][1], value[1][1]));
    const double mean = 0.25 * (value[0][0] + value[0][1] + value[1][0] + value[1][1]);
    pixels.push_back({mean, within, total});
  }
  SplitCosts out;
  for (const PixelVariances& p : pixels) {
    out.means.push_back(p.mean);
  }
  double roots = 0;
  for (const double mean : means.empty() ? out.means : means) {
    roots += std::sqrt(std::max(mean, 0.0));
  }
  // Relative to signal and floor, as in the error of an image.
  const double floor = error_floor(roots / count);
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    const double mean = means.empty() ? pixels[i].mean : means[i];
    const double signal = mean * mean + floor * floor;
    if (signal > 0) {
      out.branch_variance += pixels[i].branch / signal / count;
      out.prefix_variance += (pixels[i].total - pixels[i].branch) / signal / count;
    }
  }
  out.prefix_variance = std::max(out.prefix_variance, 0.0);
  out.prefix_rays = 1;
  out.branch_rays = std::max(static_cast<double>(rays) / paths - out.prefix_rays, 0.0);
  return out;
}

std::optional<bool> pays_to_aim(const IntegratorInput& input, const std::stop_token& stop) {
  const SceneData& scene = input.scene;
  const bool has_local = LightSampler(scene, nullptr, LightPick::kTree).has_local();
  const bool has_media = input.settings.fog || (scene.has_scattering && scene.has_clear);
  if (input.settings.integrator != "path" || !has_local || !has_media) {
    return false;
  }
  RenderSettings settings = input.settings;
  settings.estimator.splitting = SplittingType::kNone;
  const auto measure = [&](bool aims, std::span<const double> means) {
    const auto integrator =
        make_integrator({scene, input.environment, settings, input.camera, aims});
    return measure_split(*input.camera, *integrator, settings, kSplitPixels, stop, means);
  };
  const auto work = [](const SplitCosts& costs) {
    return (costs.prefix_variance + costs.branch_variance) *
           (costs.prefix_rays + costs.branch_rays);
  };
  const std::optional<SplitCosts> aimed = measure(true, {});
  const std::optional<SplitCosts> plain = aimed ? measure(false, aimed->means) : std::nullopt;
  return plain ? std::optional(work(*aimed) < work(*plain)) : std::nullopt;
}

}  // namespace core
