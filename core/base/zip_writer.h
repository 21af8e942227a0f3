/// Writes a zip archive incrementally, with stored entries, for files that are already compressed.
///
/// Source: APPNOTE.TXT 6.3.10; Zip64 from 4.3.14 for archives longer than 4 GiB. The same entries
/// give the same bytes: all have the earliest date.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace core {

class ZipWriter {
 public:
  /// Returns the bytes that precede the content of the next entry; the caller appends the content.
  /// name: UTF-8, unique. content: below 4 GiB.
  std::string begin_entry(std::string_view name, std::string_view content);
  /// Returns the bytes that follow the last entry.
  std::string end() const;

 private:
  struct Entry {
    std::string name;
    std::uint32_t bytes = 0;
    std::uint32_t crc32 = 0;
    std::uint64_t offset = 0;
  };
  std::string directory() const;

  std::vector<Entry> entries_;
  std::uint64_t offset_ = 0;  ///< Offset of the next entry.
};

/// Returns a file name for an archive: letters, digits and . _ - are kept, others become _. Never
/// empty or of dots alone.
std::string file_name_of(std::string_view text);

}  // namespace core
