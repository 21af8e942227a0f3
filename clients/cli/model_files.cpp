#include "clients/cli/model_files.h"

#include <algorithm>
#include <optional>
#include <string_view>
#include <utility>

#include "clients/cli/files.h"
#include "core/base/file_names.h"
#include "core/base/text.h"

namespace cli {
namespace {

/// Returns the text after its first word.
std::string_view without_first(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_of(" \t"), text.size()));
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  return text;
}

/// Returns what follows the keyword in each line of OBJ (mtllib) or MTL (map_..., norm) that names
/// a file: the name, or options and the name, which may contain spaces. Of a
/// mtllib also each word, since it may name several files.
std::vector<std::string> obj_references(std::string_view text) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size());
    const std::string_view line = core::trimmed(text.substr(at, end - at), " \t\r");
    at = end + 1;
    if (line.starts_with("mtllib ") || line.starts_with("map_") || line.starts_with("norm ")) {
      out.emplace_back(without_first(line));
    }
    if (line.starts_with("mtllib ")) {
      for (auto rest = without_first(line); !rest.empty(); rest = without_first(rest)) {
        out.emplace_back(rest.substr(0, rest.find_first_of(" \t")));
      }
    }
  }
  return out;
}

struct Reference {
  std::string name;  ///< without folders
  std::string path;
};

/// Returns the file that a reference means: the longest end of it that names one, or its last part,
/// where the path is that of another machine.
std::optional<Reference> find_reference(const std::string& folder, std::string_view reference) {
  for (std::string_view name = reference; !name.empty(); name = without_first(name)) {
    if (auto place = side_file_path(folder, name)) {
      return Reference{std::string(core::last_part(name)), *std::move(place)};
    }
  }
  const std::string last(core::last_part(reference));
  auto place = side_file_path(folder, last);
  return place ? std::optional(Reference{last, *std::move(place)}) : std::nullopt;
}

}  // namespace

core::Result<std::vector<NamedFile>> read_model_files(const std::string& path) {
  auto model = read_file(path);
  if (!model) {
    return model.error();
  }
  std::vector<NamedFile> files = {{std::string(core::last_part(path)), *std::move(model)}};
  // An OBJ names files of materials, and those name textures. Missing ones are a note.
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string extension = extension_of(files[i].name);
    if (extension != "obj" && extension != "mtl") {
      continue;
    }
    for (const std::string& reference : obj_references(files[i].content)) {
      const auto found = find_reference(folder_of(path), reference);
      const auto is_it = [&](const NamedFile& each) { return each.name == found->name; };
      if (!found || std::any_of(files.begin(), files.end(), is_it)) {
        continue;
      }
      if (auto file = read_file(found->path)) {
        files.push_back({found->name, *std::move(file)});
      }
    }
  }
  return files;
}

}  // namespace cli
