#include "core/render/picture/renderer.h"

#include <algorithm>
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "core/accel/accel.h"
#include "core/aovs/first_hit.h"
#include "core/aovs/motion.h"
#include "core/base/check.h"
#include "core/base/cpu_time.h"
#include "core/camera/camera.h"
#include "core/camera/moving_camera.h"
#include "core/color/photometry.h"
#include "core/film/camera_sample.h"
#include "core/integrators/census.h"
#include "core/integrators/integrator.h"
#include "core/integrators/registry.h"
#include "core/render/picture/camera_start.h"
#include "core/render/picture/filtered_splats.h"
#include "core/render/picture/meter.h"
#include "core/render/picture/tile_fill.h"
#include "core/render/task/pass_plan.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/streams.h"
#include "core/transport/path_state.h"
#include "core/wave/wave_tracer.h"

namespace core {
namespace {

struct Planned {
  std::unique_ptr<const Integrator> integrator;
  std::unique_ptr<const WaveTracer> waves;  ///< for the image's paths; null: one path at a time
  int split_count = 0;                      ///< measured count; 0: not measured
};

/// Replaces `measured` splitting by the fixed count that the pilot found.
Planned planned_integrator(const View& view, const Camera& camera) {
  Planned planned;
  RenderSettings settings = view.settings;
  EstimatorSettings& estimator = settings.estimator;
  if (estimator.splitting == SplittingType::kMeasured) {
    planned.split_count = view.measured->split_count;
    estimator.split_count = planned.split_count;
    estimator.splitting = SplittingType::kFixed;
  }
  const IntegratorInput input = {view.scene->data(), view.environment.get(), settings, &camera,
                                 view.measured->aims_in_media};
  planned.integrator = make_integrator(input);
  if (view.wave_width > 0) {
    planned.waves = make_wave_tracer(input, view.wave_width);
  }
  return planned;
}

class PictureRenderer final : public Renderer {
 public:
  PictureRenderer(View view, MovingCamera camera, std::optional<Motion> motion)
      : view_(std::move(view)),
        moving_camera_(std::move(camera)),
        camera_(moving_camera_.first()),
        motion_(std::move(motion)),
        filter_(view_.settings.film.filter),
        planned_(planned_integrator(view_, camera_)) {
    const RenderSettings& settings = view_.settings;
    const IntegratorInput input = {view_.scene->data(), view_.environment.get(), settings};
    if (!settings.meter.empty()) {
      meter_.emplace(input);
    }
    const auto& shares = settings.film.shares;
    if (std::any_of(shares.begin(), shares.end(),
                    [](const LightShare& share) { return share.is_irradiance; })) {
      irradiance_.emplace(input);
    }
  }

  const View& view() const noexcept override { return view_; }
  int measured_split_count() const noexcept override { return planned_.split_count; }
  bool render(TileState& state, int last_sample, std::stop_token stop) const override;
  bool render_light(PixelRect unit, LightBatch& light, std::stop_token stop) const override;
  bool render_pilot(TileState& state, int last_sample, std::stop_token stop) const override;
  std::unique_ptr<Prepass> start_prepass(int sample) const override {
    return planned_.integrator->start_prepass(sample);
  }
  void run_prepass(Prepass& pass, int part, std::uint64_t& rays) const override {
    prepare_tracing_thread();
    planned_.integrator->run_prepass(pass, part, rays);
  }
  bool gather(TileState& state, const Prepass& pass, std::stop_token stop) const override;
  std::unique_ptr<LightCensus> start_census() const override {
    prepare_tracing_thread();
    return std::make_unique<LightCensus>(
        IntegratorInput{view_.scene->data(), view_.environment.get(), view_.settings, &camera_},
        tile_rects(view_.settings.film.area()));
  }
  bool render_meter(int chunk, MeterChunk& state, int last_sample,
                    std::stop_token stop) const override {
    prepare_tracing_thread();
    return meter_->render(chunk, state, last_sample, stop);
  }

 private:
  /// Traces one camera path. Non-finite samples count as zero and are counted.
  PathSample trace(PathSampler& sampler, int x, int y, int s, std::uint64_t& rays,
                   std::uint64_t& rejected) const;
  /// The camera ray of a sample, its weight in the film's filter; starts the sampler.
  struct Start {
    Camera::CameraRay ray;
    float weight = 1;
  };
  Start start(PathSampler& sampler, int x, int y, int s) const;
  void finish(PathSample& sample, const Start& from, std::uint64_t& rejected) const;
  /// Returns a sample of the irradiance layer [W/m^2].
  Rgb irradiance(const Camera::CameraRay& ray, const PathSampler& sampler, TileState& state) const;
  bool render_waves(TileState& state, const FillRule& rule, int last_sample,
                    const std::stop_token& stop) const;
  bool render_shares(TileState& state, const FillRule& rule, int last_sample,
                     const std::stop_token& stop) const;
  void keep_shares(TileState& state, const DueSample& at, float weight,
                   std::span<Rgb> shares) const;
  bool render_groups(TileState& state, const FillRule& rule, int last_sample,
                     const std::stop_token& stop, GroupTracer& tracer) const;
  bool count_mattes(TileState& state, const FillRule& rule, int first_sample,
                    const std::stop_token& stop) const;

  View view_;
  MovingCamera moving_camera_;
  Camera camera_;                 ///< when the shutter opens
  std::optional<Motion> motion_;  ///< if the layer is recorded
  FilterSampler filter_;
  Planned planned_;
  std::optional<Meter> meter_;
  std::optional<IrradianceTracer> irradiance_;  ///< if a share is irradiance
};

PathSample PictureRenderer::trace(PathSampler& sampler, int x, int y, int s, std::uint64_t& rays,
                                  std::uint64_t& rejected) const {
  const Start from = start(sampler, x, y, s);
  PathSample sample = planned_.integrator->trace(from.ray, sampler, rays);
  finish(sample, from, rejected);
  return sample;
}

PictureRenderer::Start PictureRenderer::start(PathSampler& sampler, int x, int y, int s) const {
  const CameraSample at = start_camera_sample(sampler, filter_, x, y, s);
  if (view_.settings.shutter_seconds > 0) {
    return {moving_camera_.ray(at.film_px, at.lens, sampler.get_4d(kTimeGroup).x), at.weight};
  }
  return {camera_.ray(at.film_px, at.lens), at.weight};
}

void PictureRenderer::finish(PathSample& sample, const Start& from, std::uint64_t& rejected) const {
  const float weight = from.weight;
  sample.depth_m += sample.hit ? from.ray.start_m : 0.0F;
  sample.radiance *= weight;
  sample.fit.control *= weight;
  if (view_.settings.film.errors_over_white) {
    sample.alpha *= weight;  // must match the radiance
  }
  if (!is_finite(sample.radiance + sample.fit.control + sample.fit.y + sample.fit.xy +
                 Rgb(sample.alpha))) {
    sample.radiance = {};
    sample.alpha = view_.settings.film.errors_over_white ? 0.0F : sample.alpha;
    sample.fit = {};
    ++rejected;
  }
}

bool PictureRenderer::render_waves(TileState& state, const FillRule& rule, int last_sample,
                                   const std::stop_token& stop) const {
  const RenderSettings& settings = view_.settings;
  const WaveStart start = {
      camera_, moving_camera_.is_at_rest() ? nullptr : &moving_camera_, filter_,
      PathSampler(settings.sampler, settings.replicates, settings.seed, settings.first_replicate)};
  const std::size_t shares = settings.film.shares.size();
  state.shares.resize(state.pixels.size() * shares);
  // Not cleared: begin() sets everything that is read.
  const auto wave = std::make_unique_for_overwrite<Wave>();
  return fill_tile_in_waves(
      state, rule, planned_.waves->samples_max(), last_sample, stop,
      [&](std::span<const DueSample> due) {
        planned_.waves->begin(*wave, start, due);
        planned_.waves->trace(*wave, state.rays, state.rejected_samples);
      },
      [&](const DueSample& at, std::size_t i) {
        if (shares > 0) {
          keep_shares(state, at, wave->results.weight.at[i],
                      std::span(wave->shares).subspan(i * shares, shares));
        }
        return wave->result(i);
      });
}

bool PictureRenderer::render_shares(TileState& state, const FillRule& rule, int last_sample,
                                    const std::stop_token& stop) const {
  const RenderSettings& settings = view_.settings;
  PathSampler sampler(settings.sampler, settings.replicates, settings.seed,
                      settings.first_replicate);
  const PixelRect rect = state.rect;
  std::vector<Rgb> shares(settings.film.shares.size());
  state.shares.resize(state.pixels.size() * shares.size());
  return fill_tile(state, rule, last_sample, stop, [&](int x, int y, int s) {
    const Start from = start(sampler, x, y, s);
    std::fill(shares.begin(), shares.end(), Rgb{});
    const std::uint64_t rejected = state.rejected_samples;
    PathSample sample = planned_.integrator->trace_shares(from.ray, sampler, state.rays, shares);
    finish(sample, from, state.rejected_samples);
    const auto pixel = static_cast<std::size_t>(y - rect.y) * static_cast<std::size_t>(rect.width) +
                       static_cast<std::size_t>(x - rect.x);
    keep_shares(state, {x, y, s, pixel}, state.rejected_samples == rejected ? from.weight : 0.0F,
                shares);
    return sample;
  });
}

/// Adds the shares of a sample of this weight, and the irradiance, to the tile.
void PictureRenderer::keep_shares(TileState& state, const DueSample& at, float weight,
                                  std::span<Rgb> shares) const {
  const RenderSettings& settings = view_.settings;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    if (settings.film.shares[i].is_irradiance) {
      PathSampler sampler(settings.sampler, settings.replicates, settings.seed,
                          settings.first_replicate);
      PathSampler falling(settings.sampler, settings.replicates, settings.seed | kIrradianceStream,
                          settings.first_replicate);
      falling.start(at.x, at.y, at.sample);
      shares[i] = irradiance(start(sampler, at.x, at.y, at.sample).ray, falling, state);
    }
    shares[i] = weight != 0 ? shares[i] * weight : Rgb{};
  }
  const auto replicates = static_cast<std::size_t>(settings.replicates);
  const std::size_t of = at.pixel * replicates + static_cast<std::size_t>(at.sample) % replicates;
  add_shares(std::span(state.shares).subspan(of * shares.size(), shares.size()), shares,
             state.pixels[of].count + 1);
}

Rgb PictureRenderer::irradiance(const Camera::CameraRay& ray, const PathSampler& sampler,
                                TileState& state) const {
  const Rgb found = irradiance_->sample_seen(ray, sampler, state.rays);
  if (!is_finite(found)) {
    ++state.rejected_samples;
    return {};
  }
  return found * static_cast<float>(1 / kLumensPerWatt);
}

bool PictureRenderer::render_groups(TileState& state, const FillRule& rule, int last_sample,
                                    const std::stop_token& stop, GroupTracer& tracer) const {
  const RenderSettings& settings = view_.settings;
  const PathSampler sampler(settings.sampler, settings.replicates, settings.seed,
                            settings.first_replicate);
  std::vector<GroupPath> paths(kGroupMost, {{}, sampler});
  std::array<Start, kGroupMost> starts{};
  return fill_tile_in_groups(
      state, rule, settings.light_block, last_sample, stop,
      [&](std::span<const DueSample> due, int each, std::span<PathSample> samples) {
        for (std::size_t i = 0; i < due.size(); ++i) {
          starts[i] = start(paths[i].sampler, due[i].x, due[i].y, due[i].sample);
          paths[i].camera_ray = starts[i].ray;
        }
        tracer.trace(std::span(paths).first(due.size()), each, state.rays);
        for (std::size_t i = 0; i < due.size(); ++i) {
          samples[i] = paths[i].out;
          finish(samples[i], starts[i], state.rejected_samples);
        }
      });
}

/// Traces the camera rays of the samples from first_sample on again for their first surfaces. These
/// are the same for any integrator, because holes follow from the sample's random numbers.
bool PictureRenderer::count_mattes(TileState& state, const FillRule& rule, int first_sample,
                                   const std::stop_token& stop) const {
  if (state.mattes.empty()) {
    return true;
  }
  const RenderSettings& settings = view_.settings;
  const MatteKinds kinds = {settings.film.object_mattes, settings.film.material_mattes};
  PathSampler sampler(settings.sampler, settings.replicates, settings.seed,
                      settings.first_replicate);
  return visit_samples(
      state, rule, first_sample, state.samples, stop, [&](std::size_t pixel, int x, int y, int s) {
        PathState path =
            start_path(view_.scene->data(), start(sampler, x, y, s).ray, sampler, state.rays);
        count_matte(view_.scene->data(), path, kinds, s % 2,  // the number of replicates is even
                    std::span(state.mattes).subspan(pixel * kinds.count(), kinds.count()));
      });
}

bool PictureRenderer::render(TileState& state, int last_sample, std::stop_token stop) const {
  prepare_tracing_thread();
  const double cpu_start = thread_cpu_seconds();
  const RenderSettings& settings = view_.settings;
  PathSampler sampler(settings.sampler, settings.replicates, settings.seed,
                      settings.first_replicate);
  std::uint64_t rays = 0;
  std::uint64_t rejected = 0;
  const FillRule rule = {settings.replicates, plan_step(settings), fit_type(settings),
                         settings.light_history};
  const std::unique_ptr<GroupTracer> groups = planned_.integrator->make_group_tracer();
  const int first_sample = state.samples;
  if (first_sample == 0) {
    put_first_hits(state, view_.scene->data(), camera_, motion_ ? &*motion_ : nullptr);
  }
  bool whole = false;
  if (groups != nullptr) {
    whole = render_groups(state, rule, last_sample, stop, *groups);
  } else if (planned_.waves != nullptr) {
    whole = render_waves(state, rule, last_sample, stop);
  } else if (!settings.film.shares.empty()) {
    whole = render_shares(state, rule, last_sample, stop);
  } else {
    whole = fill_tile(state, rule, last_sample, stop,
                      [&](int x, int y, int s) { return trace(sampler, x, y, s, rays, rejected); });
  }
  whole = whole && count_mattes(state, rule, first_sample, stop);
  state.rejected_samples += rejected;
  state.rays += rays;
  state.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return whole;
}

bool PictureRenderer::render_light(PixelRect unit, LightBatch& light, std::stop_token stop) const {
  if (light.first_sample == light.last_sample) {
    return true;
  }
  prepare_tracing_thread();
  const double cpu_start = thread_cpu_seconds();
  const RenderSettings& settings = view_.settings;
  PathSampler sampler(settings.sampler, settings.replicates, settings.seed | kLightStream,
                      settings.first_replicate);
  FilteredSplats splats(camera_, filter_, settings.film, light);
  if (planned_.integrator->has_chains()) {
    for (int s = light.first_sample; s < light.last_sample; ++s) {
      if (stop.stop_requested()) {
        return false;
      }
      splats.begin(s % settings.replicates);
      planned_.integrator->trace_chain({unit.x, unit.y, s, unit.width * unit.height}, light.rays,
                                       splats);
    }
    light.cpu_seconds += thread_cpu_seconds() - cpu_start;
    return true;
  }
  for (int y = unit.y; y < unit.y + unit.height; ++y) {
    if (stop.stop_requested()) {
      return false;
    }
    for (int x = unit.x; x < unit.x + unit.width; ++x) {
      for (int s = light.first_sample; s < light.last_sample; ++s) {
        sampler.start(x, y, s);
        splats.begin(s % settings.replicates);
        planned_.integrator->trace_light(sampler, light.rays, splats);
      }
    }
  }
  light.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return true;
}

bool PictureRenderer::gather(TileState& state, const Prepass& pass, std::stop_token stop) const {
  const int first_sample = state.samples;
  DCHECK(pass.serves(first_sample));
  prepare_tracing_thread();
  const double cpu_start = thread_cpu_seconds();
  const RenderSettings& settings = view_.settings;
  PathSampler sampler(settings.sampler, settings.replicates, settings.seed,
                      settings.first_replicate);
  const FillRule rule = {settings.replicates, plan_step(settings), fit_type(settings),
                         settings.light_history};
  if (state.samples == 0) {
    put_first_hits(state, view_.scene->data(), camera_, motion_ ? &*motion_ : nullptr);
  }
  bool whole = fill_tile(state, rule, first_sample + 1, stop, [&](int x, int y, int s) {
    const Start from = start(sampler, x, y, s);
    PathSample sample = planned_.integrator->gather(from.ray, sampler, pass, state.rays);
    finish(sample, from, state.rejected_samples);
    return sample;
  });
  whole = whole && count_mattes(state, rule, first_sample, stop);
  state.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return whole;
}

bool PictureRenderer::render_pilot(TileState& state, int last_sample, std::stop_token stop) const {
  prepare_tracing_thread();
  const double cpu_start = thread_cpu_seconds();
  const RenderSettings& settings = view_.settings;
  PathSampler sampler(SamplerType::kIndependent, settings.replicates, settings.seed | kPilotStream,
                      settings.first_replicate);
  std::uint64_t rejected = 0;
  const bool whole =
      fill_pilot(state, last_sample, stop, [&](int x, int y, int s, std::uint64_t& rays) {
        const PathSample sample = trace(sampler, x, y, s, rays, rejected);
        return settings.film.errors_over_white ? sample.radiance + Rgb(1 - sample.alpha)
                                               : sample.radiance;
      });
  state.rejected_samples += rejected;
  state.cpu_seconds += thread_cpu_seconds() - cpu_start;
  return whole;
}

}  // namespace

Result<std::shared_ptr<const Renderer>> Renderer::create(View view) {
  CHECK(view.measured && !leaves_a_choice(view.settings));
  auto camera = camera_of(view);
  if (!camera) {
    return camera.error();
  }
  const FilmSettings& film = view.settings.film;
  place_in_solids(*camera, view.scene->data(),
                  {static_cast<float>(film.width), static_cast<float>(film.height)},
                  view.settings.shutter_seconds > 0);
  std::optional<Motion> motion;
  if (film.motion && view.later != nullptr) {
    const auto later = Camera::create(view.camera, view.later->cameras(),
                                      view.scene->summary().bounds, film.width, film.height);
    if (!later) {
      return later.error();
    }
    motion = Motion{view.later, camera->first(), *later, static_cast<float>(film.width)};
  }
  std::shared_ptr<const Renderer> renderer =
      std::make_shared<PictureRenderer>(std::move(view), *std::move(camera), std::move(motion));
  return renderer;
}

}  // namespace core
