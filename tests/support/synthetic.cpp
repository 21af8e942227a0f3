#include "tests/support/synthetic.h"

#include <utility>

#include "core/integrators/registry.h"
#include "core/render/picture/tile_fill.h"
#include "core/render/task/pass_plan.h"

namespace test_support {
namespace {

class SyntheticRenderer final : public core::Renderer {
 public:
  SyntheticRenderer(const Synthetic& synthetic, std::uint64_t seed) : sample_(synthetic.sample) {
    core::RenderSettings& settings = view_.settings;
    settings.film.width = synthetic.width;
    settings.film.height = synthetic.height;
    settings.film.albedo = settings.film.normal = settings.film.depth = false;
    settings.replicates = synthetic.replicates;
    settings.sampler = core::SamplerType::kIndependent;
    settings.adaptive = synthetic.adaptive;
    settings.seed = seed;
  }

  const core::View& view() const noexcept override { return view_; }
  bool render(core::TileState& state, int last_sample, std::stop_token stop) const override {
    return core::fill_tile(state, {view_.settings.replicates, core::plan_step(view_.settings)},
                           last_sample, stop, [&](int x, int y, int s) {
                             core::PathSample out;
                             out.radiance = core::Rgb(value(x, y, s, 0));
                             return out;
                           });
  }
  bool render_pilot(core::TileState& state, int last_sample, std::stop_token stop) const override {
    return core::fill_pilot(state, last_sample, stop,
                            [&](int x, int y, int s, std::uint64_t& rays) {
                              ++rays;
                              return core::Rgb(value(x, y, s, 1));
                            });
  }

 private:
  float value(int x, int y, int s, std::uint64_t stream) const {
    const auto key = (stream << 62U) ^ (view_.settings.seed << 44U) ^
                     (static_cast<std::uint64_t>(y) << 32U) ^
                     (static_cast<std::uint64_t>(x) << 20U) ^ static_cast<std::uint64_t>(s);
    Random random(Random(key).bits());
    return sample_(random, x, y);
  }

  core::View view_;
  std::function<float(Random&, int, int)> sample_;
};

}  // namespace

Picture render(const Synthetic& synthetic, int samples, std::uint64_t seed, int threads) {
  const auto renderer = std::make_shared<const SyntheticRenderer>(synthetic, seed);
  Picture picture;
  picture.film = core::make_film(renderer->view().settings);
  core::NullSink sink;
  core::TaskOptions options;
  options.stop.samples_per_pixel = samples;
  core::RenderTask task(renderer, picture.film, std::move(options), sink);
  while (threads == 1 && !task.finished()) {
    if (const auto slice = task.take()) {
      task.run(*slice);
    }
  }
  core::run_to_end(task, threads);
  picture.snapshot = picture.film->snapshot();
  picture.reason = task.stop_reason();
  picture.progress = task.progress();
  picture.points = task.points();
  return picture;
}

float rare_event(Random& random, float value) {
  return random.uniform() < 1 / value ? value : 0.0F;
}

}  // namespace test_support
