/// BlobStore: files named by the sha256 of their content, below assets/.
///
/// A blob is written to a temporary file while it is hashed, synced, renamed to its final name, and
/// its folder is synced: a visible name has its whole content, even after a power failure. What is
/// read is compared with its name, so that a disk's errors are not taken for content.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "core/base/mutex.h"
#include "core/base/result.h"
#include "core/base/sha256.h"
#include "core/scene_io/gltf_load.h"
#include "server/store/files.h"

namespace server {

struct StoredBlob {
  std::string id;
  std::uint64_t bytes = 0;
  bool known = false;  ///< It existed already.
};

class BlobStore {
 public:
  /// Creates the folders and removes uploads that the previous process did not complete.
  static core::Result<BlobStore> open(const std::string& directory);

  /// One upload; the blob exists only after finish().
  class Upload {
   public:
    Upload(Upload&& other) noexcept;
    Upload& operator=(Upload&&) = delete;
    Upload(const Upload&) = delete;
    Upload& operator=(const Upload&) = delete;
    ~Upload();
    /// Errors: kNoSpace, kInternal.
    core::Status write(std::string_view piece);
    std::uint64_t bytes() const { return bytes_; }
    const std::string& path() const { return path_; }
    /// Hash of the content, which is complete then.
    const std::string& id();
    /// expected_id: the name that the client gave, or empty. Errors: kInvalidArgument when the
    /// content has another hash; kNoSpace, kInternal.
    core::Result<StoredBlob> finish(std::string_view expected_id);

   private:
    friend class BlobStore;
    Upload(const BlobStore& store, std::string path, UniqueFd fd)
        : store_(&store), path_(std::move(path)), fd_(std::move(fd)) {}
    const BlobStore* store_;
    std::string path_;
    UniqueFd fd_;
    std::unique_ptr<core::Sha256> hash_ = std::make_unique<core::Sha256>();
    std::string id_;  ///< Empty: not all is written.
    std::uint64_t bytes_ = 0;
  };

  core::Result<Upload> start_upload() const;
  /// Stores a whole blob from memory.
  core::Result<StoredBlob> put(std::string_view content) const;

  /// Returns the size; empty when there is no such blob.
  std::optional<std::uint64_t> find(std::string_view id) const;
  /// Returns the path that a blob with that id has or would have. Pre: the id is a sha256.
  std::string path_of(std::string_view id) const;
  /// Errors: kNotFound for what is no id; kInternal if the file is gone or does not match its name.
  core::Result<UniqueFd> open_blob(std::string_view id) const;
  /// Returns the whole content. Errors: of open_blob().
  core::Result<core::SharedBytes> read(std::string_view id) const;
  /// Hashes the file, unless it is the same as when it was last found whole: same place, size and
  /// times. Errors: of open_blob().
  core::Status check(std::string_view id) const;
  core::Status remove(std::string_view id) const;

 private:
  explicit BlobStore(std::string directory) : directory_(std::move(directory)) {}
  std::string folder_of(std::string_view id) const;
  core::Status check_open(int fd, std::string_view id) const;

  /// Files found whole, by id.
  struct Whole {
    core::Mutex mutex;
    std::map<std::string, std::string, std::less<>> stamps GUARDED_BY(mutex);
  };
  std::string directory_;
  std::unique_ptr<Whole> whole_ = std::make_unique<Whole>();
};

}  // namespace server
