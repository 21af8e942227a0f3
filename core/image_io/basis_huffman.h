/// Huffman tables of BasisLZ: canonical as in Deflate, codes of up to 16 bits.
/// Source: KTX File Format Specification 2.0, "Compressed Huffman Tables".
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/image_io/bit_reader.h"

namespace core {

class BasisHuffman {
 public:
  /// Returns empty for a malformed table. A table without symbols is allowed and decodes nothing.
  static std::optional<BasisHuffman> read(BitReader& bits);

  /// Returns the next symbol; empty if the bits are not a code.
  std::optional<std::uint32_t> decode(BitReader& bits) const noexcept;

 private:
  /// Returns empty if the lengths do not form a prefix code.
  static std::optional<BasisHuffman> from_lengths(const std::vector<std::uint8_t>& lengths);

  struct Entry {
    std::uint16_t symbol = 0;
    std::uint16_t length = 0;  ///< 0: no code
  };
  std::uint32_t bits_max_ = 0;
  std::vector<Entry> entries_;  ///< indexed by the next bits_max_ bits
};

}  // namespace core
