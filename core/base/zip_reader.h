/// Reads a zip archive from memory: stored and deflated entries, with all sizes limited in advance.
///
/// Source: APPNOTE.TXT 6.3.3. The central directory is authoritative; local headers only give the
/// position of the data. Not supported: encryption, multiple disks, Zip64 values beyond 32 bits.
/// Errors: kInvalidArgument with the entry's name, kTooLarge.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"

namespace core {

struct ZipLimits {
  std::size_t entries_max = 4096;
  std::uint64_t entry_bytes_max = std::uint64_t{2} << 30U;  ///< After inflating.
  std::uint64_t total_bytes_max = std::uint64_t{4} << 30U;
  std::size_t name_bytes_max = 1024;
};

struct ZipEntry {
  /// UTF-8, relative, with forward slashes; never empty, absolute, or with `.` and `..` parts.
  std::string name;
  std::uint64_t bytes = 0;  ///< After inflating.
  std::uint64_t packed_bytes = 0;
  std::uint64_t offset = 0;  ///< Offset of the packed bytes in the archive.
  std::uint32_t crc32 = 0;
  bool deflated = false;
};

/// Returns the files in the order of the archive, without folders. A name that leaves the archive,
/// is repeated, or is not plain text is an error.
Result<std::vector<ZipEntry>> read_zip_directory(std::span<const std::byte> archive,
                                                 const ZipLimits& limits);

/// Returns the content of an entry, checked against its size and CRC.
Result<std::vector<std::byte>> read_zip_entry(std::span<const std::byte> archive,
                                              const ZipEntry& entry);

}  // namespace core
