/// Lanes: SIMD vectors of N floats, integers or booleans.
///
/// A thin wrapper of the compiler's vector extensions. Code that uses them is the same for any N; 8
/// is an AVX2 register or two of NEON, 4 one of SSE or NEON, 1 is for tests. A lane never depends
/// on others.
#pragma once

#include <array>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "core/math/intrinsics.h"

namespace core {

/// float __attribute__((vector_size)) and the like for N = 8, 4 and 1.
template <std::size_t N>
struct RawLanes;
template <>
struct RawLanes<8> {
  typedef float Floats __attribute__((vector_size(32)));
  typedef std::int32_t Ints __attribute__((vector_size(32)));
  typedef std::uint32_t Words __attribute__((vector_size(32)));
};
template <>
struct RawLanes<4> {
  typedef float Floats __attribute__((vector_size(16)));
  typedef std::int32_t Ints __attribute__((vector_size(16)));
  typedef std::uint32_t Words __attribute__((vector_size(16)));
};
template <>
struct RawLanes<1> {
  typedef float Floats __attribute__((vector_size(4)));
  typedef std::int32_t Ints __attribute__((vector_size(4)));
  typedef std::uint32_t Words __attribute__((vector_size(4)));
};

/// Booleans: all bits of a lane are set, or none.
template <std::size_t N>
struct Mask {
  using Raw = typename RawLanes<N>::Ints;
  Raw v;

  friend Mask operator&(Mask a, Mask b) { return {a.v & b.v}; }
  friend Mask operator|(Mask a, Mask b) { return {a.v | b.v}; }
  friend Mask operator~(Mask a) { return {~a.v}; }
  /// Returns one bit per lane, with lane 0 the lowest.
  unsigned bits() const {
    if constexpr (N == 8) {
      return static_cast<unsigned>(_mm256_movemask_ps(reinterpret_cast<__m256>(v)));
    } else if constexpr (N == 4) {
      return static_cast<unsigned>(_mm_movemask_ps(reinterpret_cast<__m128>(v)));
    } else {
      return static_cast<unsigned>(v[0]) & 1U;
    }
  }
  bool any() const { return bits() != 0; }
  bool all() const { return bits() == (1U << N) - 1; }
  /// Returns a mask of the lanes whose bit is set.
  static Mask of(unsigned bits) {
    Raw bit;
    for (std::size_t k = 0; k < N; ++k) {
      bit[k] = 1 << k;
    }
    return {((Raw{} + static_cast<std::int32_t>(bits)) & bit) != 0};
  }
};

template <std::size_t N>
struct Words {
  using Raw = typename RawLanes<N>::Words;
  Raw v;

  Words() = default;
  Words(Raw raw) : v(raw) {}
  Words(std::uint32_t x) : v(x - Raw{}) {}
  static Words repeat(std::array<std::uint32_t, 4> four) {
    Words out;
    for (std::size_t k = 0; k < N; ++k) {
      out.v[k] = four[k % 4];
    }
    return out;
  }
  friend Words operator^(Words a, Words b) { return a.v ^ b.v; }
  friend Words operator&(Words a, Words b) { return a.v & b.v; }
  friend Words operator|(Words a, Words b) { return a.v | b.v; }
  friend Words operator+(Words a, Words b) { return a.v + b.v; }
  friend Words operator*(Words a, Words b) { return a.v * b.v; }
  friend Words operator>>(Words a, int by) { return a.v >> by; }
  friend Words operator<<(Words a, int by) { return a.v << by; }
};

/// N unsigned integers of 64 bits, in groups of four for AVX2 registers.
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
  friend Hashes operator^(Hashes a, Hashes b) {
    return each([&](std::size_t k) { return a.half[k] ^ b.half[k]; });
  }
  friend Hashes operator+(Hashes a, std::uint64_t b) {
    return each([&](std::size_t k) { return a.half[k] + b; });
  }
  friend Hashes operator*(Hashes a, std::uint64_t b) {
    return each([&](std::size_t k) { return a.half[k] * b; });
  }
  friend Hashes operator>>(Hashes a, int by) {
    return each([&](std::size_t k) { return a.half[k] >> by; });
  }
  friend Words<N> low_word(Hashes h) { return h.template words<0x88, 0>(); }
  friend Words<N> high_word(Hashes h) { return h.template words<0xdd, 32>(); }

 private:
  template <typename F>
  static Hashes each(F&& f) {
    Hashes out;
    for (std::size_t k = 0; k < kHalves; ++k) {
      out.half[k] = f(k);
    }
    return out;
  }
  template <int kShuffle, int kShift>
  Words<N> words() const {
    if constexpr (N == 8) {
      const __m256 both = _mm256_shuffle_ps(reinterpret_cast<__m256>(half[0]),
                                            reinterpret_cast<__m256>(half[1]), kShuffle);
      return reinterpret_cast<typename Words<N>::Raw>(
          _mm256_permute4x64_epi64(reinterpret_cast<__m256i>(both), 0xd8));
    } else {
      return static_cast<std::uint32_t>(half[0][0] >> kShift);
    }
  }
};

template <std::size_t N>
struct Ints {
  using Raw = typename RawLanes<N>::Ints;
  Raw v;

  Ints() = default;
  Ints(Raw raw) : v(raw) {}
  Ints(std::int32_t x) : v(x - Raw{}) {}
  // Wraps around, because unused lanes hold arbitrary values.
  friend Ints operator+(Ints a, Ints b) { return Ints(a.words() + b.words()); }
  friend Ints operator-(Ints a, Ints b) { return Ints(a.words() - b.words()); }
  friend Ints operator*(Ints a, Ints b) { return Ints(a.words() * b.words()); }
  friend Ints operator>>(Ints a, int bits) { return a.v >> bits; }
  friend Ints operator>>(Ints a, Ints bits) { return a.v >> bits.v; }
  friend Ints operator&(Ints a, Ints b) { return a.v & b.v; }
  friend Ints operator|(Ints a, Ints b) { return a.v | b.v; }
  friend Mask<N> operator==(Ints a, Ints b) { return {a.v == b.v}; }
  friend Mask<N> operator<(Ints a, Ints b) { return {a.v < b.v}; }

 private:
  using RawWords = typename RawLanes<N>::Words;
  explicit Ints(RawWords wrapped) : v(reinterpret_cast<Raw>(wrapped)) {}
  RawWords words() const { return reinterpret_cast<RawWords>(v); }
};

template <std::size_t N>
struct Floats {
  using Raw = typename RawLanes<N>::Floats;
  Raw v;

  Floats() = default;
  Floats(Raw raw) : v(raw) {}
  Floats(float x) : v(x - Raw{}) {}
  friend Floats operator+(Floats a, Floats b) { return a.v + b.v; }
  friend Floats operator-(Floats a, Floats b) { return a.v - b.v; }
  friend Floats operator*(Floats a, Floats b) { return a.v * b.v; }
  friend Floats operator/(Floats a, Floats b) { return a.v / b.v; }
  friend Floats operator-(Floats a) { return -a.v; }
  friend Mask<N> operator<(Floats a, Floats b) { return {a.v < b.v}; }
  friend Mask<N> operator>(Floats a, Floats b) { return {a.v > b.v}; }
  friend Mask<N> operator<=(Floats a, Floats b) { return {a.v <= b.v}; }
  friend Mask<N> operator>=(Floats a, Floats b) { return {a.v >= b.v}; }
  friend Mask<N> operator==(Floats a, Floats b) { return {a.v == b.v}; }
};

template <std::size_t N>
Ints<N> bits_of(Floats<N> x) {
  return reinterpret_cast<typename Ints<N>::Raw>(x.v);
}
template <std::size_t N>
Floats<N> floats_of(Ints<N> x) {
  return reinterpret_cast<typename Floats<N>::Raw>(x.v);
}
template <std::size_t N>
Floats<N> to_floats(Ints<N> x) {
  return __builtin_convertvector(x.v, typename Floats<N>::Raw);
}
template <std::size_t N>
Ints<N> ints_of(Words<N> x) {
  return reinterpret_cast<typename Ints<N>::Raw>(x.v);
}
/// Pre: x < 2^31.
template <std::size_t N>
Floats<N> to_floats(Words<N> x) {
  return to_floats(ints_of(x));
}
template <std::size_t N>
Words<N> words_of(Ints<N> x) {
  return reinterpret_cast<typename Words<N>::Raw>(x.v);
}
/// Rounds towards zero. Pre: |x| < 2^31.
template <std::size_t N>
Ints<N> truncated(Floats<N> x) {
  return __builtin_convertvector(x.v, typename Ints<N>::Raw);
}

template <std::size_t N>
Floats<N> select(Mask<N> mask, Floats<N> yes, Floats<N> no) {
  return mask.v ? yes.v : no.v;
}
template <std::size_t N>
Ints<N> select(Mask<N> mask, Ints<N> yes, Ints<N> no) {
  return mask.v ? yes.v : no.v;
}
/// As std::min and std::max; returns b if a is NaN.
template <std::size_t N>
Floats<N> min(Floats<N> a, Floats<N> b) {
  if constexpr (N == 8) {
    return typename Floats<N>::Raw(_mm256_min_ps(a.v, b.v));
  } else if constexpr (N == 4) {
    return typename Floats<N>::Raw(_mm_min_ps(a.v, b.v));
  } else {
    return a.v < b.v ? a.v : b.v;
  }
}
template <std::size_t N>
Floats<N> max(Floats<N> a, Floats<N> b) {
  if constexpr (N == 8) {
    return typename Floats<N>::Raw(_mm256_max_ps(a.v, b.v));
  } else if constexpr (N == 4) {
    return typename Floats<N>::Raw(_mm_max_ps(a.v, b.v));
  } else {
    return a.v > b.v ? a.v : b.v;
  }
}
template <std::size_t N>
Floats<N> sqrt(Floats<N> x) {
  if constexpr (N == 8) {
    return typename Floats<N>::Raw(_mm256_sqrt_ps(x.v));
  } else if constexpr (N == 4) {
    return typename Floats<N>::Raw(_mm_sqrt_ps(x.v));
  } else {
    return Floats<N>(std::sqrt(x.v[0]));
  }
}
/// Returns a b + c, rounded once.
template <std::size_t N>
Floats<N> fused(Floats<N> a, Floats<N> b, Floats<N> c) {
  if constexpr (N == 8) {
    return typename Floats<N>::Raw(_mm256_fmadd_ps(a.v, b.v, c.v));
  } else {
    Floats<N> out;
    for (std::size_t k = 0; k < N; ++k) {
      out.v[k] = std::fma(a.v[k], b.v[k], c.v[k]);
    }
    return out;
  }
}
template <std::size_t N>
Floats<N> safe_sqrt(Floats<N> x) {
  return sqrt(max(x, Floats<N>(0)));
}
template <std::size_t N>
Floats<N> abs(Floats<N> x) {
  return floats_of(Ints<N>(bits_of(x) & Ints<N>(0x7fffffff)));
}
template <std::size_t N>
Mask<N> is_finite(Floats<N> x) {
  return abs(x) < Floats<N>(__builtin_inff());
}

template <std::size_t N>
Floats<N> load(const float* p) {
  Floats<N> out;
  std::memcpy(&out.v, p, sizeof(out.v));
  return out;
}
template <std::size_t N>
Ints<N> load(const std::int32_t* p) {
  Ints<N> out;
  std::memcpy(&out.v, p, sizeof(out.v));
  return out;
}
template <std::size_t N>
Words<N> load(const std::uint32_t* p) {
  Words<N> out;
  std::memcpy(&out.v, p, sizeof(out.v));
  return out;
}
template <std::size_t N>
void store(float* p, Floats<N> x) {
  std::memcpy(p, &x.v, sizeof(x.v));
}
template <std::size_t N>
void store(std::int32_t* p, Ints<N> x) {
  std::memcpy(p, &x.v, sizeof(x.v));
}
template <std::size_t N>
void store(std::uint32_t* p, Words<N> x) {
  std::memcpy(p, &x.v, sizeof(x.v));
}

/// For each set of lanes, the permutation that moves them to the front.
struct CompressTable {
  alignas(32) std::int32_t order[256][8];
  constexpr CompressTable() : order{} {
    for (int set = 0; set < 256; ++set) {
      int to = 0;
      for (int k = 0; k < 8; ++k) {
        if ((set >> k & 1) != 0) {
          order[set][to++] = k;
        }
      }
    }
  }
};
inline constexpr CompressTable kCompress{};

/// Writes the lanes of `taken` contiguously to `p`; the rest of the N elements is unspecified.
template <std::size_t N>
void compress(std::int32_t* p, Ints<N> x, unsigned taken) {
  static_assert(N == 8 || N == 1);
  if constexpr (N == 8) {
    const __m256i order =
        _mm256_load_si256(reinterpret_cast<const __m256i*>(kCompress.order[taken]));
    const __m256i closed = _mm256_permutevar8x32_epi32(reinterpret_cast<__m256i>(x.v), order);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(p), closed);
  } else if (taken != 0) {
    *p = x.v[0];
  }
}
template <std::size_t N>
void compress(std::uint32_t* p, Words<N> x, unsigned taken) {
  compress<N>(reinterpret_cast<std::int32_t*>(p), reinterpret_cast<typename Ints<N>::Raw>(x.v),
              taken);
}
template <std::size_t N>
void compress(std::uint64_t* to, Hashes<N> values, unsigned taken) {
  std::uint64_t all[N];
  std::memcpy(all, &values, sizeof all);
  for (; taken != 0; taken &= taken - 1) {
    *to++ = all[std::countr_zero(taken)];
  }
}
template <std::size_t N>
void compress(float* p, Floats<N> x, unsigned taken) {
  alignas(32) std::int32_t closed[N];
  compress<N>(closed, bits_of(x), taken);
  if (N == 8 || taken != 0) {
    std::memcpy(p, closed, sizeof(closed));
  }
}

/// Returns p[index] per lane.
template <std::size_t N>
Floats<N> gather(const float* p, Ints<N> index) {
  if constexpr (N == 8) {
    return typename Floats<N>::Raw(_mm256_i32gather_ps(p, reinterpret_cast<__m256i>(index.v), 4));
  } else {
    Floats<N> out;
    for (std::size_t k = 0; k < N; ++k) {
      out.v[k] = p[index.v[k]];
    }
    return out;
  }
}
template <std::size_t N>
Ints<N> gather(const std::int32_t* p, Ints<N> index) {
  return bits_of(gather(reinterpret_cast<const float*>(p), index));
}

/// Returns the bytes of each four lanes of x that `from` names, from 0 to 15.
template <std::size_t N>
Words<N> shuffle_bytes(Words<N> x, Words<N> from) {
  using Raw = typename Words<N>::Raw;
  if constexpr (N == 8) {
    return reinterpret_cast<Raw>(
        _mm256_shuffle_epi8(reinterpret_cast<__m256i>(x.v), reinterpret_cast<__m256i>(from.v)));
  } else {
    static_assert(N == 4);
    return reinterpret_cast<Raw>(
        _mm_shuffle_epi8(reinterpret_cast<__m128i>(x.v), reinterpret_cast<__m128i>(from.v)));
  }
}

/// Loads four floats per row and transposes them to four vectors of N lanes. Rows need no
/// alignment.
template <std::size_t N>
void transpose(const float* const (&rows)[N], Floats<N> (&columns)[4]) {
  if constexpr (N == 8) {
    __m256 r[4];
    for (std::size_t k = 0; k < 4; ++k) {
      r[k] = _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(rows[k])),
                                  _mm_loadu_ps(rows[k + 4]), 1);
    }
    const __m256 a = _mm256_unpacklo_ps(r[0], r[1]);
    const __m256 b = _mm256_unpackhi_ps(r[0], r[1]);
    const __m256 c = _mm256_unpacklo_ps(r[2], r[3]);
    const __m256 d = _mm256_unpackhi_ps(r[2], r[3]);
    columns[0].v = _mm256_shuffle_ps(a, c, 0x44);
    columns[1].v = _mm256_shuffle_ps(a, c, 0xee);
    columns[2].v = _mm256_shuffle_ps(b, d, 0x44);
    columns[3].v = _mm256_shuffle_ps(b, d, 0xee);
  } else {
    for (std::size_t k = 0; k < 4; ++k) {
      columns[k] = Floats<N>(rows[0][k]);
    }
  }
}

template <std::size_t N>
void transpose(const std::int32_t* const (&rows)[N], Ints<N> (&columns)[4]) {
  if constexpr (N == 8) {
    const float* as_floats[N];
    Floats<N> out[4];
    for (std::size_t k = 0; k < N; ++k) {
      as_floats[k] = reinterpret_cast<const float*>(rows[k]);
    }
    transpose(as_floats, out);
    for (std::size_t k = 0; k < 4; ++k) {
      columns[k] = bits_of(out[k]);
    }
  } else {
    for (std::size_t k = 0; k < 4; ++k) {
      columns[k] = Ints<N>(rows[0][k]);
    }
  }
}

/// Four lanes of a, then four of b.
template <std::size_t N>
Floats<N> load_halves(const float* a, const float* b) {
  static_assert(N == 8);
  return typename Floats<N>::Raw(
      _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(a)), _mm_loadu_ps(b), 1));
}
template <std::size_t N>
Ints<N> load_halves(const std::int32_t* a, const std::int32_t* b) {
  return bits_of(
      load_halves<N>(reinterpret_cast<const float*>(a), reinterpret_cast<const float*>(b)));
}
template <std::size_t N>
Floats<N> halves(float a, float b) {
  static_assert(N == 8);
  return typename Floats<N>::Raw(_mm256_set_m128(_mm_set1_ps(b), _mm_set1_ps(a)));
}

}  // namespace core
