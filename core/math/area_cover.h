/// Resizes a row of texels by area: its sum is kept.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace core {

/// The texels that a part of a row covers, from `first` on, and their shares of it, whose sum is 1.
struct AreaCover {
  int first = 0;
  std::vector<float> shares;
};

/// Divides `size` texels into equal parts and returns what part i covers. Pre: 0 < parts <= size.
inline AreaCover area_cover(int i, int size, int parts) {
  // In units of 1/parts of a texel, a part is `size` long.
  const auto begin = std::int64_t{i} * size;
  const auto end = begin + size;
  AreaCover cover{static_cast<int>(begin / parts), {}};
  for (std::int64_t at = std::int64_t{cover.first} * parts; at < end; at += parts) {
    const auto length = std::min(at + parts, end) - std::max(at, begin);
    cover.shares.push_back(static_cast<float>(length) / static_cast<float>(size));
  }
  return cover;
}

/// Calls add(x, y, share) for all texels that part (column, row) of an image covers.
template <typename Add>
void for_each_covered(const AreaCover& columns, const AreaCover& rows, const Add& add) {
  for (std::size_t r = 0; r < rows.shares.size(); ++r) {
    for (std::size_t c = 0; c < columns.shares.size(); ++c) {
      add(columns.first + static_cast<int>(c), rows.first + static_cast<int>(r),
          rows.shares[r] * columns.shares[c]);
    }
  }
}

inline std::vector<AreaCover> area_covers(int size, int parts) {
  std::vector<AreaCover> covers;
  for (int i = 0; i < parts; ++i) {
    covers.push_back(area_cover(i, size, parts));
  }
  return covers;
}

}  // namespace core
