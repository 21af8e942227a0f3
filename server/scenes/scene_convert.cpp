// Uploads in other formats than glTF.

#include <algorithm>
#include <array>
#include <span>
#include <utility>

#include "core/base/text.h"
#include "server/scenes/scene_archive.h"
#include "server/scenes/scene_service.h"

namespace server {
namespace {

/// The document of a 3MF package (3MF Core Specification 1.3, 2.1), which is a zip archive.
constexpr std::string_view k3mfDocument = "3D/3dmodel.model";

/// Returns whether an OBJ may name such a file. The converter says which images it cannot use.
bool is_material(const std::string& extension) {
  constexpr std::array<std::string_view, 10> kNamed = {"mtl", "png", "jpg", "jpeg", "webp",
                                                       "tga", "bmp", "gif", "tif",  "tiff"};
  return std::find(kNamed.begin(), kNamed.end(), extension) != kNamed.end();
}

/// By the first bytes; add_file() says what is wrong with the rest.
bool is_gltf(std::string_view content) {
  const std::size_t first = content.find_first_not_of(" \t\r\n");
  return content.starts_with("glTF") || content.starts_with(core::kByteOrderMark) ||
         first == std::string_view::npos || content[first] == '{';
}

/// Returns the entry to convert: the outermost one; null if the archive has a glTF, or none.
const core::ZipEntry* model_of(const std::vector<core::ZipEntry>& entries,
                               const core::Converters& converters) {
  const core::ZipEntry* model = nullptr;
  const auto depth = [](const core::ZipEntry& entry) {
    return std::count(entry.name.begin(), entry.name.end(), '/');
  };
  for (const core::ZipEntry& entry : entries) {
    const std::string extension = core::extension_of_name(entry.name);
    if (extension == "glb" || extension == "gltf") {
      return nullptr;
    }
    if (converters.takes(extension) && (model == nullptr || depth(entry) < depth(*model))) {
      model = &entry;
    }
  }
  return model;
}

/// Returns names and contents of the model, first, and of what it may name.
core::Result<std::vector<std::pair<std::string, core::Bytes>>> unpack(
    SceneService::Upload& file, const std::vector<core::ZipEntry>& entries,
    const core::ZipEntry& model) {
  std::vector<const core::ZipEntry*> needed = {&model};
  for (const core::ZipEntry& entry : entries) {
    if (&entry != &model && is_material(core::extension_of_name(entry.name))) {
      needed.push_back(&entry);
    }
  }
  std::vector<std::pair<std::string, core::Bytes>> unpacked;
  for (const core::ZipEntry* const entry : needed) {
    if (auto room = file.lease.grow(entry->bytes); !room) {
      return room.error();
    }
    auto bytes = core::read_zip_entry(file.content, *entry);
    if (!bytes) {
      return bytes.error();
    }
    unpacked.emplace_back(entry->name, *std::move(bytes));
  }
  return unpacked;
}

}  // namespace

core::Result<bool> SceneService::convert(Upload& file, std::string_view extension,
                                         const std::vector<SideFile>& sides, SceneOrigin& origin) {
  const core::Converters& converters = options_.converters;
  std::vector<core::FileToConvert> files;
  std::vector<std::pair<std::string, core::Bytes>> unpacked;
  const std::uint64_t held = file.lease.bytes();
  const std::string_view content(reinterpret_cast<const char*>(file.content.data()),
                                 file.content.size());
  std::string format(extension);
  if (converters.takes(format)) {
    files.push_back({.name = "model." + format, .content = file.content});
    for (const SideFile& side : sides) {
      files.push_back(
          {.name = side.name,
           .content = std::as_bytes(std::span(side.content.data(), side.content.size()))});
    }
  } else if (content.starts_with("PK")) {
    const auto entries = core::read_zip_directory(file.content, options_.zip);
    if (!entries) {
      return false;  // add_zip() says why.
    }
    const auto is_3mf = [](const core::ZipEntry& entry) { return entry.name == k3mfDocument; };
    const core::ZipEntry* const model = model_of(*entries, converters);
    if (std::any_of(entries->begin(), entries->end(), is_3mf)) {
      format = "3mf";
      files.push_back({.name = "model.3mf", .content = file.content});
    } else if (model == nullptr) {
      return false;
    } else {
      format = core::extension_of_name(model->name);
      auto out = unpack(file, *entries, *model);
      if (!out) {
        return out.error();
      }
      unpacked = *std::move(out);
      for (const auto& [name, bytes] : unpacked) {
        files.push_back({.name = name, .content = bytes});
      }
    }
  } else if (!extension.empty() && !is_gltf(content)) {
    files.push_back({.name = "model." + format, .content = file.content});
  } else {
    return false;
  }
  if (converters.helper.empty() && !converters.commands.contains(format)) {
    return core::convert_to_glb(files, converters, {}).error();
  }
  const auto turn = uploads_.take(origin.access.tenant, origin.stop, std::nullopt);
  if (!turn) {
    return turn.error();
  }
  core::ConvertLimits limits;
  limits.time = options_.convert_time;
  limits.memory_bytes =
      std::min(limits.memory_bytes, core::conversion_bytes(format, files.front().content.size()));
  if (auto room = file.lease.grow(limits.memory_bytes); !room) {
    return room.error();
  }
  auto converted = core::convert_to_glb(files, converters, limits, origin.stop);
  file.lease.shrink_to(held);
  if (!converted) {
    return converted.error();
  }
  if (auto room = file.lease.grow(converted->glb.size()); !room) {
    return room.error();
  }
  file.content = std::move(converted->glb);
  origin.notes = std::move(converted->notes);
  return true;
}

}  // namespace server
