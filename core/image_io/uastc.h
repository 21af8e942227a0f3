/// Blocks of 4 x 4 texels in UASTC LDR 4x4, a part of ASTC with a layout of its own.
/// Source: UASTC LDR 4x4 Texture Specification (Binomial, public domain); Khronos Data Format
/// Specification 1.3, chapter 23 (ASTC): integer sequences, unquantisation, partitions.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

namespace core {

inline constexpr std::size_t kUastcBlockBytes = 16;

/// RGBA of 16 texels, row by row.
using UastcTexels = std::array<std::array<std::uint8_t, 4>, 16>;

/// Colours as ASTC gives them with linear endpoints, which is what encoders aim at. Empty for a
/// block of the reserved mode, or whose partition is none of the format's.
std::optional<UastcTexels> decode_uastc_block(std::span<const std::byte, kUastcBlockBytes> block);

}  // namespace core
