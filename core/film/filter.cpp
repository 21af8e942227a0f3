#include "core/film/filter.h"

#include <cmath>

#include "core/math/numbers.h"

namespace core {
namespace {

constexpr int kCells = 512;  // per axis; |f| is treated as constant over a cell

}  // namespace

FilterSampler::FilterSampler(const FilterSettings& settings) : settings_(settings) {
  std::vector<float> weights(kCells);
  double sum = 0;
  double absolute = 0;
  for (int i = 0; i < kCells; ++i) {
    const float x = ((static_cast<float>(i) + 0.5F) / kCells * 2 - 1) * settings_.radius_px;
    const float f = evaluate(x);
    weights[static_cast<std::size_t>(i)] = std::fabs(f);
    sum += static_cast<double>(f);
    absolute += static_cast<double>(std::fabs(f));
  }
  table_ = Distribution1D(weights);
  table_.add_guide();
  integral_px_ = static_cast<float>(sum) * 2 * settings_.radius_px / kCells;
  scale_ = static_cast<float>(absolute / sum);
}

float FilterSampler::evaluate(float x) const noexcept {
  const float r = settings_.radius_px;
  const float a = std::fabs(x) / r;  // 0 at the centre, 1 at the edge
  if (a > 1) {
    return 0;
  }
  switch (settings_.type) {
    case FilterType::kBox:
      return 1;
    case FilterType::kTent:
      return 1 - a;
    case FilterType::kGaussian: {
      const float t = 3 * a;  // sigma = radius / 3
      return std::exp(-0.5F * t * t) - std::exp(-4.5F);
    }
    case FilterType::kMitchell: {
      // Mitchell and Netravali 1988 with B = C = 1/3, scaled to the radius.
      const float t = 2 * a;
      return t < 1 ? (7 * t * t * t - 12 * t * t + 16.0F / 3) / 6
                   : (-7.0F / 3 * t * t * t + 12 * t * t - 20 * t + 32.0F / 3) / 6;
    }
    case FilterType::kBlackmanHarris: {
      const float t = kPi * (1 - a);
      return 0.35875F - 0.48829F * std::cos(t) + 0.14128F * std::cos(2 * t) -
             0.01168F * std::cos(3 * t);
    }
  }
  return 0;
}

FilterSampler::Offset FilterSampler::sample(Vec2 u) const noexcept {
  const Vec2 at = {offset_px(u.x), offset_px(u.y)};
  if (is_positive()) {
    return {at, 1};
  }
  const auto sign = [this](float x) { return evaluate(x) < 0 ? -1.0F : 1.0F; };
  return {at, sign(at.x) * sign(at.y) * scale_ * scale_};
}

}  // namespace core
