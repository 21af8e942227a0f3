/// The random numbers of N paths at once: PathSampler::sobol_4d() in lanes, bit for bit.
#pragma once

#include "core/math/lane_math.h"
#include "core/samplers/path_sampler.h"

namespace core {

template <std::size_t N>
struct Vec4s {
  Floats<N> x, y, z, w;
};

/// N 64-bit hashes, in groups of four for AVX2 registers.
template <std::size_t N>
struct Hashes {
  typedef std::uint64_t Half __attribute__((vector_size(N == 8 ? 32 : 8)));
  static constexpr std::size_t kHalves = N == 8 ? 2 : 1;
  Half half[kHalves];

  static Hashes load(const std::uint64_t* p) {
    Hashes out;
    std::memcpy(&out, p, sizeof(out));
    return out;
  }
  template <typename F>
  Hashes each(F&& f) const {
    Hashes out;
    for (std::size_t k = 0; k < kHalves; ++k) {
      out.half[k] = f(half[k]);
    }
    return out;
  }
  Words<N> low() const { return words<0x88, 0>(); }
  Words<N> high() const { return words<0xdd, 32>(); }

 private:
  template <int kShuffle, int kShift>
  Words<N> words() const {
    if constexpr (N == 8) {
      const __m256 both = _mm256_shuffle_ps(reinterpret_cast<__m256>(half[0]),
                                            reinterpret_cast<__m256>(half[1]), kShuffle);
      return reinterpret_cast<typename Words<N>::Raw>(
          _mm256_permute4x64_epi64(reinterpret_cast<__m256i>(both), 0xd8));
    } else {
      return Words<N>(static_cast<std::uint32_t>(half[0][0] >> kShift));
    }
  }
};

template <std::size_t N>
void compress(std::uint64_t* to, Hashes<N> values, unsigned taken) {
  std::uint64_t all[N];
  std::memcpy(all, &values, sizeof all);
  for (; taken != 0; taken &= taken - 1) {
    *to++ = all[std::countr_zero(taken)];
  }
}

/// As in core/samplers/hash.h.
template <std::size_t N>
Hashes<N> mix_bits(Hashes<N> h) {
  return h.each([](auto x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
    return x ^ (x >> 31);
  });
}

template <std::size_t N>
Hashes<N> hash_combine(Hashes<N> a, std::uint64_t b) {
  const std::uint64_t step = 0x9e3779b97f4a7c15ULL * (b + 1);
  return mix_bits<N>(a.each([step](auto x) { return x + step; }));
}

template <std::size_t N>
Words<N> scramble_reversed(Words<N> x, Words<N> seed) {
  x = x ^ x * Words<N>(0x3d20adeaU);
  x = x + seed;
  x = x * ((seed >> 16) | Words<N>(1));
  x = x ^ x * Words<N>(0x05526c56U);
  return x ^ x * Words<N>(0x53a22864U);
}

template <std::size_t N>
Words<N> reverse_bits(Words<N> x) {
  if constexpr (N == 8) {
    // Reverses the bytes with a shuffle, then each byte through its two nibbles.
    const __m256i bytes = _mm256_broadcastsi128_si256(
        _mm_set_epi8(12, 13, 14, 15, 8, 9, 10, 11, 4, 5, 6, 7, 0, 1, 2, 3));
    const __m256i table = _mm256_broadcastsi128_si256(
        _mm_set_epi8(15, 7, 11, 3, 13, 5, 9, 1, 14, 6, 10, 2, 12, 4, 8, 0));
    const __m256i nibble = _mm256_set1_epi8(15);
    const __m256i y = _mm256_shuffle_epi8(reinterpret_cast<__m256i>(x.v), bytes);
    const __m256i low = _mm256_shuffle_epi8(table, _mm256_and_si256(y, nibble));
    const __m256i high =
        _mm256_shuffle_epi8(table, _mm256_and_si256(_mm256_srli_epi32(y, 4), nibble));
    return reinterpret_cast<typename Words<N>::Raw>(
        _mm256_or_si256(_mm256_slli_epi32(low, 4), high));
  } else {
    return Words<N>(reverse_bits(x.v[0]));
  }
}

/// Converts to [0,1) with 24 bits.
template <std::size_t N>
Floats<N> to_unit_floats(Words<N> bits) {
  const Ints<N> upper = reinterpret_cast<typename Ints<N>::Raw>((bits >> 8).v);
  return to_floats(upper) * Floats<N>(0x1p-24F);
}

/// Converts one dimension of a point, given with reversed bits, to a number.
template <std::size_t N>
Floats<N> scrambled(Words<N> reversed, Words<N> seed) {
  return to_unit_floats<N>(reverse_bits<N>(scramble_reversed<N>(reversed, seed)));
}

/// Computes only the first two dimensions of sobol_4d(), without its table: reversed, the first is
/// the index, and the second follows from it as in core/samplers/sobol_tables.cpp.
template <std::size_t N>
Vec2s<N> sobol_2d(Hashes<N> base, Words<N> index_reversed, int group) {
  const Hashes<N> h = hash_combine<N>(base, static_cast<std::uint64_t>(group));
  const Hashes<N> h0 = h.each([](auto x) { return x * 0xd1342543de82ef95ULL; });
  const Words<N> index = reverse_bits<N>(scramble_reversed<N>(index_reversed, h.low()));
  Words<N> x = index;
  x = x ^ ((x >> 1) & Words<N>(0x55555555U));
  x = x ^ ((x >> 2) & Words<N>(0x33333333U));
  x = x ^ ((x >> 4) & Words<N>(0x0f0f0f0fU));
  x = x ^ ((x >> 8) & Words<N>(0x00ff00ffU));
  x = x ^ ((x >> 16) & Words<N>(0x0000ffffU));
  return {scrambled<N>(index, h0.high()), scrambled<N>(x, h.high())};
}

/// Draws four numbers of `group` for each path, by dimension. base, index_reversed: from the
/// PathSamplers, the index with reversed bits.
template <std::size_t N>
Vec4s<N> sobol_4d(Hashes<N> base, Words<N> index_reversed, int group) {
  const Hashes<N> h = hash_combine<N>(base, static_cast<std::uint64_t>(group));
  const Hashes<N> h2 = mix_bits<N>(h.each([](auto x) { return x + 0x632be59bd9b4e019ULL; }));
  const Hashes<N> h0 = h.each([](auto x) { return x * 0xd1342543de82ef95ULL; });
  alignas(32) std::uint32_t shuffled[N];
  store(shuffled, scramble_reversed<N>(index_reversed, h.low()));
  alignas(16) float point[N][4];  // bits, not numbers
  const float* rows[N];
  for (std::size_t k = 0; k < N; ++k) {
    const auto entry = [&](int byte) {
      return _mm_load_si128(reinterpret_cast<const __m128i*>(
          &kSobolTables.entry[byte][(shuffled[k] >> (8 * byte)) & 255U]));
    };
    _mm_store_si128(
        reinterpret_cast<__m128i*>(point[k]),
        _mm_xor_si128(_mm_xor_si128(entry(0), entry(1)), _mm_xor_si128(entry(2), entry(3))));
    rows[k] = point[k];
  }
  Floats<N> columns[4];
  transpose(rows, columns);
  const auto number = [](Floats<N> column, Words<N> seed) {
    return scrambled<N>(reinterpret_cast<typename Words<N>::Raw>(column.v), seed);
  };
  return {number(columns[0], h0.high()), number(columns[1], h.high()), number(columns[2], h2.low()),
          number(columns[3], h2.high())};
}

/// Selects which of the four numbers of a group are drawn.
enum class Drawn {
  kAll,
  kPair,  ///< the two that PathSampler draws first
};

/// PathSampler::get_4d() with sobol; numbers that are not drawn are 0.
template <std::size_t N>
Vec4s<N> sobol_numbers(Hashes<N> base, Words<N> index_reversed, int group, Drawn drawn) {
  Vec4s<N> u = {0, 0, 0, 0};
  if (drawn == Drawn::kPair) {
    const Vec2s<N> pair = sobol_2d<N>(base, index_reversed, group);
    u.x = pair.x;
    u.y = pair.y;
  } else {
    u = sobol_4d<N>(base, index_reversed, group);
  }
  return is_of_bsdf(group) ? Vec4s<N>{u.z, u.x, u.y, u.w} : u;
}

}  // namespace core
