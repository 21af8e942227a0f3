/// Numbers of the zip format that its reader and its writer share. Source: APPNOTE.TXT 6.3.10.
#pragma once

#include <cstdint>

namespace core::zip_format {

constexpr std::uint32_t kLocalSignature = 0x04034b50;
constexpr std::uint32_t kEntrySignature = 0x02014b50;
constexpr std::uint32_t kEndSignature = 0x06054b50;
constexpr std::uint32_t kUtf8 = 1U << 11U;  // general purpose bit 11

}  // namespace core::zip_format
