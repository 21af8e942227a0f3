/// Unsigned numbers in files, in either byte order. Pre: the bytes hold the number at `at`.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace core {

inline std::uint32_t u8(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::to_integer<std::uint32_t>(bytes[at]);
}
inline std::uint32_t u16_big(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return u8(bytes, at) << 8U | u8(bytes, at + 1);
}
inline std::uint32_t u16_little(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return u8(bytes, at + 1) << 8U | u8(bytes, at);
}
inline std::uint32_t u32_big(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return u16_big(bytes, at) << 16U | u16_big(bytes, at + 2);
}
inline std::uint32_t u32_little(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return u16_little(bytes, at + 2) << 16U | u16_little(bytes, at);
}
inline std::uint64_t u64_little(std::span<const std::byte> bytes, std::size_t at) noexcept {
  return std::uint64_t{u32_little(bytes, at + 4)} << 32U | u32_little(bytes, at);
}

}  // namespace core
