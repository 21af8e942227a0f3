/// Reconstruction filters, importance sampled: a sample's position is drawn from the filter of its
/// pixel, so it counts for that pixel alone and neighbours stay independent.
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
    float weight = 1;  ///< -1 or +1 times a constant; 1 for filters without negative lobes
  };
  Offset sample(Vec2 u) const noexcept;
  /// Then offsets are (2 u - 1) * radius_px(), and weights 1.
  bool is_box() const noexcept { return settings_.type == FilterType::kBox; }
  /// Nowhere negative: offsets are (2 x - 1) * radius_px(), x drawn from table(), and weights 1.
  bool is_positive() const noexcept { return settings_.type != FilterType::kMitchell; }
  DistributionTable table() const noexcept { return table_.table(); }
  /// The filter itself, one axis, x in pixels; not normalised.
  float evaluate(float x) const noexcept;
  /// The same over its integral [1/px]: weight of light at x in the value of the pixel at 0.
  float density(float x) const noexcept { return evaluate(x) / integral_px_; }
  float radius_px() const noexcept { return settings_.radius_px; }

 private:
  Vec2 axis(float u) const noexcept;  ///< x: offset, y: sign

  FilterSettings settings_;
  Distribution1D table_;  ///< of |f| over [-radius, radius]
  float integral_px_ = 1;
  float scale_ = 1;  ///< integral of |f| over integral of f
};

}  // namespace core
