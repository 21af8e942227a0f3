/// The Halton sequence with random access, randomised by a nested scramble of its digits.
///
/// In base b, digit d at position k of point i becomes (a d + c) mod b, where a != 0 and c are
/// random and depend on the preceding digits. Any two points are then distributed as under Owen's
/// nested uniform scramble, so variances are the same (Matousek 1998), and the points of [m b^k, (m
/// + 1) b^k) have one point in each of b^k intervals. Sources: Halton 1960; Owen 2017, A randomized
/// Halton algorithm.
#pragma once

#include <cstdint>

#include "core/math/vec.h"

namespace core {

/// Dimensions with a base of their own; further ones are independent uniform numbers.
inline constexpr int kHaltonDimensions = 64;
/// Points beyond this index are uniform and independent within their last interval.
inline constexpr std::uint32_t kHaltonPointsMax = 1U << 20;

/// Returns the prime of dimension 0 <= d < kHaltonDimensions: 2, 3, 5, ...
std::uint32_t halton_base(int d) noexcept;

/// Returns coordinate d of point `index` in [0,1); `key` selects the sequence.
float halton_1d(int d, std::uint32_t index, std::uint64_t key) noexcept;

/// Returns the dimension of a component of a group of core/samplers/dimensions.h; -1 for
/// independent numbers. The smallest bases go to the film, then to lights and directions at the
/// first surfaces.
int halton_dimension(int group, int component) noexcept;

/// Returns the four numbers of a group. (h, h2): random bits of the group.
Vec4 halton_4d(int group, std::uint32_t index, std::uint64_t h, std::uint64_t h2) noexcept;

}  // namespace core
