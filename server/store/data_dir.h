/// The data directory: its layout, and a lock that excludes a second server.
#pragma once

#include <string>

#include "core/base/result.h"
#include "server/store/files.h"

namespace server {

class DataDir {
 public:
  /// Creates the folders and takes the lock. Errors: kConflict when another process holds it, with
  /// its process id; those of make_directories() when the path is not writable.
  static core::Result<DataDir> open(const std::string& path);

  const std::string& path() const { return path_; }
  std::string database_path() const { return path_ + "/tessera.db"; }
  std::string assets_path() const { return path_ + "/assets"; }
  std::string films_path() const { return path_ + "/films"; }
  std::string comparisons_path() const { return path_ + "/comparisons"; }
  std::string film_path(const std::string& job) const { return films_path() + "/" + job + ".film"; }
  std::string first_images_path() const { return path_ + "/looks"; }
  /// As server/routes/first_image_file.h.
  std::string first_images_path(const std::string& job) const {
    return first_images_path() + "/" + job;
  }

 private:
  DataDir(std::string path, UniqueFd lock) : path_(std::move(path)), lock_(std::move(lock)) {}
  std::string path_;
  UniqueFd lock_;
};

}  // namespace server
