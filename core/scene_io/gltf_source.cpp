#include "core/scene_io/gltf_source.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <utility>

#include "core/base/file_names.h"
#include "core/scene_io/gltf_meshopt.h"
#include "core/scene_io/gltf_uri.h"

namespace core {
namespace {

/// Decoded data also exists in the scene, with mipmaps or the acceleration structure, and
/// temporarily during the build. Measured by tests/stress/memory --measure: 2.9 for textures
/// (WaterBottle.glb), 1.6 for triangles (gen_big_terrain.glb).
constexpr std::uint64_t kBuildFactor = 3;

}  // namespace

Status DecodeBudget::take(std::uint64_t bytes, const std::string& where) {
  if (bytes > bytes_max_ - used_) {
    return Error{ErrorCode::kTooLarge,
                 std::to_string(bytes) + " bytes when decoded, after " + std::to_string(used_) +
                     "; the whole scene may have " + std::to_string(bytes_max_),
                 where};
  }
  used_ += bytes;
  return admit_ ? admit_(bytes * kBuildFactor) : ok_status();
}

Status DecodeBudget::take_image(std::uint64_t bytes, const std::string& where) {
  if (resident_bytes(bytes) > 0) {
    return take(bytes, where);
  }
  if (bytes > paged_left_) {
    return Error{ErrorCode::kTooLarge,
                 std::to_string(bytes) +
                     " bytes when decoded; the large images of the scene may have " +
                     std::to_string(paged_left_) + " more",
                 where};
  }
  paged_left_ -= bytes;
  return admit_ ? admit_(0) : ok_status();
}

Result<SharedBytes> GltfSource::fetch(const std::string& uri, const ResolveUri& resolve,
                                      const std::string& where) {
  if (is_data_uri(uri)) {
    if (auto status = budget_.take(uri.size() / 4 * 3, where); !status) {
      return status.error();
    }
    auto bytes = decode_data_uri(uri);
    if (!bytes) {
      return Error{bytes.error().code, bytes.error().message, where + "/uri"};
    }
    return SharedBytes(std::make_shared<const Bytes>(*std::move(bytes)));
  }
  if (has_scheme(uri)) {
    return Error{
        ErrorCode::kInvalidArgument,
        "\"" + shown_uri(uri) + "\" is not relative; only files that come with the scene are read",
        where + "/uri"};
  }
  const std::string name = percent_decode(uri);
  SharedBytes bytes = resolve ? resolve(name) : SharedBytes();
  if (bytes == nullptr) {
    absent_.insert(name);
  }
  return bytes;
}

std::vector<SideFile> side_files(const GltfTables& tables, std::span<const int> needed_images) {
  std::vector<SideFile> files;
  std::map<std::string, std::size_t> places;  // by name
  const auto add = [&](const std::optional<std::string>& uri, bool required) {
    if (!uri || is_data_uri(*uri) || has_scheme(*uri)) {
      return;
    }
    const std::string name = percent_decode(*uri);
    const auto [place, is_new] = places.try_emplace(name, files.size());
    if (is_new) {
      files.push_back({name, required});
    } else {
      SideFile& known = files[place->second];
      known.required = known.required || required;
    }
  };
  for (std::size_t i = 0; i < tables.buffers.size(); ++i) {
    if (tables.uses("buffers", i)) {
      add(tables.buffers[i].uri, !tables.buffers[i].is_meshopt_fallback);
    }
  }
  for (const int image : needed_images) {
    add(tables.images[static_cast<std::size_t>(image)].uri, true);
  }
  for (std::size_t i = 0; i < tables.profiles.size(); ++i) {
    if (tables.uses("light profiles", i)) {
      add(tables.profiles[i].uri, true);
    }
  }
  return files;
}

Result<GltfSource> GltfSource::open(const GltfTables& tables, const GltfContainer& container,
                                    const ResolveUri& resolve, std::span<const int> needed_images,
                                    const GltfLimits& limits, GltfRepairs& repairs) {
  GltfSource source(tables, limits);
  for (std::size_t i = 0; i < tables.buffers.size(); ++i) {
    const GltfBuffer& buffer = tables.buffers[i];
    const std::string where = "/buffers/" + std::to_string(i);
    source.buffers_.emplace_back();
    const bool is_used = tables.uses("buffers", i);  // others are read if they can be
    if (tables.fault_of("buffers", static_cast<int>(i)) != nullptr) {
      continue;
    }
    if (!buffer.uri) {
      if (!buffer.is_meshopt_fallback) {
        if (auto status = source.set_buffer(i, container.bin, repairs); !status && is_used) {
          return status.error();
        }
      }
      continue;
    }
    auto bytes = source.fetch(*buffer.uri, resolve, where);
    if (!bytes && is_used) {
      return bytes.error();
    }
    if (!bytes || *bytes == nullptr) {
      continue;
    }
    if (auto status = source.set_buffer(i, **bytes, repairs); !status && is_used) {
      return status.error();
    }
    source.owned_.push_back(*std::move(bytes));
  }
  for (const int i : needed_images) {
    const GltfImage& image = tables.images[static_cast<std::size_t>(i)];
    if (!image.uri || source.image_files_.contains(i)) {
      continue;
    }
    auto bytes = source.fetch(*image.uri, resolve, "/images/" + std::to_string(i));
    if (!bytes) {
      return bytes.error();
    }
    source.image_files_[i] = *std::move(bytes);
  }
  for (std::size_t i = 0; i < tables.profiles.size(); ++i) {
    const GltfProfile& profile = tables.profiles[i];
    SharedBytes& file = source.profile_files_.emplace_back();
    if (!profile.uri || !tables.uses("light profiles", i)) {
      continue;
    }
    auto bytes = source.fetch(*profile.uri, resolve,
                              "/extensions/EXT_lights_ies/lights/" + std::to_string(i));
    if (!bytes) {
      return bytes.error();
    }
    file = *std::move(bytes);
  }
  std::vector<std::string> missing;
  std::vector<std::string> outside;
  for (const SideFile& file : side_files(tables, needed_images)) {
    if (file.required && source.absent_.contains(file.name)) {
      missing.push_back(file.name);
      if (!plain_name(with_slashes(file.name))) {
        outside.push_back(file.name);
      }
    }
  }
  if (!missing.empty()) {
    return missing_files(missing, outside);
  }
  return source;
}

Status GltfSource::set_buffer(std::size_t index, std::span<const std::byte> file,
                              GltfRepairs& repairs) {
  const std::uint64_t bytes = tables_->buffers[index].bytes;
  if (file.size() >= bytes) {
    buffers_[index] = file.first(bytes);
    return ok_status();
  }
  const std::string where = "/buffers/" + std::to_string(index) + "/byteLength";
  std::string fault =
      std::to_string(bytes) + " bytes, but the file has only " + std::to_string(file.size());
  if (needed_bytes(*tables_, index) > file.size()) {
    return Error{ErrorCode::kInvalidArgument, std::move(fault), where};
  }
  buffers_[index] = file;
  return repairs.mended("padding", where, std::move(fault), "nothing reads the missing ones");
}

Result<std::span<const std::byte>> GltfSource::view(int index) {
  if (const Error* fault = tables_->fault_of("bufferViews", index)) {
    return *fault;
  }
  const GltfView& view = tables_->views[static_cast<std::size_t>(index)];
  if (!view.meshopt) {
    const auto buffer = buffers_[static_cast<std::size_t>(view.buffer)];
    if (buffer.size() < view.offset || buffer.empty()) {
      return Error{ErrorCode::kInvalidArgument, "the view reads a buffer without content",
                   "/bufferViews/" + std::to_string(index)};
    }
    // Of a buffer that is too short, set_buffer() has checked what is read.
    return buffer.subspan(view.offset, std::min(view.bytes, buffer.size() - view.offset));
  }
  auto& decompressed = decompressed_[index];
  if (decompressed == nullptr) {
    const std::string where =
        "/bufferViews/" + std::to_string(index) + "/extensions/EXT_meshopt_compression";
    const GltfMeshopt& meshopt = *view.meshopt;
    const auto buffer = buffers_[static_cast<std::size_t>(meshopt.buffer)];
    if (buffer.size() < meshopt.offset + meshopt.bytes) {
      return Error{ErrorCode::kInvalidArgument, "the view reads a buffer without content", where};
    }
    if (auto status = budget_.take(view.bytes, where); !status) {
      return status.error();
    }
    auto bytes =
        decode_meshopt(meshopt, buffer.subspan(meshopt.offset, meshopt.bytes), view.bytes, where);
    if (!bytes) {
      return bytes.error();
    }
    decompressed = std::make_shared<Bytes>(*std::move(bytes));
  }
  return std::span<const std::byte>(*decompressed);
}

Result<std::span<const std::byte>> GltfSource::image_file(int index) {
  if (const Error* fault = tables_->fault_of("images", index)) {
    return *fault;
  }
  const GltfImage& image = tables_->images[static_cast<std::size_t>(index)];
  if (image.view >= 0) {
    return view(image.view);
  }
  const auto it = image_files_.find(index);
  if (it == image_files_.end() || it->second == nullptr) {
    return Error{ErrorCode::kMissingFiles, "the image file is missing",
                 "/images/" + std::to_string(index)};
  }
  return std::span<const std::byte>(*it->second);
}

Result<std::span<const std::byte>> GltfSource::profile_file(int index) {
  const auto i = static_cast<std::size_t>(index);
  if (const int view_index = tables_->profiles[i].view; view_index >= 0) {
    return view(view_index);
  }
  return std::span<const std::byte>(*profile_files_[i]);
}

}  // namespace core
