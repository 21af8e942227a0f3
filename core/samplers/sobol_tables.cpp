// Direction numbers of dimensions 3 and 4 in the file new-joe-kuo-6.21201 of Joe and Kuo
// (2008): degree 2, a = 1, m = 1 3; degree 3, a = 1, m = 1 3 1.
#include <array>

#include "core/samplers/sobol.h"

namespace core {
namespace {

constexpr std::array<std::uint32_t, 32> direction_numbers(int degree, std::uint32_t a,
                                                          std::array<std::uint32_t, 3> m) {
  std::array<std::uint32_t, 32> v{};
  for (int i = 0; i < 32; ++i) {
    const auto at = static_cast<std::size_t>(i);
    if (i < degree) {
      v[at] = m[at] << (31 - i);
      continue;
    }
    const auto back = v[static_cast<std::size_t>(i - degree)];
    v[at] = back ^ (back >> degree);
    for (int k = 1; k < degree; ++k) {
      if (((a >> (degree - 1 - k)) & 1U) != 0) {
        v[at] ^= v[static_cast<std::size_t>(i - k)];
      }
    }
  }
  return v;
}

constexpr std::uint32_t point(std::uint32_t index, const std::array<std::uint32_t, 32>& v) {
  std::uint32_t x = 0;
  for (std::size_t bit = 0; bit < 32; ++bit) {
    if (((index >> bit) & 1U) != 0) {
      x ^= v[bit];
    }
  }
  return x;
}

constexpr SobolTables make_tables() {
  SobolTables tables{};
  const auto third = direction_numbers(2, 1, {1, 3, 0});
  const auto fourth = direction_numbers(3, 1, {1, 3, 1});
  for (std::uint32_t byte = 0; byte < 4; ++byte) {
    for (std::uint32_t value = 0; value < 256; ++value) {
      // The first dimension is the index with its bits reversed.
      const std::uint32_t index = reverse_bits(value << (8 * byte));
      tables.entry[byte][value] = {index, second_reversed(index), reverse_bits(point(index, third)),
                                   reverse_bits(point(index, fourth))};
    }
  }
  return tables;
}

}  // namespace

constexpr SobolTables kTablesAtCompileTime = make_tables();
const SobolTables kSobolTables = kTablesAtCompileTime;

}  // namespace core
