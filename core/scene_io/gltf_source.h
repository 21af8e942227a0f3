/// The bytes that a checked glTF document names: side files, data URIs, the binary chunk, and
/// views that are decompressed when they are first asked for.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_tables.h"

namespace core {

/// Counts the memory that a file makes us take; refuses before it is taken.
class DecodeBudget {
 public:
  explicit DecodeBudget(const GltfLimits& limits)
      : bytes_max_(limits.decoded_bytes_max), admit_(limits.admit) {}
  /// kTooLarge when `bytes` more would pass the limit; errors of GltfLimits::admit.
  Status take(std::uint64_t bytes, const std::string& where);
  std::size_t left() const noexcept { return bytes_max_ - used_; }

 private:
  std::size_t bytes_max_;
  std::function<Status(std::uint64_t)> admit_;
  std::size_t used_ = 0;
};

class GltfSource {
 public:
  /// `tables` is borrowed and outlives this. `needed_images` index tables.images.
  /// Errors: kMissingFiles naming all files that `resolve` does not have, kInvalidArgument.
  static Result<GltfSource> open(const GltfTables& tables, const GltfContainer& container,
                                 const ResolveUri& resolve, std::span<const int> needed_images,
                                 const GltfLimits& limits);

  /// Content of a view, decompressed if it is compressed. Pre: 0 <= index < views.size().
  Result<std::span<const std::byte>> view(int index);
  /// File of an image that was in `needed_images`.
  Result<std::span<const std::byte>> image_file(int index);

  /// File of a light profile. Pre: 0 <= index < profiles.size().
  Result<std::span<const std::byte>> profile_file(int index);

  const GltfTables& tables() const noexcept { return *tables_; }
  DecodeBudget& budget() noexcept { return budget_; }

 private:
  GltfSource(const GltfTables& tables, const GltfLimits& limits)
      : tables_(&tables), budget_(limits) {}

  /// Bytes behind a uri; null when `resolve` does not have it.
  Result<SharedBytes> fetch(const std::string& uri, const ResolveUri& resolve,
                            const std::string& where);

  const GltfTables* tables_;
  DecodeBudget budget_;
  std::vector<SharedBytes> owned_;                      // keeps buffers_ alive
  std::vector<std::span<const std::byte>> buffers_;     // as long as tables_->buffers
  std::map<int, SharedBytes> image_files_;              // those with a uri
  std::vector<SharedBytes> profile_files_;              // null: in a view
  std::map<int, std::shared_ptr<Bytes>> decompressed_;  // by view
};

}  // namespace core
