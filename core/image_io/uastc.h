/// Decodes blocks of 4 x 4 texels in UASTC LDR 4x4, a subset of ASTC with its own layout. Source:
/// UASTC LDR 4x4 Texture Specification (Binomial, public domain); Khronos Data Format Specification
/// 1.3, chapter 23 (ASTC): integer sequences, unquantisation, partitions.
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

/// Decodes colours as ASTC does with linear endpoints, which encoders aim at. Empty for a block of
/// the reserved mode, or with an invalid partition.
std::optional<UastcTexels> decode_uastc_block(std::span<const std::byte, kUastcBlockBytes> block);

}  // namespace core
