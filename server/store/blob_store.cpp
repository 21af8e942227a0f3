#include "server/store/blob_store.h"

#include <atomic>
#include <cerrno>
#include <filesystem>
#include <span>
#include <system_error>
#include <vector>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "api/requests.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

/// Ids kept as found whole; beyond it all are checked again.
constexpr std::size_t kWholeMost = 100'000;

// These texts reach clients, so they do not name the file's path.
Error gone(std::string_view id) {
  return Error{ErrorCode::kInternal,
               "the stored file of asset " + std::string(id) + " is gone; upload it again", ""};
}

Error damaged(std::string_view id) {
  return Error{ErrorCode::kInternal,
               "the stored file of asset " + std::string(id) +
                   " is damaged: its content does not have this hash; upload it again",
               ""};
}

std::string temporary_name() {
  static std::atomic<std::uint64_t> counter = 0;  // NOLINT: unique names within the process.
  return std::to_string(::getpid()) + "-" + std::to_string(counter.fetch_add(1)) + ".part";
}

}  // namespace

core::Result<BlobStore> BlobStore::open(const std::string& directory) {
  BlobStore store(directory);
  const std::string temporary = directory + "/tmp";
  if (const auto made = make_directories(temporary); !made) {
    return made.error();
  }
  std::error_code code;
  for (const auto& entry : std::filesystem::directory_iterator(temporary, code)) {
    std::filesystem::remove(entry.path(), code);
  }
  return store;
}

std::string BlobStore::folder_of(std::string_view id) const {
  return directory_ + "/" + std::string(id.substr(0, 2));
}

std::string BlobStore::path_of(std::string_view id) const {
  return folder_of(id) + "/" + std::string(id);
}

core::Result<BlobStore::Upload> BlobStore::start_upload() const {
  std::string path = directory_ + "/tmp/" + temporary_name();
  auto fd = open_file(path, O_RDWR | O_CREAT | O_EXCL);
  if (!fd) {
    return fd.error();
  }
  return Upload(*this, std::move(path), std::move(*fd));
}

BlobStore::Upload::Upload(Upload&& other) noexcept
    : store_(other.store_),
      path_(std::exchange(other.path_, std::string())),
      fd_(std::move(other.fd_)),
      hash_(std::move(other.hash_)),
      id_(std::move(other.id_)),
      bytes_(other.bytes_) {}

BlobStore::Upload::~Upload() {
  if (!path_.empty()) {
    ::unlink(path_.c_str());
  }
}

Status BlobStore::Upload::write(std::string_view piece) {
  if (auto status = write_at(fd_.get(), std::as_bytes(std::span(piece)), bytes_, path_); !status) {
    return status;
  }
  hash_->add(piece.data(), piece.size());
  bytes_ += piece.size();
  return core::ok_status();
}

const std::string& BlobStore::Upload::id() {
  if (id_.empty()) {
    id_ = hash_->hex();
  }
  return id_;
}

core::Result<StoredBlob> BlobStore::Upload::finish(std::string_view expected_id) {
  StoredBlob blob{.id = id(), .bytes = bytes_, .known = false};
  if (!expected_id.empty() && expected_id != blob.id) {
    return Error{ErrorCode::kInvalidArgument,
                 "the content has the sha256 " + blob.id + ", not the one in the path", ""};
  }
  blob.known = store_->check(blob.id).has_value();
  if (blob.known) {
    return blob;
  }
  const std::string folder = store_->folder_of(blob.id);
  if (const auto synced = sync_file(fd_.get(), path_); !synced) {
    return synced.error();
  }
  if (const auto made = make_directories(folder); !made) {
    return made.error();
  }
  if (const auto renamed = rename_file(path_, store_->path_of(blob.id)); !renamed) {
    return renamed.error();
  }
  path_.clear();
  for (const std::string& directory : {folder, store_->directory_}) {
    if (const auto synced = sync_directory(directory); !synced) {
      return synced.error();
    }
  }
  return blob;
}

core::Result<StoredBlob> BlobStore::put(std::string_view content) const {
  auto upload = start_upload();
  if (!upload) {
    return upload.error();
  }
  if (const auto written = upload->write(content); !written) {
    return written.error();
  }
  return upload->finish({});
}

std::optional<std::uint64_t> BlobStore::find(std::string_view id) const {
  if (!api::is_sha256(id)) {
    return std::nullopt;
  }
  std::error_code code;
  const auto bytes = std::filesystem::file_size(path_of(id), code);
  return code ? std::nullopt : std::optional<std::uint64_t>(bytes);
}

Status BlobStore::check_open(int fd, std::string_view id) const {
  struct stat found {};
  if (::fstat(fd, &found) != 0) {
    return file_error("cannot look at", path_of(id), errno);
  }
  std::string stamp;
  for (const std::int64_t part :
       {std::int64_t{found.st_size}, static_cast<std::int64_t>(found.st_ino),
        std::int64_t{found.st_mtim.tv_sec}, std::int64_t{found.st_mtim.tv_nsec},
        std::int64_t{found.st_ctim.tv_sec}, std::int64_t{found.st_ctim.tv_nsec}}) {
    stamp += std::to_string(part) + " ";
  }
  {
    const core::MutexLock lock(whole_->mutex);
    const auto known = whole_->stamps.find(id);
    if (known != whole_->stamps.end() && known->second == stamp) {
      return core::ok_status();
    }
  }
  core::Sha256 hash;
  std::vector<std::byte> piece(std::size_t{1} << 20U);
  for (std::uint64_t offset = 0;;) {
    const auto got = read_at(fd, piece, offset, path_of(id));
    if (!got) {
      return damaged(id);  // The disk cannot read it.
    }
    if (*got == 0) {
      break;
    }
    hash.add(piece.data(), *got);
    offset += *got;
  }
  if (hash.hex() != id) {
    return damaged(id);
  }
  const core::MutexLock lock(whole_->mutex);
  if (whole_->stamps.size() >= kWholeMost) {
    whole_->stamps.clear();
  }
  whole_->stamps[std::string(id)] = std::move(stamp);
  return core::ok_status();
}

core::Result<UniqueFd> BlobStore::open_blob(std::string_view id) const {
  if (!api::is_sha256(id)) {
    return Error{ErrorCode::kNotFound, "no asset has this id", ""};
  }
  auto fd = open_file(path_of(id), O_RDONLY);
  if (!fd) {
    return fd.error().code == ErrorCode::kNotFound ? gone(id) : fd.error();
  }
  if (const Status whole = check_open(fd->get(), id); !whole) {
    return whole.error();
  }
  return fd;
}

Status BlobStore::check(std::string_view id) const {
  const auto fd = open_blob(id);
  return fd ? core::ok_status() : Status(fd.error());
}

core::Result<core::SharedBytes> BlobStore::read(std::string_view id) const {
  if (!api::is_sha256(id)) {
    return Error{ErrorCode::kNotFound, "no asset has this id", ""};
  }
  const std::string path = path_of(id);
  const auto fd = open_file(path, O_RDONLY);
  if (!fd) {
    return fd.error().code == ErrorCode::kNotFound ? gone(id) : fd.error();
  }
  const auto size = file_bytes(fd->get(), path);
  if (!size) {
    return size.error();
  }
  auto content = std::make_shared<core::Bytes>(static_cast<std::size_t>(*size));
  const auto got = read_at(fd->get(), *content, 0, path);
  if (!got || *got != content->size() || core::sha256_hex(content->data(), content->size()) != id) {
    return damaged(id);
  }
  return core::SharedBytes(std::move(content));
}

Status BlobStore::remove(std::string_view id) const {
  if (!api::is_sha256(id)) {
    return core::ok_status();
  }
  return remove_file(path_of(id));
}

}  // namespace server
