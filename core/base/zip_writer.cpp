#include "core/base/zip_writer.h"

#include <limits>

#include <zlib.h>

#include "core/base/text.h"
#include "core/base/zip_format.h"

namespace core {

namespace {

constexpr std::uint32_t kMax32 = std::numeric_limits<std::uint32_t>::max();
constexpr unsigned kVersion = 20;    // APPNOTE 4.4.3.2: folders; supported by every reader
constexpr unsigned kVersion64 = 45;  // the same: Zip64
constexpr unsigned kFirstDay = (1U << 5U) | 1U;  // 1980-01-01 in MS-DOS format
constexpr std::uint32_t kEnd64Signature = 0x06064b50;
constexpr std::uint32_t kLocatorSignature = 0x07064b50;

/// Little endian.
class Bytes {
 public:
  Bytes& u16(unsigned value) { return put(value, 2); }
  Bytes& u32(std::uint64_t value) { return put(value, 4); }
  Bytes& u64(std::uint64_t value) { return put(value, 8); }
  Bytes& text(std::string_view value) {
    text_ += value;
    return *this;
  }
  const std::string& str() const { return text_; }

 private:
  Bytes& put(std::uint64_t value, int bytes) {
    for (int i = 0; i < bytes; ++i) {
      text_ += static_cast<char>((value >> (8U * static_cast<unsigned>(i))) & 0xFFU);
    }
    return *this;
  }
  std::string text_;
};

/// Writes the fields from the flags to the sizes, which are equal in local headers and in the
/// directory.
void put_facts(Bytes& to, std::uint32_t crc, std::uint32_t bytes, std::size_t name_bytes) {
  constexpr unsigned kStored = 0;
  to.u16(zip_format::kUtf8).u16(kStored).u16(0).u16(kFirstDay).u32(crc).u32(bytes).u32(bytes);
  to.u16(static_cast<unsigned>(name_bytes));
}

}  // namespace

std::string ZipWriter::begin_entry(std::string_view name, std::string_view content) {
  const auto crc = static_cast<std::uint32_t>(crc32_z(
      crc32_z(0, nullptr, 0), reinterpret_cast<const Bytef*>(content.data()), content.size()));
  const auto bytes = static_cast<std::uint32_t>(content.size());
  entries_.push_back({std::string(name), bytes, crc, offset_});
  Bytes head;
  head.u32(zip_format::kLocalSignature).u16(kVersion);
  put_facts(head, crc, bytes, name.size());
  head.u16(0).text(name);
  offset_ += head.str().size() + content.size();
  return head.str();
}

std::string ZipWriter::directory() const {
  Bytes all;
  for (const Entry& entry : entries_) {
    const bool is_far = entry.offset >= kMax32;
    all.u32(zip_format::kEntrySignature).u16(kVersion64).u16(is_far ? kVersion64 : kVersion);
    put_facts(all, entry.crc32, entry.bytes, entry.name.size());
    all.u16(is_far ? 12 : 0).u16(0).u16(0).u16(0).u32(0).u32(is_far ? kMax32 : entry.offset);
    all.text(entry.name);
    if (is_far) {
      all.u16(1).u16(8).u64(entry.offset);
    }
  }
  return all.str();
}

std::string ZipWriter::end() const {
  const std::string entries = directory();
  const auto count = static_cast<unsigned>(entries_.size());
  const bool is_far = offset_ >= kMax32;
  Bytes tail;
  tail.text(entries);
  if (is_far) {
    constexpr std::uint64_t kEnd64Bytes = 44;  // excluding the size field itself
    tail.u32(kEnd64Signature).u64(kEnd64Bytes).u16(kVersion64).u16(kVersion64).u32(0).u32(0);
    tail.u64(count).u64(count).u64(entries.size()).u64(offset_);
    tail.u32(kLocatorSignature).u32(0).u64(offset_ + entries.size()).u32(1);
  }
  tail.u32(zip_format::kEndSignature).u16(0).u16(0).u16(count).u16(count);
  tail.u32(entries.size()).u32(is_far ? kMax32 : offset_).u16(0);
  return tail.str();
}

std::string file_name_of(std::string_view text) {
  std::string name;
  for (const char c : text) {
    const bool is_plain = is_letter_or_digit(c) || c == '.' || c == '_' || c == '-' ||
                          static_cast<unsigned char>(c) >= 0x80;  // Part of UTF-8.
    name += is_plain ? c : '_';
  }
  return name.find_first_not_of('.') == std::string::npos ? "_" + name : name;
}

}  // namespace core
