/// UnitRenderer: renders slices of a job in a process that does not hold its film.
#pragma once

#include <memory>
#include <span>
#include <stop_token>

#include "core/base/mutex.h"
#include "core/integrators/prepass.h"
#include "core/render/units/slice_work.h"

namespace core {

/// Thread-safe.
class UnitRenderer {
 public:
  explicit UnitRenderer(std::shared_ptr<const Renderer> renderer)
      : renderer_(std::move(renderer)) {}

  /// Renders the work to the ends of its slices; the splats of its light paths are summed in the
  /// first slice. Photons that it looks up are traced here, once for all threads. Returns false,
  /// leaving the work incomplete, if stop was requested.
  bool render(std::span<SliceWork> work, const std::stop_token& stop);

 private:
  struct Photons;
  bool render_one(SliceWork& work, const std::stop_token& stop);
  bool render_light(SliceWork& work, const SplatLayout& layout, SplatTiles& sums,
                    const std::stop_token& stop) const;
  void trace_parts(Photons& photons, std::uint64_t& rays);
  /// Returns the photons of a sample; takes part in tracing them.
  std::shared_ptr<const Prepass> photons(int sample, std::uint64_t& rays);

  const std::shared_ptr<const Renderer> renderer_;
  Mutex mutex_;
  CondVar built_;
  std::shared_ptr<Photons> photons_ GUARDED_BY(mutex_);  ///< those of the latest sample
};

}  // namespace core
