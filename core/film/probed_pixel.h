/// Pixels whose expected values are found by samples of their own, which are never in the picture: where one event makes much of what a
/// picture is off by, the film cannot tell a firefly from a rim that is as bright.
#pragma once

#include <array>
#include <cstdint>

#include "core/color/rgb.h"

namespace core {

struct ProbedPixel {
  std::uint32_t pixel = 0;     ///< row by row over the film's crop
  std::array<Rgb, 2> means{};  ///< radiance, of two independent halves of its samples

  constexpr Rgb mean() const noexcept { return (means[0] + means[1]) * 0.5F; }
};

}  // namespace core
