/// Files of the data directory: descriptors, whole reads and writes, durable renames.
///
/// Errors: kNoSpace when the disk or a quota is full, otherwise kInternal, with the system's
/// message; `where` is the path, which api::from_error() keeps from clients.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "core/base/descriptor.h"
#include "core/base/result.h"

namespace server {

using core::UniqueFd;

/// Returns the error for errno `code` at `path`.
core::Error file_error(std::string_view what, const std::string& path, int code);

/// flags as for open(2), with O_CLOEXEC added; new files are readable by their owner only. Errors:
/// also kNotFound when there is no such file; not for clients, as its `where` is the path.
core::Result<UniqueFd> open_file(const std::string& path, int flags);
core::Status write_at(int fd, std::span<const std::byte> bytes, std::uint64_t offset,
                      const std::string& path);
/// Reads up to bytes.size() bytes; fewer only at the end of the file.
core::Result<std::size_t> read_at(int fd, std::span<std::byte> bytes, std::uint64_t offset,
                                  const std::string& path);
core::Result<std::uint64_t> file_bytes(int fd, const std::string& path);
core::Status sync_file(int fd, const std::string& path);
core::Status sync_directory(const std::string& path);
core::Status make_directories(const std::string& path);
/// Atomic; both in the same file system. Durable after sync_directory().
core::Status rename_file(const std::string& from, const std::string& to);
/// Succeeds if the file does not exist.
core::Status remove_file(const std::string& path);

/// Returns the words, a space and their checksum.
std::string seal(const std::string& words);
/// Returns the words of a sealed line. Empty: a bit of it was changed.
std::optional<std::string> unseal(const std::string& line);

struct DiskSpace {
  std::uint64_t total_bytes = 0;
  std::uint64_t free_bytes = 0;  ///< Available to this user, not to root.
};
core::Result<DiskSpace> disk_space(const std::string& path);

}  // namespace server
