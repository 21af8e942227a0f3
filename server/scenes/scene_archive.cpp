#include "server/scenes/scene_archive.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <utility>

#include "core/base/zip_names.h"
#include "core/scene_io/convert.h"

namespace server {

using core::Error;
using core::ErrorCode;

namespace {

std::string_view folder_of(std::string_view path) {
  const auto slash = path.rfind('/');
  return slash == std::string_view::npos ? std::string_view() : path.substr(0, slash);
}

/// Resolves `uri` against the folder of `document`; empty when it leaves the archive.
std::optional<std::string> path_in_archive(std::string_view document, std::string_view uri) {
  const std::string_view folder = folder_of(document);
  uri.remove_prefix(std::min(uri.find_first_not_of('/'), uri.size()));
  return core::plain_name(folder.empty() ? std::string(uri)
                                         : std::string(folder) + "/" + std::string(uri));
}

std::string stem_of(std::string_view path) {
  const std::string_view file = core::last_part(path);
  return core::folded_name(file.substr(0, file.rfind('.')));
}

/// Formats of models that are not read, and archives in the archive, named to explain a refusal.
constexpr std::array<std::string_view, 12> kOtherFormats = {
    "zip", "7z", "rar", "usdz", "fbx", "obj", "blend", "dae", "stl", "ply", "max", "usd"};

Error without_document(const std::vector<core::ZipEntry>& entries) {
  std::string text = "the archive contains no .glb and no .gltf";
  for (const std::string_view extension : kOtherFormats) {
    const auto other =
        std::find_if(entries.begin(), entries.end(), [extension](const core::ZipEntry& entry) {
          return !core::is_from_macos(entry.name) &&
                 core::extension_of_name(entry.name) == extension;
        });
    if (other != entries.end()) {
      const bool is_archive = extension == "zip" || extension == "7z" || extension == "rar";
      text += is_archive ? "; it contains another archive, \"" + other->name +
                               "\": unpack that one and upload it, if it contains glTF"
                         : "; \"" + other->name + "\" has a format that is not read";
      break;
    }
  }
  return Error{ErrorCode::kInvalidArgument, std::move(text), ""};
}

/// Of documents with the same name in the folders of glTF's sample models, one form of the model
/// each, returns the binary one, else the plain one; null if they are other documents.
const core::ZipEntry* chosen_form(const std::vector<const core::ZipEntry*>& documents) {
  const auto is_same_model = [&](const core::ZipEntry* each) {
    return stem_of(each->name) == stem_of(documents.front()->name) &&
           folder_of(folder_of(each->name)) == folder_of(folder_of(documents.front()->name));
  };
  if (!std::all_of(documents.begin(), documents.end(), is_same_model)) {
    return nullptr;
  }
  for (const std::string_view form : {"gltf-binary", "gltf"}) {
    const auto is_form = [form](const core::ZipEntry* each) {
      return core::folded_name(core::last_part(folder_of(each->name))) == form;
    };
    const auto found = std::find_if(documents.begin(), documents.end(), is_form);
    if (found != documents.end() &&
        std::count_if(documents.begin(), documents.end(), is_form) == 1) {
      return *found;
    }
  }
  return nullptr;
}

}  // namespace

core::Result<const core::ZipEntry*> main_document(const std::vector<core::ZipEntry>& entries) {
  std::vector<const core::ZipEntry*> topmost;
  std::ptrdiff_t least = 0;
  for (const core::ZipEntry& entry : entries) {
    const std::string extension = core::extension_of_name(entry.name);
    if ((extension != "glb" && extension != "gltf") || core::is_from_macos(entry.name)) {
      continue;
    }
    const auto depth = std::count(entry.name.begin(), entry.name.end(), '/');
    if (topmost.empty() || depth < least) {
      topmost.clear();
      least = depth;
    }
    if (depth == least) {
      topmost.push_back(&entry);
    }
  }
  if (topmost.empty()) {
    return without_document(entries);
  }
  if (topmost.size() == 1) {
    return topmost.front();
  }
  if (const core::ZipEntry* form = chosen_form(topmost)) {
    return form;
  }
  return Error{ErrorCode::kInvalidArgument,
               "the archive contains several scenes, such as \"" + topmost[0]->name + "\" and \"" +
                   topmost[1]->name + "\"; upload an archive with one of them",
               ""};
}

ArchiveFiles::ArchiveFiles(const std::vector<core::ZipEntry>& entries, std::string document)
    : document_(std::move(document)) {
  for (const core::ZipEntry& entry : entries) {
    if (!core::is_from_macos(entry.name)) {
      entries_.push_back(&entry);
      names_.add(entry.name);
    }
  }
}

const core::ZipEntry* ArchiveFiles::find(std::string_view name) const {
  for (const std::string& spelled : {std::string(name), core::with_slashes(name)}) {
    const auto path = path_in_archive(document_, spelled);
    const auto found = path ? names_.find(*path) : std::nullopt;
    if (found) {
      return entries_[*found];
    }
  }
  return nullptr;
}

bool ArchiveFiles::is_outside(std::string_view name) const {
  return name.starts_with('/') || !path_in_archive(document_, core::with_slashes(name));
}

}  // namespace server
