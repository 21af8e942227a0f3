#include "core/samplers/halton.h"

#include <algorithm>
#include <array>

#include "core/samplers/dimensions.h"
#include "core/samplers/hash.h"
#include "core/samplers/permutation.h"
#include "core/samplers/sobol.h"

namespace core {
namespace {

struct Base {
  std::uint32_t b = 2;
  std::uint32_t digits = 0;   ///< smallest n with b^n >= kHaltonPointsMax
  std::uint32_t inverse = 0;  ///< ceil(2^32 / b): quotients are exact for numbers below 2^32 / b
  double scale = 1;           ///< b^-digits
};

constexpr std::uint32_t quotient(std::uint32_t n, const Base& base) {
  return static_cast<std::uint32_t>((static_cast<std::uint64_t>(n) * base.inverse) >> 32);
}

constexpr std::array<Base, kHaltonDimensions> make_bases() {
  std::array<Base, kHaltonDimensions> bases{};
  std::size_t found = 0;
  for (std::uint32_t n = 2; found < bases.size(); ++n) {
    bool prime = true;
    for (std::size_t k = 0; k < found; ++k) {
      prime = prime && n % bases[k].b != 0;
    }
    if (!prime) {
      continue;
    }
    Base& base = bases[found++];
    base.b = n;
    base.inverse = static_cast<std::uint32_t>(((std::uint64_t{1} << 32) + n - 1) / n);
    for (std::uint64_t power = 1; power < kHaltonPointsMax; power *= n) {
      ++base.digits;
      base.scale /= n;
    }
  }
  return bases;
}

constexpr std::array<Base, kHaltonDimensions> kBases = make_bases();

constexpr int kFilmX = 0;
constexpr int kFilmY = 1;
constexpr int kLensX = 6;
constexpr int kLensY = 7;
constexpr int kPerBounce = 6;

}  // namespace

std::uint32_t halton_base(int d) noexcept { return kBases[static_cast<std::size_t>(d)].b; }

float halton_1d(int d, std::uint32_t index, std::uint64_t key) noexcept {
  if (d == 0) {
    // Base 2: the bits reversed and scrambled, as for the first dimension of Sobol's sequence.
    return scrambled(index, high_word(key));
  }
  const Base& base = kBases[static_cast<std::size_t>(d)];
  std::uint64_t prefix = key;  // a hash of the digits so far
  std::uint64_t value = 0;
  std::uint32_t rest = index < (1U << 23) ? index : index % (1U << 23);
  for (std::uint32_t k = 0; k < base.digits; ++k) {
    const std::uint32_t next = quotient(rest, base);
    const std::uint32_t digit = rest - next * base.b;
    const std::uint64_t r = mix_bits(prefix + 0x9e3779b97f4a7c15ULL);
    const std::uint32_t image =
        digit * (1 + to_range(low_word(r), base.b - 1)) + to_range(high_word(r), base.b);
    value = value * base.b + (image - quotient(image, base) * base.b);
    prefix = r ^ (std::uint64_t{digit} * 0xd1342543de82ef95ULL);
    rest = next;
  }
  // Further digits belong to this point alone: uniform.
  const std::uint64_t tail = hash_combine(prefix, index);
  const double x =
      (static_cast<double>(value) + static_cast<double>(tail >> 11) * 0x1p-53) * base.scale;
  // Rounds down to a float of 24 bits, which is never 1.
  return static_cast<float>(static_cast<std::uint32_t>(std::min(x, 0x1.ffffffp-1) * 0x1p24)) *
         0x1p-24F;
}

int halton_dimension(int group, int component) noexcept {
  if (group == kCameraGroup) {
    constexpr std::array kCamera = {kFilmX, kFilmY, kLensX, kLensY};
    return kCamera[static_cast<std::size_t>(component)];
  }
  constexpr int kGroups = static_cast<int>(BounceGroup::kCount);
  const int bounce = (group - 1) / kGroups;
  const auto kind = static_cast<BounceGroup>((group - 1) % kGroups);
  if (kind == BounceGroup::kVolume || component == 3) {
    return -1;
  }
  // Before the lens: light y, z, BSDF y, z of bounce 0; after it, light x and BSDF x.
  const int which = kind == BounceGroup::kLight ? 0 : 1;
  const int place = component == 0 ? 4 + which : 2 * which + component - 1;
  const int d = bounce == 0 ? (place < 4 ? 2 + place : 4 + place) : 4 + kPerBounce * bounce + place;
  return d < kHaltonDimensions ? d : -1;
}

Vec4 halton_4d(int group, std::uint32_t index, std::uint64_t h, std::uint64_t h2) noexcept {
  const auto at = [&](int component, std::uint64_t key) {
    const int d = halton_dimension(group, component);
    return d < 0 ? to_unit_float(high_word(hash_combine(key, index))) : halton_1d(d, index, key);
  };
  return {at(0, h), at(1, h2), at(2, hash_combine(h, h2)), at(3, hash_combine(h2, h))};
}

}  // namespace core
