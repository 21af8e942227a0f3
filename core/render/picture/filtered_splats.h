/// FilteredSplats: splats the contributions of light paths with the reconstruction filter.
#pragma once

#include "core/camera/camera.h"
#include "core/film/filter.h"
#include "core/film/splats.h"
#include "core/integrators/integrator.h"

namespace core {

/// Distributes a contribution at a film position over all pixels whose filters cover it.
class FilteredSplats final : public CameraSplats {
 public:
  FilteredSplats(const Camera& camera, const FilterSampler& filter, const FilmSettings& film,
                 LightBatch& to)
      : camera_(camera), filter_(filter), film_(film), to_(to) {}
  void begin(int replicate) noexcept { replicate_ = replicate; }
  const Camera& camera() const noexcept override { return camera_; }
  bool reaches(Vec2 film_px) const noexcept override {
    const auto near = [this](float at, int size) {
      const float reach = filter_.radius_px();
      return at > 0.5F - reach && at < static_cast<float>(size) - 0.5F + reach;
    };
    return near(film_px.x, film_.width) && near(film_px.y, film_.height);
  }
  void add(Vec2 film_px, Rgb value) noexcept override { add_to_plane(film_px, 0, value); }
  void add_to_share(Vec2 film_px, std::size_t share, Rgb value) noexcept override {
    add_to_plane(film_px, static_cast<int>(share) + 1, value);
  }

 private:
  void add_to_plane(Vec2 film_px, int plane, Rgb value) noexcept;

  const Camera& camera_;
  const FilterSampler& filter_;
  const FilmSettings& film_;
  LightBatch& to_;
  int replicate_ = 0;
};

}  // namespace core
