/// Decodes ETC1S images compressed by BasisLZ: blocks of 4 x 4 texels that refer to a colour and a
/// pattern in two codebooks of the file. Source: KTX File Format Specification 2.0, "BasisLZ/ETC1S
/// Bitstream Specification"; Khronos Data Format Specification 1.3, 21.1 (ETC1S).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "core/image_io/basis_huffman.h"

namespace core {

/// The codebooks and Huffman tables that all images of a file share.
class Etc1sCodebooks {
 public:
  struct Sections {
    std::uint32_t endpoint_count = 0;
    std::uint32_t selector_count = 0;
    std::span<const std::byte> endpoints;
    std::span<const std::byte> selectors;
    std::span<const std::byte> tables;
  };
  /// Returns empty for malformed data.
  static std::optional<Etc1sCodebooks> read(const Sections& sections);

  /// The destination of a slice: writes `count` of the `channels` values of each texel, from `to`
  /// on. If count is one, it is green, the channel that stores alpha.
  struct Target {
    std::span<std::byte> pixels;  ///< of the image
    std::size_t width = 0;
    std::size_t height = 0;
    std::size_t channels = 0;
    std::size_t first = 0;
    std::size_t count = 0;
  };
  /// Returns false for malformed data.
  bool decode_slice(std::span<const std::byte> slice, const Target& target) const;

 private:
  struct Endpoint {
    std::array<std::uint8_t, 3> color{};  ///< 5 bits each
    std::uint8_t intensity = 0;
  };
  using Selector = std::array<std::uint8_t, 4>;  ///< rows of four 2-bit values

  class Slice;

  bool read_endpoints(std::span<const std::byte> data, std::uint32_t count);
  bool read_selectors(std::span<const std::byte> data, std::uint32_t count);
  bool read_tables(std::span<const std::byte> data);
  void write_block(const Endpoint& endpoint, const Selector& selector, std::size_t x, std::size_t y,
                   const Target& target) const;

  std::vector<Endpoint> endpoints_;
  std::vector<Selector> selectors_;
  BasisHuffman endpoint_prediction_;
  BasisHuffman endpoint_delta_;
  BasisHuffman selector_;
  BasisHuffman history_run_;
  std::uint32_t history_size_ = 0;
};

}  // namespace core
