/// Between convert_to_glb() and tessera-convert, of the same build: files one after another on
/// stdin, a GLB on stdout, lines on stderr.
#pragma once

#include <cstdint>
#include <string_view>

namespace core {

/// Followed by the name and the content.
struct ConvertedFile {
  std::uint64_t name_bytes = 0;
  std::uint64_t bytes = 0;
};

constexpr std::string_view kNoteLine = "note: ";
constexpr std::string_view kErrorLine = "error: ";
constexpr int kNoMemory = 3;  ///< exit code

}  // namespace core
