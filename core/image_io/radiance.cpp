#include "core/image_io/radiance.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#include "core/color/tone_map.h"
#include "core/image_io/exr_header.h"
#include "core/image_io/hdr.h"
#include "core/image_io/image_size.h"

namespace core {
namespace {

bool is_usable(float value) { return value >= 0 && std::isfinite(value); }

/// Colour takes the first channels: one, or three.
std::size_t colors_of(const Image& image) { return image.channels < 3 ? 1 : 3; }

}  // namespace

float stored_value(const Image& image, std::size_t index) {
  if (image.type == PixelType::kU8) {
    return static_cast<float>(std::to_integer<unsigned>(image.bytes[index])) / 255.0F;
  }
  if (image.type == PixelType::kU16) {
    std::uint16_t value = 0;
    std::memcpy(&value, &image.bytes[index * sizeof(value)], sizeof(value));
    return static_cast<float>(value) / 65535.0F;
  }
  float value = 0;
  std::memcpy(&value, &image.bytes[index * sizeof(value)], sizeof(value));
  return value;
}

std::vector<Rgb> radiance_of(const Image& image, AlphaUse alpha) {
  const auto channels = static_cast<std::size_t>(image.channels);
  const bool is_grey = colors_of(image) == 1;
  const bool is_encoded = image.type != PixelType::kF32;
  const bool divides = is_encoded && channels % 2 == 0 && alpha == AlphaUse::kDivisor;
  std::vector<Rgb> light;
  light.reserve(image.value_count() / channels);
  for (std::size_t at = 0; at < image.value_count(); at += channels) {
    const auto value = [&](std::size_t c) {
      const float stored = stored_value(image, at + (is_grey ? 0 : c));
      return is_encoded          ? linear_from_srgb(stored)
             : is_usable(stored) ? std::min(stored, kRadianceMost)
                                 : 0.0F;
    };
    const float divisor = divides ? stored_value(image, at + channels - 1) : 1.0F;
    const Rgb color = {value(0), value(1), value(2)};
    light.push_back(divisor > 0 ? color * (1 / divisor) : Rgb{0, 0, 0});
  }
  return light;
}

std::string primaries_warning(std::span<const std::byte> file, const std::string& what) {
  constexpr Chromaticities kRec709 = {0.64F, 0.33F, 0.3F, 0.6F, 0.15F, 0.06F, 0.3127F, 0.329F};
  constexpr float kRounding = 0.0005F;  // of three digits
  const std::string_view kind = image_kind(file);
  const auto header = kind == "exr" ? exr_header(file) : std::nullopt;
  const auto stated = header          ? header->primaries
                      : kind == "hdr" ? hdr_primaries(file)
                                      : std::nullopt;
  const bool is_rec709 =
      !stated || std::equal(stated->begin(), stated->end(), kRec709.begin(),
                            [](float a, float b) { return std::abs(a - b) <= kRounding; });
  return is_rec709 ? ""
                   : "The primaries that the file of " + what +
                         " states are ignored; its colours are taken as Rec. 709.";
}

std::string radiance_warning(std::span<const std::byte> file, const Image& image,
                             const std::string& what) {
  std::string out = primaries_warning(file, what);
  if (image.type != PixelType::kF32) {
    return out;
  }
  const auto channels = static_cast<std::size_t>(image.channels);
  std::size_t unusable = 0;
  std::size_t large = 0;
  for (std::size_t at = 0; at < image.value_count(); at += channels) {
    bool is_usable_texel = true;
    bool is_large = false;
    for (std::size_t c = 0; c < colors_of(image); ++c) {
      const float value = stored_value(image, at + c);
      is_usable_texel = is_usable_texel && is_usable(value);
      is_large = is_large || (is_usable(value) && value > kRadianceMost);
    }
    unusable += is_usable_texel ? 0U : 1U;
    large += is_large ? 1U : 0U;
  }
  const auto count = [&](std::size_t texels, const char* faults) {
    if (texels > 0) {
      out += (out.empty() ? "" : " ") + std::to_string(texels) +
             (texels == 1 ? " texel of " : " texels of ") + what +
             (texels == 1 ? " has " : " have ") + faults;
    }
  };
  count(unusable, "negative, infinite or undefined values, which were set to 0.");
  count(large, "values above 1e18, which were set to that.");
  return out;
}

}  // namespace core
