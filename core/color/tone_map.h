/// Maps linear Rec.709 to display values in [0,1].
///
/// srgb            clips and applies the sRGB curve (IEC 61966-2-1).
/// linear          clips; no curve.
/// aces            Stephen Hill's fit of the ACES RRT and sRGB ODT (BakingLab), then the sRGB
/// curve.
/// agx             Troy Sobotka's AgX, base look, by Benjamin Wrensch's sixth-order polynomial.
/// khronos-neutral Khronos PBR Neutral, the formula of its specification, then the sRGB curve.
///
/// NaN and negative components count as 0, infinite ones as very bright.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "core/color/rgb.h"

namespace core {

enum class ToneMap { kSrgb, kLinear, kAces, kAgx, kKhronosNeutral };

struct ToneMapEntry {
  std::string_view name;  ///< "srgb" "linear" "aces" "agx" "khronos-neutral"
  ToneMap tone_map;
};
std::span<const ToneMapEntry> tone_maps();

/// Returns the display value of a linear colour, including the transfer curve.
Rgb apply_tone_map(ToneMap tone_map, Rgb linear) noexcept;
/// Returns the same before the sRGB curve, which every tone map but kLinear ends with.
Rgb before_srgb_curve(ToneMap tone_map, Rgb linear) noexcept;

/// The sRGB curve and its inverse, for values in [0,1]; other values are clipped.
float srgb_from_linear(float linear) noexcept;
/// Returns 255 srgb_from_linear(), rounded; in a fifth of its time.
std::uint8_t srgb_byte(float linear) noexcept;
float linear_from_srgb(float encoded) noexcept;

}  // namespace core
