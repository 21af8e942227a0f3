/// A folder for the files of one task.
#pragma once

#include <cstdlib>
#include <filesystem>
#include <string>
#include <system_error>

namespace core {

/// Lies in the system's folder for temporary files; the destructor removes it with its content.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code none;
    std::string path = (std::filesystem::temp_directory_path(none) / "tessera-XXXXXX").string();
    path_ = !none && ::mkdtemp(path.data()) != nullptr ? path : "";
  }
  ~TemporaryFolder() {
    std::error_code none;
    if (!path_.empty()) {
      std::filesystem::remove_all(path_, none);
    }
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::string& path() const { return path_; }  ///< Empty if it could not be made.

 private:
  std::string path_;
};

}  // namespace core
