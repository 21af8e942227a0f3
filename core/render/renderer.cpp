#include <cmath>
#include <ctime>
#include <optional>
#include <utility>

#include "core/accel/accel.h"
#include "core/camera/camera.h"
#include "core/film/filter.h"
#include "core/integrators/integrator.h"
#include "core/render/render_task.h"
#include "core/render/split_pilot.h"
#include "core/samplers/dimensions.h"

namespace core {
namespace {

double thread_cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

/// Welford's update: mean and sum of squared deviations of the luminance.
void add_sample(ReplicatePixel& p, const PathSample& s) {
  ++p.count;
  const float w = 1 / static_cast<float>(p.count);
  const Rgb before = {p.mean_r, p.mean_g, p.mean_b};
  const Rgb after = before + (s.radiance - before) * w;
  p.m2_luminance += luminance(s.radiance - before) * luminance(s.radiance - after);
  p.mean_r = after.r;
  p.mean_g = after.g;
  p.mean_b = after.b;
  p.mean_alpha += (s.alpha - p.mean_alpha) * w;
}

void add_auxiliary(AuxPixel& p, const PathSample& s) {
  if (!s.hit) {
    return;
  }
  ++p.hits;
  const float w = 1 / static_cast<float>(p.hits);
  p.albedo = p.albedo + (s.albedo - p.albedo) * w;
  p.normal_world = p.normal_world + (s.normal_world - p.normal_world) * w;
  p.depth_m += (s.depth_m - p.depth_m) * w;
}

/// With `measured` splitting: as fixed, with the count that the pilot finds.
std::unique_ptr<const Integrator> planned_integrator(const View& view, const Camera& camera) {
  RenderSettings settings = view.settings;
  EstimatorSettings& estimator = settings.estimator;
  const auto make = [&] { return make_integrator({view.scene->data(), view.environment.get(), settings}); };
  if (estimator.splitting == SplittingType::kMeasured) {
    estimator.splitting = SplittingType::kNone;
    estimator.split_count = best_split_count(measure_split(camera, *make(), settings));
    estimator.splitting = SplittingType::kFixed;
  }
  return make();
}

class PictureRenderer final : public Renderer {
 public:
  PictureRenderer(View view, const Camera& camera)
      : view_(std::move(view)),
        camera_(camera),
        filter_(view_.settings.film.filter),
        integrator_(planned_integrator(view_, camera_)) {}

  const View& view() const noexcept override { return view_; }
  bool render(TileState& state, int last_sample, std::stop_token stop) const override;

 private:
  View view_;
  Camera camera_;
  FilterSampler filter_;
  std::unique_ptr<const Integrator> integrator_;
};

bool PictureRenderer::render(TileState& state, int last_sample, std::stop_token stop) const {
  prepare_tracing_thread();
  const double cpu_start = thread_cpu_seconds();
  const RenderSettings& settings = view_.settings;
  const int replicates = settings.replicates;
  PathSampler sampler(settings.sampler, replicates, settings.seed);
  std::uint64_t rays = 0;
  std::size_t pixel = 0;
  for (int y = state.rect.y; y < state.rect.y + state.rect.height; ++y) {
    if (stop.stop_requested()) {
      return false;
    }
    for (int x = state.rect.x; x < state.rect.x + state.rect.width; ++x, ++pixel) {
      for (int s = state.samples; s < last_sample; ++s) {
        sampler.start(x, y, s);
        const Vec4 u = sampler.get_4d(kCameraGroup);
        const FilterSampler::Offset at = filter_.sample({u.x, u.y});
        const Vec2 film_px = {static_cast<float>(x) + 0.5F + at.offset_px.x,
                              static_cast<float>(y) + 0.5F + at.offset_px.y};
        PathSample sample = integrator_->trace(camera_.ray(film_px, {u.z, u.w}), sampler, rays);
        sample.radiance *= at.weight;
        if (!is_finite(sample.radiance)) {
          sample.radiance = {};
          ++state.rejected_samples;
        }
        add_sample(state.pixels[pixel * static_cast<std::size_t>(replicates) +
                                static_cast<std::size_t>(s % replicates)],
                   sample);
        if (!state.aux.empty()) {
          add_auxiliary(state.aux[pixel], sample);
        }
      }
    }
  }
  state.samples = last_sample;
  state.rays += rays;
  state.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return true;
}

}  // namespace

Result<std::shared_ptr<const Renderer>> Renderer::create(View view) {
  const FilmSettings& film = view.settings.film;
  if (film.crop) {
    const PixelRect& c = *film.crop;
    if (c.x < 0 || c.y < 0 || c.width < 1 || c.height < 1 || c.x > film.width - c.width ||
        c.y > film.height - c.height) {
      return Error{ErrorCode::kInvalidArgument, "the crop reaches outside the film", "/film/crop"};
    }
  }
  const SceneSummary& summary = view.scene->summary();
  const auto camera = Camera::create(view.camera, summary.cameras, summary.bounds, film.width, film.height);
  if (!camera) {
    return camera.error();
  }
  std::shared_ptr<const Renderer> renderer = std::make_shared<PictureRenderer>(std::move(view), *camera);
  return renderer;
}

}  // namespace core
