/// GltfSource: the bytes that a checked glTF document refers to: side files, data URIs, the binary
/// chunk, and views, which are decompressed on first use.
#pragma once

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Limits the memory for decoding a file; refuses before allocation.
class DecodeBudget {
 public:
  explicit DecodeBudget(const GltfLimits& limits)
      : bytes_max_(limits.decoded_bytes_max),
        paged_left_(limits.paged_bytes_max),
        admit_(limits.admit) {}
  /// Errors: kTooLarge if `bytes` more would exceed the limit; those of GltfLimits::admit.
  Status take(std::uint64_t bytes, const std::string& where);
  /// The same for an image, which may lie in a file (core/base/paged_memory.h).
  Status take_image(std::uint64_t bytes, const std::string& where);
  /// Returns the bytes that an image may have.
  std::size_t left() const noexcept { return std::max(bytes_max_ - used_, paged_left_); }

 private:
  std::size_t bytes_max_;
  std::size_t paged_left_;
  std::function<Status(std::uint64_t)> admit_;
  std::size_t used_ = 0;
};

/// A file beside the document.
struct SideFile {
  std::string name;       ///< its uri, percent-decoded once
  bool required = false;  ///< false: the content of a meshopt fallback, which nothing may read
};
/// Returns the files that a document needs, in its order, each once: of buffers, of the needed
/// images (indices of tables.images) and of light profiles.
std::vector<SideFile> side_files(const GltfTables& tables, std::span<const int> needed_images);

class GltfSource {
 public:
  /// Borrows `tables`, which must outlive it. `needed_images` index tables.images. Reads the
  /// buffers and light profiles that are used. Errors: kMissingFiles with all files that `resolve`
  /// does not have, kInvalidArgument.
  static Result<GltfSource> open(const GltfTables& tables, const GltfContainer& container,
                                 const ResolveUri& resolve, std::span<const int> needed_images,
                                 const GltfLimits& limits, GltfRepairs& repairs);

  /// Returns the content of a view, decompressed if needed. Pre: 0 <= index < views.size().
  Result<std::span<const std::byte>> view(int index);
  /// Returns the file of an image in `needed_images`.
  Result<std::span<const std::byte>> image_file(int index);

  /// Returns the file of a light profile. Pre: 0 <= index < profiles.size().
  Result<std::span<const std::byte>> profile_file(int index);

  const GltfTables& tables() const noexcept { return *tables_; }
  DecodeBudget& budget() noexcept { return budget_; }

 private:
  /// Sets buffer `index` to `file`, of which bytes that nothing reads may be missing.
  Status set_buffer(std::size_t index, std::span<const std::byte> file, GltfRepairs& repairs);
  GltfSource(const GltfTables& tables, const GltfLimits& limits)
      : tables_(&tables), budget_(limits) {}

  /// Returns the bytes of a uri; null if `resolve` does not have it.
  Result<SharedBytes> fetch(const std::string& uri, const ResolveUri& resolve,
                            const std::string& where);

  const GltfTables* tables_;
  DecodeBudget budget_;
  std::vector<SharedBytes> owned_;                      // keeps buffers_ alive
  std::vector<std::span<const std::byte>> buffers_;     // as many as tables_->buffers
  std::map<int, SharedBytes> image_files_;              // images with a uri
  std::vector<SharedBytes> profile_files_;              // null: in a view
  std::map<int, std::shared_ptr<Bytes>> decompressed_;  // by view
  std::set<std::string> absent_;                        // names that `resolve` does not have
};

}  // namespace core
