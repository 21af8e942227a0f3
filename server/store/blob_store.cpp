#include "server/store/blob_store.h"

#include <atomic>
#include <filesystem>
#include <span>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

#include "api/requests.h"

namespace server {

using core::Error;
using core::ErrorCode;
using core::Status;

namespace {

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

core::Result<StoredBlob> BlobStore::Upload::finish(std::string_view expected_id) {
  StoredBlob blob{.id = hash_->hex(), .bytes = bytes_, .known = false};
  if (!expected_id.empty() && expected_id != blob.id) {
    return Error{ErrorCode::kInvalidArgument,
                 "the content has the sha256 " + blob.id + ", not the one in the path", ""};
  }
  blob.known = store_->find(blob.id).has_value();
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

core::Result<UniqueFd> BlobStore::open_blob(std::string_view id) const {
  if (!api::is_sha256(id)) {
    return Error{ErrorCode::kNotFound, "no asset has this id", ""};
  }
  return open_file(path_of(id), O_RDONLY);
}

core::Result<core::SharedBytes> BlobStore::read(std::string_view id) const {
  const auto fd = open_blob(id);
  if (!fd) {
    return fd.error();
  }
  const std::string path = path_of(id);
  const auto size = file_bytes(fd->get(), path);
  if (!size) {
    return size.error();
  }
  auto content = std::make_shared<core::Bytes>(static_cast<std::size_t>(*size));
  const auto got = read_at(fd->get(), *content, 0, path);
  if (!got) {
    return got.error();
  }
  if (*got != content->size()) {
    return Error{ErrorCode::kInternal, "the file is shorter than it was", path};
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
