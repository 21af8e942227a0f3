/// A file's content.
#pragma once

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <vector>

namespace test_support {

/// Reads the whole file; returns no bytes if it cannot be read.
inline std::vector<std::byte> read_bytes(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) {
    return {};
  }
  std::vector<std::byte> bytes(static_cast<std::size_t>(in.tellg()));
  in.seekg(0);
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return bytes;
}

}  // namespace test_support
