#include "core/base/zip_reader.h"

#include <algorithm>
#include <set>

#include <zlib.h>

#include "core/base/invalid.h"
#include "core/base/zip_format.h"
#include "core/base/zip_names.h"

namespace core {

namespace {

constexpr std::size_t kEndBytes = 22;
constexpr std::size_t kCentralBytes = 46;
constexpr std::size_t kLocalBytes = 30;
constexpr std::size_t kCommentMax = 65535;

Error broken(std::string what) { return invalid("zip archive: " + std::move(what)); }

/// what: subject and verb of the sentence; the limit follows.
Error too_large(const std::string& what, std::uint64_t most) {
  return {ErrorCode::kTooLarge,
          "zip archive: " + what + "; at most " + std::to_string(most) + " are allowed", ""};
}

/// Reads little-endian numbers; reads beyond the end return 0, so that one bounds check per record
/// is enough.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}
  std::uint32_t u16(std::size_t offset) const { return byte(offset) | byte(offset + 1) << 8U; }
  std::uint32_t u32(std::size_t offset) const { return u16(offset) | u16(offset + 2) << 16U; }
  std::string text(std::size_t offset, std::size_t size) const {
    const auto part = bytes_.subspan(offset, size);
    return std::string(reinterpret_cast<const char*>(part.data()), part.size());
  }
  bool has(std::uint64_t offset, std::uint64_t size) const {
    return offset <= bytes_.size() && size <= bytes_.size() - offset;
  }

 private:
  std::uint32_t byte(std::size_t offset) const {
    return offset < bytes_.size() ? std::to_integer<std::uint32_t>(bytes_[offset]) : 0;
  }
  std::span<const std::byte> bytes_;
};

/// Finds the last end record whose comment reaches exactly to the end of the archive.
Result<std::size_t> find_end_record(std::span<const std::byte> archive) {
  const Reader reader(archive);
  if (archive.size() < kEndBytes) {
    return broken("too short");
  }
  const std::size_t last = archive.size() - kEndBytes;
  const std::size_t first = last > kCommentMax ? last - kCommentMax : 0;
  for (std::size_t at = last + 1; at-- > first;) {
    if (reader.u32(at) == zip_format::kEndSignature &&
        at + kEndBytes + reader.u16(at + 20) == archive.size()) {
      return at;
    }
  }
  return broken("no central directory; the file is cut short or is not a zip");
}

Result<ZipEntry> read_central_entry(const Reader& reader, std::size_t at, const ZipLimits& limits) {
  ZipEntry entry;
  const std::size_t name_bytes = reader.u16(at + 28);
  if (name_bytes > limits.name_bytes_max) {
    return broken("a name of " + std::to_string(name_bytes) + " bytes; at most " +
                  std::to_string(limits.name_bytes_max) + " are allowed");
  }
  const std::uint32_t flags = reader.u16(at + 8);
  entry.name =
      zip_name(reader.text(at + kCentralBytes, name_bytes), (flags & zip_format::kUtf8) != 0);
  if (!is_safe_name(entry.name)) {
    return broken("the name \"" + entry.name + "\" leaves the archive or is not plain");
  }
  const std::uint32_t method = reader.u16(at + 10);
  entry.crc32 = reader.u32(at + 16);
  entry.packed_bytes = reader.u32(at + 20);
  entry.bytes = reader.u32(at + 24);
  const std::uint64_t local = reader.u32(at + 42);
  if ((flags & 1U) != 0) {
    return broken("\"" + entry.name + "\" is encrypted");
  }
  if (method != 0 && method != 8) {
    return broken("\"" + entry.name + "\" uses the method " + std::to_string(method) +
                  "; stored (0) and deflate (8) are read");
  }
  entry.deflated = method == 8;
  if (entry.bytes == 0xffffffffU || entry.packed_bytes == 0xffffffffU || local == 0xffffffffU) {
    return broken("\"" + entry.name + "\" needs Zip64, which is not read");
  }
  if (entry.bytes > limits.entry_bytes_max) {
    return too_large("\"" + entry.name + "\" unpacks to " + std::to_string(entry.bytes) + " bytes",
                     limits.entry_bytes_max);
  }
  if (!reader.has(local, kLocalBytes) ||
      reader.u32(static_cast<std::size_t>(local)) != zip_format::kLocalSignature) {
    return broken("\"" + entry.name + "\" has no local header");
  }
  const auto local_at = static_cast<std::size_t>(local);
  entry.offset = local + kLocalBytes + reader.u16(local_at + 26) + reader.u16(local_at + 28);
  if (!reader.has(entry.offset, entry.packed_bytes)) {
    return broken("\"" + entry.name + "\" reaches beyond the end of the file");
  }
  return entry;
}

}  // namespace

Result<std::vector<ZipEntry>> read_zip_directory(std::span<const std::byte> archive,
                                                 const ZipLimits& limits) {
  const auto end = find_end_record(archive);
  if (!end) {
    return end.error();
  }
  const Reader reader(archive);
  const std::uint32_t count = reader.u16(*end + 10);
  if (reader.u16(*end + 4) != 0 || reader.u16(*end + 8) != count) {
    return broken("it spans several disks");
  }
  if (count > limits.entries_max) {
    return too_large(std::to_string(count) + " entries", limits.entries_max);
  }
  std::vector<ZipEntry> entries;
  std::set<std::string> names;
  std::uint64_t total = 0;
  std::size_t at = reader.u32(*end + 16);
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::size_t variable = reader.u16(at + 28) + reader.u16(at + 30) + reader.u16(at + 32);
    if (!reader.has(at, kCentralBytes + variable) ||
        reader.u32(at) != zip_format::kEntrySignature) {
      return broken("the central directory is cut short");
    }
    auto entry = read_central_entry(reader, at, limits);
    if (!entry) {
      return entry.error();
    }
    at += kCentralBytes + variable;
    if (entry->name.back() == '/') {
      continue;
    }
    if (!names.insert(entry->name).second) {
      return broken("the name \"" + entry->name + "\" appears more than once");
    }
    total += entry->bytes;
    if (total > limits.total_bytes_max) {
      return Error{
          ErrorCode::kTooLarge,
          "zip archive: unpacks to more than " + std::to_string(limits.total_bytes_max) + " bytes",
          ""};
    }
    entries.push_back(std::move(*entry));
  }
  return entries;
}

Result<std::vector<std::byte>> read_zip_entry(std::span<const std::byte> archive,
                                              const ZipEntry& entry) {
  const auto packed = archive.subspan(static_cast<std::size_t>(entry.offset),
                                      static_cast<std::size_t>(entry.packed_bytes));
  std::vector<std::byte> content;
  if (!entry.deflated) {
    if (entry.bytes != entry.packed_bytes) {
      return broken("\"" + entry.name + "\" is stored with two different sizes");
    }
    content.assign(packed.begin(), packed.end());
  } else {
    // Deflate compresses at most 1032 to 1, so larger claims are refused before memory is
    // allocated.
    if (entry.bytes > entry.packed_bytes * 1032 + 1032) {
      return broken("\"" + entry.name + "\" claims a size that deflate cannot reach");
    }
    content.resize(static_cast<std::size_t>(entry.bytes));
    z_stream stream = {};
    if (inflateInit2(&stream, -MAX_WBITS) != Z_OK) {
      throw std::bad_alloc();
    }
    // zlib's input is not const, but zlib only reads it.
    stream.next_in = const_cast<Bytef*>(reinterpret_cast<const Bytef*>(packed.data()));  // NOLINT
    stream.avail_in = static_cast<uInt>(packed.size());
    stream.next_out = reinterpret_cast<Bytef*>(content.data());
    stream.avail_out = static_cast<uInt>(content.size());
    Bytef nothing = 0;
    if (content.empty()) {
      stream.next_out = &nothing;  // zlib requires a non-null pointer.
    }
    const int code = inflate(&stream, Z_FINISH);
    const bool whole = code == Z_STREAM_END && stream.total_out == entry.bytes;
    inflateEnd(&stream);
    if (!whole) {
      return broken("\"" + entry.name + "\" does not unpack to its size");
    }
  }
  const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(content.data()), content.size());
  if (!content.empty() && crc != entry.crc32) {
    return broken("\"" + entry.name + "\" does not match its checksum");
  }
  return content;
}

}  // namespace core
