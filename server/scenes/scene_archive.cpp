#include "server/scenes/scene_archive.h"

#include <algorithm>
#include <cstddef>

namespace server {

using core::Error;
using core::ErrorCode;

std::string path_in_archive(std::string_view document, std::string_view uri) {
  const auto slash = document.rfind('/');
  std::string path(slash == std::string_view::npos ? std::string_view()
                                                   : document.substr(0, slash));
  while (!uri.empty()) {
    const auto next = uri.find('/');
    const std::string_view part = uri.substr(0, next);
    uri = next == std::string_view::npos ? std::string_view() : uri.substr(next + 1);
    if (part.empty() || part == ".") {
      continue;
    }
    if (part == "..") {
      if (path.empty()) {
        return {};
      }
      const auto parent = path.rfind('/');
      path.resize(parent == std::string::npos ? 0 : parent);
      continue;
    }
    path += path.empty() ? "" : "/";
    path += part;
  }
  return path;
}

namespace {

bool ends_with(std::string_view text, std::string_view end) {
  return text.size() >= end.size() && text.substr(text.size() - end.size()) == end;
}

}  // namespace

core::Result<const ZipEntry*> main_document(const std::vector<ZipEntry>& entries) {
  const ZipEntry* best = nullptr;
  std::ptrdiff_t best_depth = 0;
  bool tie = false;
  for (const ZipEntry& entry : entries) {
    if (!ends_with(entry.name, ".glb") && !ends_with(entry.name, ".gltf")) {
      continue;
    }
    const auto depth = std::count(entry.name.begin(), entry.name.end(), '/');
    if (best == nullptr || depth < best_depth) {
      best = &entry;
      best_depth = depth;
      tie = false;
    } else {
      tie = tie || depth == best_depth;
    }
  }
  if (best == nullptr || tie) {
    return Error{ErrorCode::kInvalidArgument,
                 best == nullptr
                     ? "the archive contains no .glb and no .gltf"
                     : "the archive contains several .glb or .gltf files in the same folder",
                 ""};
  }
  return best;
}

}  // namespace server
