/// The Halton sequence, randomised by a nested scramble of its digits, with random access.
///
/// In base b the digit k of point i becomes (a d + c) mod b, where a != 0 and c are random and
/// depend on the digits before it: any two points are placed as Owen's nested uniform scramble
/// places them, so variances are those of Owen's (Matousek 1998), and the points of [m b^k, (m + 1)
/// b^k) have one point in each of b^k intervals. Sources: Halton 1960; Owen 2017, A randomized
/// Halton algorithm.
#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace core {

/// Dimensions that have a base of their own; those beyond are independent uniform numbers.
inline constexpr int kHaltonDimensions = 64;
/// Beyond so many points a further one is uniform and independent within its last interval.
inline constexpr std::uint32_t kHaltonPointsMax = 1U << 20;

/// The prime of dimension 0 <= d < kHaltonDimensions: 2, 3, 5, ...
std::uint32_t halton_base(int d) noexcept;

/// Coordinate d of point `index` of the sequence that `key` names, in [0,1).
float halton_1d(int d, std::uint32_t index, std::uint64_t key) noexcept;

/// Which dimension a component of a group of core/samplers/dimensions.h is; -1: none, an
/// independent number. The lowest bases go to the film, then to lights and directions at the first
/// surfaces.
int halton_dimension(int group, int component) noexcept;

/// The four numbers of a group. (h, h2): random bits of the group.
Vec4 halton_4d(int group, std::uint32_t index, std::uint64_t h, std::uint64_t h2) noexcept;

}  // namespace core
