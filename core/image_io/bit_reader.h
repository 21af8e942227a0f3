/// BitReader: reads bits of a byte sequence, least significant bit of each byte first.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace core {

class BitReader {
 public:
  explicit BitReader(std::span<const std::byte> bytes) noexcept : bytes_(bytes) {}

  /// Returns the next `count` bits, the first one lowest; zeros past the end. Pre: count <= 16.
  std::uint32_t read(std::uint32_t count) noexcept {
    const std::uint32_t bits = peek(count);
    skip(count);
    return bits;
  }
  std::uint32_t peek(std::uint32_t count) noexcept {
    while (held_ < count) {
      const std::uint32_t next =
          at_ < bytes_.size() ? std::to_integer<std::uint32_t>(bytes_[at_]) : 0;
      ++at_;
      bits_ |= next << held_;
      held_ += 8;
    }
    return bits_ & ((1U << count) - 1U);
  }
  /// Pre: count bits were peeked at.
  void skip(std::uint32_t count) noexcept {
    bits_ >>= count;
    held_ -= count;
  }
  /// Returns whether more bits were skipped than exist.
  bool is_past_end() const noexcept { return at_ > bytes_.size() + held_ / 8; }

 private:
  std::span<const std::byte> bytes_;
  std::size_t at_ = 0;
  std::uint32_t bits_ = 0;
  std::uint32_t held_ = 0;
};

}  // namespace core
