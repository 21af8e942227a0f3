#include "core/color/tone_map.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "core/color/srgb.h"

namespace core {
namespace {

constexpr std::array kToneMaps = {
    ToneMapEntry{"srgb", ToneMap::kSrgb},
    ToneMapEntry{"linear", ToneMap::kLinear},
    ToneMapEntry{"aces", ToneMap::kAces},
    ToneMapEntry{"agx", ToneMap::kAgx},
    ToneMapEntry{"khronos-neutral", ToneMap::kKhronosNeutral},
};

float usable(float v) noexcept { return v > 0 ? v : 0.0F; }  // NaN: 0
Rgb clip(Rgb c) noexcept { return {std::min(c.r, 1.0F), std::min(c.g, 1.0F), std::min(c.b, 1.0F)}; }
Rgb not_negative(Rgb c) noexcept { return {usable(c.r), usable(c.g), usable(c.b)}; }
Rgb srgb_curve(Rgb c) noexcept {
  return {srgb_from_linear(c.r), srgb_from_linear(c.g), srgb_from_linear(c.b)};
}

Rgb aces_hill(Rgb c) noexcept {
  const Rgb in = {0.59719F * c.r + 0.35458F * c.g + 0.04823F * c.b,
                  0.07600F * c.r + 0.90834F * c.g + 0.01566F * c.b,
                  0.02840F * c.r + 0.13383F * c.g + 0.83777F * c.b};
  const auto fit = [](float v) {
    return (v * (v + 0.0245786F) - 0.000090537F) / (v * (0.983729F * v + 0.4329510F) + 0.238081F);
  };
  const Rgb f = {fit(in.r), fit(in.g), fit(in.b)};
  return {1.60475F * f.r - 0.53108F * f.g - 0.07367F * f.b,
          -0.10208F * f.r + 1.10813F * f.g - 0.00605F * f.b,
          -0.00327F * f.r - 0.07276F * f.g + 1.07602F * f.b};
}

// The polynomial returns values encoded for a display of gamma 2.2; they are made linear so that
// all tone maps share the sRGB curve at the end.
Rgb agx_wrensch(Rgb c) noexcept {
  const Rgb in = {0.842479062253094F * c.r + 0.0784335999999992F * c.g + 0.0792237451477643F * c.b,
                  0.0423282422610123F * c.r + 0.878468636469772F * c.g + 0.0791661274605434F * c.b,
                  0.0423756549057051F * c.r + 0.0784336F * c.g + 0.879142973793104F * c.b};
  const auto curve = [](float v) {
    constexpr float kMinEv = -12.47393F;
    constexpr float kMaxEv = 4.026069F;
    const float ev = std::clamp(v > 0 ? std::log2(v) : kMinEv, kMinEv, kMaxEv);
    const float x = (ev - kMinEv) / (kMaxEv - kMinEv);
    const float x2 = x * x;
    const float x4 = x2 * x2;
    return 15.5F * x4 * x2 - 40.14F * x4 * x + 31.96F * x4 - 6.868F * x2 * x + 0.4298F * x2 +
           0.1191F * x - 0.00232F;
  };
  const Rgb f = {curve(in.r), curve(in.g), curve(in.b)};
  const Rgb out = {
      1.19687900512017F * f.r - 0.0980208811401368F * f.g - 0.0990297440797205F * f.b,
      -0.0528968517574562F * f.r + 1.15190312990417F * f.g - 0.0989611768448433F * f.b,
      -0.0529716355144438F * f.r - 0.0980434501171241F * f.g + 1.15107367264116F * f.b};
  const auto linear = [](float v) { return std::pow(std::clamp(v, 0.0F, 1.0F), 2.2F); };
  return {linear(out.r), linear(out.g), linear(out.b)};
}

Rgb khronos_neutral(Rgb c) noexcept {
  constexpr float kStart = 0.8F - 0.04F;
  constexpr float kDesaturation = 0.15F;
  const float low = std::min(c.r, std::min(c.g, c.b));
  const Rgb shifted = c - Rgb(low < 0.08F ? low - 6.25F * low * low : 0.04F);
  const float peak = max_component(shifted);
  if (peak < kStart) {
    return shifted;
  }
  constexpr float kRoom = 1 - kStart;
  const float new_peak = 1 - kRoom * kRoom / (peak + kRoom - kStart);
  const float grey = 1 - 1 / (kDesaturation * (peak - new_peak) + 1);
  return lerp(shifted * (new_peak / peak), Rgb(new_peak), grey);
}

/// The rounded sRGB curve, a staircase of 255 steps: floats with equal leading bits have at most
/// one step among them.
class SrgbSteps {
 public:
  SrgbSteps() {
    std::uint32_t byte = 0;
    std::uint32_t next = step_after(byte);
    for (std::uint32_t i = 0; i < kCells; ++i) {
      while (next <= kFirst + (i << kShift)) {
        next = step_after(++byte);
      }
      cells_[i] = {std::bit_cast<float>(next), static_cast<std::uint8_t>(byte)};
    }
  }
  std::uint8_t operator()(float linear) const {
    if (!(linear >= std::bit_cast<float>(kFirst))) {
      return 0;
    }
    if (linear >= 1) {
      return 255;
    }
    const Cell& cell = cells_[(std::bit_cast<std::uint32_t>(linear) - kFirst) >> kShift];
    return static_cast<std::uint8_t>(cell.byte + (linear >= cell.next ? 1 : 0));
  }

 private:
  static constexpr std::uint32_t kFirst = std::bit_cast<std::uint32_t>(0x1p-13F);  // below 0.5/255
  static constexpr std::uint32_t kOne = std::bit_cast<std::uint32_t>(1.0F);
  static constexpr std::uint32_t kShift = 16;  // seven bits of mantissa: less than a step near 1
  static constexpr std::uint32_t kCells = (kOne - kFirst) >> kShift;
  struct Cell {
    float next = 0;  ///< the first light above it that rounds to byte + 1
    std::uint8_t byte = 0;
  };

  /// Returns the bits of the least float that rounds to more than the byte.
  static std::uint32_t step_after(std::uint32_t byte) {
    std::uint32_t low = kFirst;
    std::uint32_t high = kOne + 1;
    while (low < high) {
      const std::uint32_t middle = (low + high) / 2;
      const long rounded = std::lround(255 * srgb_from_linear(std::bit_cast<float>(middle)));
      (rounded > static_cast<long>(byte) ? high : low) =
          rounded > static_cast<long>(byte) ? middle : middle + 1;
    }
    return low;
  }

  std::array<Cell, kCells> cells_;
};

}  // namespace

std::span<const ToneMapEntry> tone_maps() { return kToneMaps; }

float srgb_from_linear(float linear) noexcept {
  return srgb_encoded(std::min(usable(linear), 1.0F));
}

std::uint8_t srgb_byte(float linear) noexcept {
  static const SrgbSteps kSteps;
  return kSteps(linear);
}

float linear_from_srgb(float encoded) noexcept {
  return srgb_decoded(std::min(usable(encoded), 1.0F));
}

Rgb before_srgb_curve(ToneMap tone_map, Rgb linear) noexcept {
  // Above 1e9 squaring in a tone map would overflow to infinity; every tone map is white there.
  const Rgb positive = not_negative(linear);
  const Rgb c = {std::min(positive.r, 1e9F), std::min(positive.g, 1e9F),
                 std::min(positive.b, 1e9F)};
  switch (tone_map) {
    case ToneMap::kAces:
      return aces_hill(c);
    case ToneMap::kAgx:
      return agx_wrensch(c);
    case ToneMap::kKhronosNeutral:
      return khronos_neutral(c);
    case ToneMap::kLinear:
    case ToneMap::kSrgb:
      break;
  }
  return c;
}

Rgb apply_tone_map(ToneMap tone_map, Rgb linear) noexcept {
  const Rgb c = before_srgb_curve(tone_map, linear);
  return tone_map == ToneMap::kLinear ? clip(c) : srgb_curve(c);
}

}  // namespace core
