#include "core/render/task/reference_images.h"

#include <algorithm>
#include <utility>

#include "core/error/compared_error.h"
#include "core/integrators/registry.h"
#include "core/samplers/streams.h"

namespace core {

std::optional<RenderSettings> reference_settings(const RenderSettings& settings) {
  const IntegratorEntry* row = find_integrator(settings.integrator);
  if (row == nullptr || row->compared_with.empty()) {
    return std::nullopt;
  }
  RenderSettings out = default_settings(row->compared_with);
  out.estimator.splitting = SplittingType::kNone;  // needs no pilot
  const FilmSettings& film = settings.film;
  out.film.width = film.width;
  out.film.height = film.height;
  out.film.crop = film.crop;
  out.film.filter = film.filter;
  out.film.errors_over_white = film.errors_over_white;
  out.film.albedo = out.film.normal = out.film.depth = false;
  out.max_depth = settings.max_depth;
  out.background = settings.background;
  out.ground = settings.ground;
  out.units = settings.units;
  out.seed = settings.seed | kReferenceStream;
  return out;
}

std::uint64_t reference_bytes(const RenderSettings& settings) {
  const auto references = reference_settings(settings);
  if (!references) {
    return 0;
  }
  const FilmShape film = film_shape(*references);
  const PixelRect crop = film.crop();
  const auto pixels =
      static_cast<std::uint64_t>(crop.width) * static_cast<std::uint64_t>(crop.height);
  // A comparison copies both films and sums m, m with a sign, and the counted pixels.
  constexpr std::uint64_t kSums = 3 * sizeof(double);
  return 2 * film.bytes() + film_shape(settings).bytes() + pixels * kSums;
}

int reference_samples(int samples) {
  constexpr int kShare = 8;
  constexpr int kLeast = 16;
  // Both images have the same count.
  return std::max(2, (std::max(samples / kShare, std::min(samples, kLeast)) + 1) / 2 * 2);
}

std::unique_ptr<ReferenceImages> ReferenceImages::create(const View& view, double slice_seconds) {
  const auto settings = reference_settings(view.settings);
  if (!settings) {
    return nullptr;
  }
  View other = view;
  other.settings = *settings;
  other.measured = Measured{};
  // bdpt does not support all cameras and backgrounds.
  for (const std::string_view integrator :
       {std::string_view(settings->integrator), std::string_view("path")}) {
    other.settings.integrator = integrator;
    if (auto renderer = Renderer::create(other)) {
      return std::unique_ptr<ReferenceImages>(
          new ReferenceImages(*std::move(renderer), slice_seconds));
    }
  }
  return nullptr;
}

ReferenceImages::ReferenceImages(std::shared_ptr<const Renderer> renderer, double slice_seconds)
    : renderer_(std::move(renderer)),
      film_(make_film(renderer_->view().settings)),
      slice_seconds_(slice_seconds) {}

ReferenceImages::~ReferenceImages() = default;

void ReferenceImages::begin(int samples) {
  samples_ = reference_samples(samples);
  TaskOptions options;
  options.stop.samples_per_pixel = samples_;
  options.samples_limit = samples_;
  options.slice_target_seconds = slice_seconds_;
  task_ = std::make_unique<RenderTask>(renderer_, film_, std::move(options), sink_);
}

std::optional<Slice> ReferenceImages::take() {
  auto slice = task_->take();
  if (slice) {
    slice->kind = SliceKind::kReference;
  }
  return slice;
}

void ReferenceImages::run(const Slice& slice) {
  Slice own = slice;
  own.kind = SliceKind::kPicture;
  task_->run(own);
}

bool ReferenceImages::is_done() const { return task_ == nullptr || task_->finished(); }

ErrorEstimate ReferenceImages::error_of(const Film& image) const {
  return compared_error(image.snapshot(), film_->snapshot());
}

double ReferenceImages::take_cpu_seconds() {
  const double spent = film_->cpu_seconds();
  return spent - std::exchange(cpu_seconds_told_, spent);
}

}  // namespace core
