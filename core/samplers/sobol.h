/// Points of the first four dimensions of the Sobol sequence, Owen-scrambled: of one path, or of N
/// at once, bit for bit.
///
/// W: std::uint32_t or Words<N>; H: the hashes that go with it. Indices and dimensions are
/// scrambled with their bits reversed. Sources: Burley, Practical Hash-based Owen Scrambling, JCGT
/// 2020; the hash is Laine and Karras' with Vegdahl's constants; direction numbers of Joe and Kuo,
/// 2008.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "core/math/lane_math.h"
#include "core/math/vec.h"
#include "core/samplers/dimensions.h"
#include "core/samplers/hash.h"

namespace core {

/// The four dimensions, tabulated per byte of the index with bits reversed on both sides:
/// reversed(sobol(index)) = xor over bytes b of entry[b][byte b of reversed(index)].
struct SobolTables {
  alignas(16) std::array<std::uint32_t, 4> entry[4][256];
};
extern const SobolTables kSobolTables;

constexpr std::uint32_t reverse_bits(std::uint32_t x) noexcept {
  x = __builtin_bswap32(x);
  x = ((x & 0x0f0f0f0fU) << 4) | ((x >> 4) & 0x0f0f0f0fU);
  x = ((x & 0x33333333U) << 2) | ((x >> 2) & 0x33333333U);
  return ((x & 0x55555555U) << 1) | ((x >> 1) & 0x55555555U);
}
template <std::size_t N>
[[gnu::always_inline]] inline Words<N> reverse_bits(Words<N> x) {
  if constexpr (N == 1) {
    return reverse_bits(x.v[0]);
  } else {
    // Reverses the bytes, then each byte through its two nibbles.
    const auto order = Words<N>::repeat({0x00010203U, 0x04050607U, 0x08090a0bU, 0x0c0d0e0fU});
    const auto table = Words<N>::repeat({0x0c040800U, 0x0e060a02U, 0x0d050901U, 0x0f070b03U});
    const Words<N> bytes = shuffle_bytes(x, order);
    const Words<N> low = shuffle_bytes(table, bytes & 0x0f0f0f0fU);
    return (low << 4) | shuffle_bytes(table, (bytes >> 4) & 0x0f0f0f0fU);
  }
}

/// Applies a nested uniform (Owen) scramble to a bit-reversed value; the result is reversed too.
template <typename W>
constexpr W scramble_reversed(W x, W seed) noexcept {
  x = x ^ x * 0x3d20adeaU;
  x = x + seed;
  x = x * ((seed >> 16) | 1U);
  x = x ^ x * 0x05526c56U;
  return x ^ x * 0x53a22864U;
}

/// Converts one dimension of a point, given with reversed bits, to a number.
template <typename W>
[[gnu::always_inline]] inline auto scrambled(W reversed, W seed) noexcept {
  return to_unit_float(reverse_bits(scramble_reversed(reversed, seed)));
}

/// reversed(second dimension of index): the Pascal matrix modulo 2 is a Kronecker power of
/// [[1,1],[0,1]], so the product is five butterfly steps. The first dimension, reversed, is the
/// index.
template <typename W>
constexpr W second_reversed(W index) noexcept {
  W x = index;
  x = x ^ ((x >> 1) & 0x55555555U);
  x = x ^ ((x >> 2) & 0x33333333U);
  x = x ^ ((x >> 4) & 0x0f0f0f0fU);
  x = x ^ ((x >> 8) & 0x00ff00ffU);
  return x ^ ((x >> 16) & 0x0000ffffU);
}

/// Derives the seeds of the four dimensions from 128 bits of hash; the word of the second is reused
/// with another multiplier. That of the index is low_word(h): Owen scrambling of it keeps every
/// block [m 2^k, (m + 1) 2^k) together, so each prefix of 2^k points remains a net.
template <typename H>
auto sobol_seeds(H h, H h2) noexcept {
  return std::array{high_word(h * 0xd1342543de82ef95ULL), high_word(h), low_word(h2),
                    high_word(h2)};
}

/// Returns the dimensions, reversed, of the point of a scrambled index, reversed too.
inline Words<4> sobol_reversed(std::uint32_t index) noexcept {
  const auto entry = [index](int byte) {
    return load<4>(kSobolTables.entry[byte][(index >> (8 * byte)) & 255U].data());
  };
  return (entry(0) ^ entry(1)) ^ (entry(2) ^ entry(3));
}

/// Returns point `index` of the sequence that (h, h2) scramble.
inline Vec4 sobol_4d(std::uint32_t index, std::uint64_t h, std::uint64_t h2) noexcept {
  const std::uint32_t shuffled = scramble_reversed(reverse_bits(index), low_word(h));
  const Floats<4> u = scrambled(sobol_reversed(shuffled), Words<4>::repeat(sobol_seeds(h, h2)));
  return {u.v[0], u.v[1], u.v[2], u.v[3]};
}
/// Those of N paths, from indices with reversed bits.
template <std::size_t N>
Vec4s<N> sobol_4d_reversed(Words<N> index_reversed, Hashes<N> h, Hashes<N> h2) {
  alignas(32) std::uint32_t shuffled[N];
  store(shuffled, scramble_reversed(index_reversed, low_word(h)));
  alignas(16) std::int32_t points[N][4];
  const std::int32_t* rows[N];
  for (std::size_t k = 0; k < N; ++k) {
    store(points[k], ints_of(sobol_reversed(shuffled[k])));
    rows[k] = points[k];
  }
  Ints<N> columns[4];
  transpose(rows, columns);
  const auto seeds = sobol_seeds(h, h2);
  const auto number = [&](std::size_t d) { return scrambled(words_of(columns[d]), seeds[d]); };
  return {number(0), number(1), number(2), number(3)};
}
/// Computes only their first two dimensions, without the table.
template <std::size_t N>
[[gnu::always_inline]] inline Vec4s<N> sobol_2d_reversed(Words<N> index_reversed, Hashes<N> h) {
  const Words<N> index = reverse_bits(scramble_reversed(index_reversed, low_word(h)));
  const auto seeds = sobol_seeds(h, h);
  return {scrambled(index, seeds[0]), scrambled(second_reversed(index), seeds[1]), 0, 0};
}

/// Returns the dimensions of a point as the numbers of a group. U: Vec4 or Vec4s<N>.
template <typename U>
U arranged(const U& u, int group) noexcept {
  return is_of_bsdf(group) ? U{u.z, u.x, u.y, u.w} : u;
}

/// Selects which of the four numbers of a group are drawn.
enum class Drawn {
  kAll,
  kPair,  ///< the two that PathSampler draws first
};

/// PathSampler::get_4d() with sobol, of N paths; numbers that are not drawn are 0. base,
/// index_reversed: from the PathSamplers, the index with reversed bits.
template <std::size_t N>
Vec4s<N> sobol_numbers(Hashes<N> base, Words<N> index_reversed, int group, Drawn drawn) {
  const Hashes<N> h = hash_combine(base, static_cast<std::uint64_t>(group));
  return arranged(drawn == Drawn::kPair ? sobol_2d_reversed(index_reversed, h)
                                        : sobol_4d_reversed(index_reversed, h, second_hash(h)),
                  group);
}

}  // namespace core
