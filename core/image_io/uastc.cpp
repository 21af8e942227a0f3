#include "core/image_io/uastc.h"

#include <algorithm>

#include "core/image_io/bit_reader.h"

namespace core {
namespace {

/// Encoding of endpoint values: `bits`, plus a trit, a quint or neither.
enum class Part : std::uint8_t { kNone, kTrit, kQuint };
struct Range {
  std::uint32_t bits;
  Part part;
};

/// The list that a mode's partition indexes.
enum class Patterns : std::uint8_t { kNone, kTwo, kThree, kTwoOfThree };

struct Mode {
  std::uint8_t code;  ///< first bit lowest
  std::uint8_t code_bits;
  std::uint8_t hint_bits;  ///< for transcoders; follow the code
  std::uint8_t components;
  std::uint8_t planes;
  std::uint8_t weight_bits;
  Range range;
  Patterns patterns;
};

constexpr Range k12 = {2, Part::kTrit};
constexpr Range k16 = {4, Part::kNone};
constexpr Range k32 = {5, Part::kNone};
constexpr Range k40 = {3, Part::kQuint};
constexpr Range k48 = {4, Part::kTrit};
constexpr Range k160 = {5, Part::kQuint};
constexpr Range k192 = {6, Part::kTrit};
constexpr Range k256 = {8, Part::kNone};

constexpr std::size_t kSolid = 8;
constexpr std::size_t kWithoutSelector = 17;  ///< of two planes; the second is alpha
constexpr std::array<Mode, 19> kModes = {{
    {0x01, 4, 15, 3, 1, 4, k192, Patterns::kNone},
    {0x35, 6, 15, 3, 1, 2, k256, Patterns::kNone},
    {0x1D, 5, 15, 3, 1, 3, k16, Patterns::kTwo},
    {0x03, 5, 15, 3, 1, 2, k12, Patterns::kThree},
    {0x13, 5, 15, 3, 1, 2, k40, Patterns::kTwo},
    {0x0B, 5, 15, 3, 1, 3, k256, Patterns::kNone},
    {0x1B, 5, 15, 3, 2, 2, k160, Patterns::kNone},
    {0x07, 5, 15, 3, 1, 2, k40, Patterns::kTwoOfThree},
    {0x17, 5, 0, 4, 1, 0, k256, Patterns::kNone},
    {0x0F, 5, 23, 4, 1, 2, k16, Patterns::kTwo},
    {0x02, 3, 17, 4, 1, 4, k48, Patterns::kNone},
    {0x00, 2, 17, 4, 2, 2, k48, Patterns::kNone},
    {0x06, 3, 17, 4, 1, 3, k192, Patterns::kNone},
    {0x1F, 5, 23, 4, 2, 1, k256, Patterns::kNone},
    {0x0D, 5, 23, 4, 1, 2, k256, Patterns::kNone},
    {0x05, 7, 23, 2, 1, 4, k256, Patterns::kNone},
    {0x15, 6, 23, 2, 1, 2, k256, Patterns::kTwo},
    {0x25, 6, 23, 2, 2, 2, k256, Patterns::kNone},
    {0x09, 4, 15, 3, 1, 5, k32, Patterns::kNone},
}};

/// Seeds of ASTC's partitions, in the order of the specification's tables.
constexpr std::array<std::uint16_t, 30> kTwoSeeds = {
    28, 20,  16,  29, 91,  9,   107, 72,  149, 204, 50,  114, 496, 17,  78,
    39, 252, 828, 43, 156, 116, 210, 476, 273, 684, 359, 246, 195, 694, 524};
constexpr std::array<std::uint16_t, 11> kThreeSeeds = {260, 74, 32,  156, 183, 15,
                                                       745, 0,  335, 902, 254};
constexpr std::array<std::uint16_t, 19> kTwoOfThreeSeeds = {
    36, 48, 61, 137, 161, 183, 226, 281, 302, 307, 479, 495, 593, 594, 605, 799, 812, 988, 993};

std::span<const std::uint16_t> seeds_of(Patterns patterns) {
  switch (patterns) {
    case Patterns::kTwo:
      return kTwoSeeds;
    case Patterns::kThree:
      return kThreeSeeds;
    case Patterns::kTwoOfThree:
      return kTwoOfThreeSeeds;
    case Patterns::kNone:
      break;
  }
  return {};
}

std::size_t subsets_of(Patterns patterns) {
  return patterns == Patterns::kNone ? 1 : patterns == Patterns::kThree ? 3 : 2;
}

/// Data Format Specification 1.3, 23.21: hash52().
std::uint32_t mixed(std::uint32_t p) {
  p ^= p >> 15U;
  p -= p << 17U;
  p += p << 7U;
  p += p << 4U;
  p ^= p >> 5U;
  p += p << 16U;
  p ^= p >> 7U;
  p ^= p >> 3U;
  p ^= p << 6U;
  p ^= p >> 17U;
  return p;
}

/// Returns the subset of each texel of a 4 x 4 block: the same section, select_partition().
using Subsets = std::array<std::uint8_t, 16>;
Subsets partition(std::uint32_t seed, std::size_t count) {
  const std::uint32_t number = mixed(seed + (static_cast<std::uint32_t>(count) - 1) * 1024);
  std::array<std::uint32_t, 6> s{};
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    const std::uint32_t nibble = (number >> (4 * i)) & 15U;
    s[i] = nibble * nibble;
  }
  const std::uint32_t other = count == 3 ? 6 : 5;
  const std::uint32_t own = (seed & 2U) != 0 ? 4 : 5;
  const bool odd = (seed & 1U) != 0;
  for (std::uint32_t i = 0; i < s.size(); ++i) {
    s[i] >>= (i % 2 == 0) == odd ? own : other;
  }
  Subsets subsets{};
  for (std::uint32_t i = 0; i < subsets.size(); ++i) {
    const std::uint32_t x = 2 * (i % 4);  // coordinates count double in blocks of less than 31
                                          // texels
    const std::uint32_t y = 2 * (i / 4);
    const std::uint32_t a = (s[0] * x + s[1] * y + (number >> 14U)) & 63U;
    const std::uint32_t b = (s[2] * x + s[3] * y + (number >> 10U)) & 63U;
    const std::uint32_t c = count < 3 ? 0 : (s[4] * x + s[5] * y + (number >> 6U)) & 63U;
    subsets[i] = a >= b && a >= c ? 0 : b >= c ? 1 : 2;
  }
  return subsets;
}

/// Data Format Specification 1.3, 23.13.
std::uint8_t unquantized(Range range, std::uint32_t part, std::uint32_t bits) {
  if (range.part == Part::kNone) {
    // Replicates the bits from the highest down.
    const std::uint32_t high = bits << (8 - range.bits);
    return static_cast<std::uint8_t>(high | high >> range.bits);
  }
  const std::uint32_t x = bits >> 1U;
  std::uint32_t b = 0;
  std::uint32_t c = 0;
  if (range.part == Part::kTrit) {
    c = range.bits == 2 ? 93 : range.bits == 4 ? 22 : 5;
    b = range.bits == 2   ? x << 8U | x << 4U | x << 2U | x << 1U
        : range.bits == 4 ? x << 6U | x
                          : x << 4U | x >> 4U;
  } else {
    c = range.bits == 3 ? 26 : 6;
    b = range.bits == 3 ? x << 7U | x << 1U | x >> 1U : x << 5U | x >> 3U;
  }
  const std::uint32_t a = (bits & 1U) != 0 ? 0x1FF : 0;
  const std::uint32_t t = (part * c + b) ^ a;
  return static_cast<std::uint8_t>((a & 0x80U) | t >> 2U);
}

/// Three subsets of two endpoints of RGB, or fewer of RGBA.
constexpr std::size_t kEndpointsMax = 18;
using Endpoints = std::array<std::uint8_t, kEndpointsMax>;

Endpoints read_endpoints(BitReader& bits, Range range, std::size_t count) {
  std::array<std::uint32_t, kEndpointsMax> parts{};
  const bool trits = range.part == Part::kTrit;
  const std::uint32_t base = trits ? 3 : 5;
  const std::size_t group = trits ? 5 : 3;
  // Bits of a group of n values: those of base^n - 1.
  constexpr std::array<std::uint32_t, 6> kTritBits = {0, 2, 4, 5, 7, 8};
  constexpr std::array<std::uint32_t, 4> kQuintBits = {0, 3, 5, 7};
  for (std::size_t i = 0; range.part != Part::kNone && i < count; i += group) {
    const std::size_t values = std::min(group, count - i);
    std::uint32_t packed = bits.read(trits ? kTritBits[values] : kQuintBits[values]);
    for (std::size_t v = 0; v < values; ++v) {
      parts[i + v] = packed % base;
      packed /= base;
    }
  }
  Endpoints endpoints{};
  for (std::size_t i = 0; i < count; ++i) {
    endpoints[i] = unquantized(range, parts[i], bits.read(range.bits));
  }
  return endpoints;
}

/// Data Format Specification 1.3, 23.17: out of 64.
std::uint32_t weight_of(std::uint32_t index, std::uint32_t bits) {
  std::uint32_t weight = index;
  switch (bits) {
    case 1:
      weight = index * 63;
      break;
    case 2:
      weight = index << 4U | index << 2U | index;
      break;
    case 3:
      weight = index << 3U | index;
      break;
    case 4:
      weight = index << 2U | index >> 2U;
      break;
    default:
      weight = index << 1U | index >> 4U;
      break;
  }
  return weight + (weight > 32 ? 1 : 0);
}

using Weights = std::array<std::array<std::uint32_t, 2>, 16>;

/// The first texel of each subset omits its highest bit, which is 0.
Weights read_weights(BitReader& bits, const Mode& mode, const Subsets& subsets) {
  Weights weights{};
  std::array<bool, 3> seen{};
  for (std::size_t texel = 0; texel < weights.size(); ++texel) {
    const bool is_first = !seen[subsets[texel]];
    seen[subsets[texel]] = true;
    for (std::size_t plane = 0; plane < mode.planes; ++plane) {
      const std::uint32_t index = bits.read(mode.weight_bits - (is_first ? 1U : 0U));
      weights[texel][plane] = weight_of(index, mode.weight_bits);
    }
  }
  return weights;
}

/// Data Format Specification 1.3, 23.19, without the sRGB variant.
std::uint8_t between(std::uint32_t low, std::uint32_t high, std::uint32_t weight) {
  return static_cast<std::uint8_t>((low * 257 * (64 - weight) + high * 257 * weight + 32) >> 14U);
}

UastcTexels solid(BitReader& bits) {
  const auto byte = [&bits] { return static_cast<std::uint8_t>(bits.read(8)); };
  UastcTexels texels;
  texels.fill({byte(), byte(), byte(), byte()});
  return texels;
}

const Mode* read_mode(BitReader& bits) {
  for (const Mode& mode : kModes) {
    if (bits.peek(mode.code_bits) == mode.code) {
      bits.skip(mode.code_bits);
      return &mode;
    }
  }
  return nullptr;
}

}  // namespace

std::optional<UastcTexels> decode_uastc_block(std::span<const std::byte, kUastcBlockBytes> block) {
  BitReader bits(block);
  const Mode* const mode = read_mode(bits);
  if (mode == nullptr) {
    return std::nullopt;
  }
  if (mode == &kModes[kSolid]) {
    return solid(bits);
  }
  bits.read(mode->hint_bits / 2U);
  bits.read(mode->hint_bits - mode->hint_bits / 2U);
  Subsets subsets{};
  const std::size_t subset_count = subsets_of(mode->patterns);
  if (mode->patterns != Patterns::kNone) {
    const auto seeds = seeds_of(mode->patterns);
    const std::uint32_t pattern = bits.read(subset_count == 3 ? 4 : 5);
    if (pattern >= seeds.size()) {
      return std::nullopt;
    }
    subsets = partition(seeds[pattern], subset_count);
  }
  const bool has_selector = mode->planes == 2 && mode != &kModes[kWithoutSelector];
  const std::size_t second_plane = has_selector ? bits.read(2) : 3;
  const std::size_t values = std::size_t{2} * mode->components;
  const Endpoints endpoints = read_endpoints(bits, mode->range, values * subset_count);
  const Weights weights = read_weights(bits, *mode, subsets);
  UastcTexels texels{};
  for (std::size_t i = 0; i < texels.size(); ++i) {
    for (std::size_t c = 0; c < 4; ++c) {
      // Two components are luminance, for red, green and blue, and alpha.
      const std::size_t from = mode->components == 2 ? c / 3 : c;
      const std::size_t at = values * subsets[i] + 2 * from;
      const std::size_t plane = mode->planes == 2 && c == second_plane ? 1 : 0;
      texels[i][c] = from >= mode->components
                         ? std::uint8_t{255}
                         : between(endpoints[at], endpoints[at + 1], weights[i][plane]);
    }
  }
  return texels;
}

}  // namespace core
