/// Reconstruction filters by importance sampling: a sample's offset is drawn from the filter of its
/// pixel, so it contributes to that pixel alone and neighbouring pixels stay independent.
#pragma once

#include "core/math/vec.h"
#include "core/sampling/distribution.h"
#include "core/settings/settings.h"

namespace core {

class FilterSampler {
 public:
  explicit FilterSampler(const FilterSettings& settings);

  struct Offset {
    Vec2 offset_px;    ///< from the pixel's centre
    float weight = 1;  ///< +c or -c for a constant c; 1 if the filter has no negative lobes
  };
  Offset sample(Vec2 u) const noexcept;
  /// If true, the filter is nowhere negative: weights are 1.
  bool is_positive() const noexcept { return settings_.type != FilterType::kMitchell; }
  /// Returns the offset along one axis, of one sample or of lanes.
  template <typename F>
  F offset_px(F u) const noexcept {
    const F at = settings_.type == FilterType::kBox ? u : table_.table().sample(u).x;
    return (at + at - 1) * radius_px();
  }
  /// Returns the unnormalised filter of one axis; x in pixels.
  float evaluate(float x) const noexcept;
  /// Returns evaluate(x) over its integral [1/px]: the weight of light at x in the pixel at 0.
  float density(float x) const noexcept { return evaluate(x) / integral_px_; }
  float radius_px() const noexcept { return settings_.radius_px; }

 private:
  FilterSettings settings_;
  Distribution1D table_;  ///< of |f| over [-radius, radius]
  float integral_px_ = 1;
  float scale_ = 1;  ///< integral of |f| over integral of f
};

}  // namespace core
