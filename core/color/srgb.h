/// The curve of sRGB, for float or double. Header only: programs without the renderer use it too.
#pragma once

#include <cmath>

namespace core {

/// linear in [0,1]; not clipped. Source: IEC 61966-2-1.
template <typename F>
F srgb_encoded(F linear) noexcept {
  return linear <= F(0.0031308) ? F(12.92) * linear
                                : F(1.055) * std::pow(linear, 1 / F(2.4)) - F(0.055);
}
/// The inverse.
template <typename F>
F srgb_decoded(F encoded) noexcept {
  return encoded <= F(0.04045) ? encoded / F(12.92)
                               : std::pow((encoded + F(0.055)) / F(1.055), F(2.4));
}

}  // namespace core
