/// The light of an image: of an environment map, or of a face of a cube map.
#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <vector>

#include "core/color/rgb.h"
#include "core/image_io/image.h"

namespace core {

/// Largest light that is read: its square is still a float, and so are sums of squares.
constexpr float kRadianceMost = 1e18F;

/// Returns a stored value: integers as [0, 1], floats unchanged.
float stored_value(const Image& image, std::size_t index);

/// kDivisor: in images of 8 and 16 bits, colour is divided by it (RGBD).
enum class AlphaUse { kIgnored, kDivisor };

/// Returns the light of all pixels, row 0 on top. Values of 8 and 16 bits are sRGB-encoded; grey is
/// copied to the three channels; a value that is negative, infinite or not a number becomes 0, one
/// above kRadianceMost becomes that.
std::vector<Rgb> radiance_of(const Image& image, AlphaUse alpha);

/// Returns the warning that the file states other primaries than those of Rec. 709; empty if not.
/// what: "the environment".
std::string primaries_warning(std::span<const std::byte> file, const std::string& what);

/// Returns that warning, and those that count the texels with values that are changed. image: of
/// the file.
std::string radiance_warning(std::span<const std::byte> file, const Image& image,
                             const std::string& what);

}  // namespace core
