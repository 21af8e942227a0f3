/// Rows of floats, one for each lane.
#pragma once

#include <cstddef>

#include "core/math/lane_math.h"

namespace core {

inline constexpr float kNothing[16] = {};  ///< row for inactive lanes

/// Loads a vector from each row, and the float after it.
template <std::size_t N>
Vec3s<N> gather(const float* const (&rows)[N], Floats<N>& behind) {
  Floats<N> columns[4];
  transpose(rows, columns);
  behind = columns[3];
  return {columns[0], columns[1], columns[2]};
}

/// Loads float 4 i + j of the rows into columns[i][j].
template <std::size_t N>
void transpose_rows(const float* const (&rows)[N], Floats<N> (&columns)[4][4]) {
  for (std::size_t part = 0; part < 4; ++part) {
    const float* from[N];
    for (std::size_t k = 0; k < N; ++k) {
      from[k] = rows[k] + 4 * part;
    }
    transpose(from, columns[part]);
  }
}

}  // namespace core
