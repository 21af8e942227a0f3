#include "server/store/files.h"

#include <cerrno>
#include <filesystem>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <unistd.h>
#include <zlib.h>

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

Error file_error(std::string_view what, const std::string& path, int code) {
  const bool full = code == ENOSPC || code == EDQUOT || code == EFBIG;
  return Error{full ? ErrorCode::kNoSpace : ErrorCode::kInternal,
               std::string(what) + ": " + std::generic_category().message(code), path};
}

core::Result<UniqueFd> open_file(const std::string& path, int flags) {
  const int fd = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
  if (fd < 0) {
    const int code = errno;
    Error error = file_error("cannot open", path, code);
    error.code = code == ENOENT && (flags & O_CREAT) == 0 ? ErrorCode::kNotFound : error.code;
    return error;
  }
  return UniqueFd(fd);
}

Status write_at(int fd, std::span<const std::byte> bytes, std::uint64_t offset,
                const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t written = ::pwrite(fd, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0) {
      if (errno == EINTR) {
        continue;
      }
      return file_error("cannot write", path, errno);
    }
    bytes = bytes.subspan(static_cast<std::size_t>(written));
    offset += static_cast<std::uint64_t>(written);
  }
  return core::ok_status();
}

core::Result<std::size_t> read_at(int fd, std::span<std::byte> bytes, std::uint64_t offset,
                                  const std::string& path) {
  std::size_t done = 0;
  while (done < bytes.size()) {
    const ssize_t got =
        ::pread(fd, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (got < 0) {
      if (errno == EINTR) {
        continue;
      }
      return file_error("cannot read", path, errno);
    }
    if (got == 0) {
      break;
    }
    done += static_cast<std::size_t>(got);
  }
  return done;
}

core::Result<std::uint64_t> file_bytes(int fd, const std::string& path) {
  struct stat info = {};
  if (::fstat(fd, &info) != 0) {
    return file_error("cannot stat", path, errno);
  }
  return static_cast<std::uint64_t>(info.st_size);
}

Status sync_file(int fd, const std::string& path) {
  if (::fdatasync(fd) != 0) {
    return file_error("cannot sync", path, errno);
  }
  return core::ok_status();
}

Status sync_directory(const std::string& path) {
  const UniqueFd fd(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (!fd || ::fsync(fd.get()) != 0) {
    return file_error("cannot sync", path, errno);
  }
  return core::ok_status();
}

Status make_directories(const std::string& path) {
  std::error_code code;
  std::filesystem::create_directories(path, code);
  if (code) {
    return file_error("cannot make directory", path, code.value());
  }
  return core::ok_status();
}

Status rename_file(const std::string& from, const std::string& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) {
    return file_error("cannot rename to", to, errno);
  }
  return core::ok_status();
}

Status remove_file(const std::string& path) {
  if (::unlink(path.c_str()) != 0 && errno != ENOENT) {
    return file_error("cannot remove", path, errno);
  }
  return core::ok_status();
}

std::string seal(const std::string& words) {
  const auto sum = crc32_z(0, reinterpret_cast<const Bytef*>(words.data()), words.size());
  return words + " " + std::to_string(sum);
}

std::optional<std::string> unseal(const std::string& line) {
  const std::string words = line.substr(0, line.rfind(' '));
  return seal(words) == line ? std::optional(words) : std::nullopt;
}

core::Result<DiskSpace> disk_space(const std::string& path) {
  struct statvfs info = {};
  if (::statvfs(path.c_str(), &info) != 0) {
    return file_error("cannot ask for the space of", path, errno);
  }
  return DiskSpace{.total_bytes = std::uint64_t{info.f_blocks} * info.f_frsize,
                   .free_bytes = std::uint64_t{info.f_bavail} * info.f_frsize};
}

}  // namespace server
