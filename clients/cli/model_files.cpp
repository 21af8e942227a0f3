#include "clients/cli/model_files.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "clients/cli/files.h"

namespace cli {
namespace {

std::string last_part(std::string_view name) {
  return std::string(name.substr(name.find_last_of("/\\") + 1));
}

/// Returns the names of files to which a text of OBJ (mtllib) or MTL (map_...) refers.
std::vector<std::string> obj_references(std::string_view text) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    std::string_view line = text.substr(at, end - at);
    at = end + 1;
    while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) {
      line.remove_suffix(1);
    }
    const std::size_t first = std::min(line.find_first_not_of(" \t"), line.size());
    line.remove_prefix(first);
    if (line.starts_with("mtllib ")) {
      names.emplace_back(line.substr(7));
    } else if (line.starts_with("map_") || line.starts_with("norm ")) {
      names.emplace_back(line.substr(line.find_last_of(" \t") + 1));  // after options
    }
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

}  // namespace

core::Result<std::vector<NamedFile>> read_model_files(const std::string& path) {
  auto model = read_file(path);
  if (!model) {
    return model.error();
  }
  std::vector<NamedFile> files = {{last_part(path), *std::move(model)}};
  // An OBJ names files of materials, and those name textures. Missing ones are a note.
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string extension = extension_of(files[i].name);
    if (extension != "obj" && extension != "mtl") {
      continue;
    }
    for (const std::string& name : obj_references(files[i].content)) {
      const bool is_known = std::any_of(files.begin(), files.end(), [&](const NamedFile& each) {
        return each.name == last_part(name);
      });
      const auto place = side_file_path(folder_of(path), name);
      auto file = is_known || !place ? core::Result<std::string>(core::Error{}) : read_file(*place);
      if (file) {
        files.push_back({last_part(name), *std::move(file)});
      }
    }
  }
  return files;
}

}  // namespace cli
