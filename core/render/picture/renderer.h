/// Renderer: everything that is prepared for a view.
#pragma once

#include <cstdint>
#include <memory>
#include <stop_token>

#include "core/base/result.h"
#include "core/film/film.h"
#include "core/integrators/prepass.h"
#include "core/render/picture/view.h"

namespace core {

class LightCensus;  // core/integrators/census.h

/// Everything that is prepared for a view: camera, light sampler, tables. Immutable and
/// thread-safe.
class Renderer {
 public:
  /// Renders nothing. Pre: settle() has settled the view (core/render/task/settle.h). Errors: as
  /// camera_of().
  static Result<std::shared_ptr<const Renderer>> create(View view);
  virtual ~Renderer() = default;
  virtual const View& view() const noexcept = 0;
  /// Returns the best count found by `measured` splitting; 0 for other types.
  virtual int measured_split_count() const noexcept { return 0; }
  /// Renders samples [state.samples, last_sample) of every pixel of state.rect into `state`, in
  /// order. With a plan, these are mean counts. Returns false, leaving `state` incomplete, if stop
  /// was requested.
  virtual bool render(TileState& state, int last_sample, std::stop_token stop) const = 0;
  /// Renders light paths [light.first_sample, light.last_sample) of every pixel of the unit into
  /// `light`, if the integrator splats. Returns false if stop was requested.
  virtual bool render_light(PixelRect, LightBatch&, std::stop_token) const { return true; }
  /// As render(), for pilot samples [state.pilot_samples, last_sample), which are independent of
  /// all other samples.
  virtual bool render_pilot(TileState& state, int last_sample, std::stop_token stop) const = 0;
  /// Renders a chunk of the job's meter up to last_sample. Returns false if stop was requested.
  virtual bool render_meter(int /*chunk*/, MeterChunk&, int /*last_sample*/,
                            std::stop_token) const {
    return true;
  }
  /// As Integrator::start_prepass(). Null: no sample needs a prepass.
  virtual std::unique_ptr<Prepass> start_prepass(int) const { return nullptr; }
  virtual void run_prepass(Prepass&, int /*part*/, std::uint64_t& /*rays*/) const {}
  /// Returns a census of particles for the view's tiles; null if there is none (has_census()).
  virtual std::unique_ptr<LightCensus> start_census() const;
  /// As render(), for the one sample after state.samples, which the prepass serves.
  virtual bool gather(TileState&, const Prepass&, std::stop_token) const { return true; }
};

}  // namespace core
