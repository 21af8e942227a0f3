/// Finds the files of a scene in an archive.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/file_names.h"
#include "core/base/result.h"
#include "core/base/zip_reader.h"

namespace server {

/// Returns the only .glb or .gltf of an archive; of several, the one in the topmost folder, or of
/// `glTF` beside `glTF-Binary` and other forms of the same model the latter. Errors:
/// kInvalidArgument for none, and for several others.
core::Result<const core::ZipEntry*> main_document(const std::vector<core::ZipEntry>& entries);

/// The files of an archive as its document names them. Borrows the entries.
class ArchiveFiles {
 public:
  ArchiveFiles(const std::vector<core::ZipEntry>& entries, std::string document);
  /// name: a percent-decoded uri. Null if it leaves the archive, or no file or several have the
  /// name (core::FileNames).
  const core::ZipEntry* find(std::string_view name) const;
  /// Whether a name leaves the archive.
  bool is_outside(std::string_view name) const;
  const core::FileNames& names() const noexcept { return names_; }

 private:
  std::string document_;
  std::vector<const core::ZipEntry*> entries_;
  core::FileNames names_;
};

}  // namespace server
