#include "clients/cli/model_files.h"

#include <algorithm>
#include <optional>
#include <set>
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

/// Returns the ASCII of text in UTF-16, as Windows' programs write it, without its zeros: enough
/// for keywords and most names. Other text stays.
std::string without_zeros(std::string_view text) {
  std::string out(text);
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    std::erase(out, '\0');
    out.erase(0, 2);
  } else if (text.starts_with("\xEF\xBB\xBF")) {
    out.erase(0, 3);
  }
  return out;
}

/// Returns what follows the keyword in each line of OBJ (mtllib) or MTL (map_..., norm) that names
/// a file: the name, or options and the name, which may contain spaces and be quoted. Of a
/// mtllib also each word, since it may name several files.
std::vector<std::string> obj_references(std::string_view text) {
  std::vector<std::string> out;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find_first_of("\r\n", at), text.size());
    const std::string_view line = core::trimmed(text.substr(at, end - at), " \t");
    at = end + 1;
    const std::string_view keyword = line.substr(0, line.find_first_of(" \t"));
    const std::string_view rest = without_first(line);
    if (keyword == "mtllib" || keyword.starts_with("map_") || keyword == "norm") {
      out.emplace_back(rest);
      if (rest.ends_with('"')) {
        const std::string_view open = rest.substr(0, rest.size() - 1);
        out.emplace_back(open.substr(open.rfind('"') + 1));
      }
    }
    if (keyword == "mtllib") {
      for (auto words = rest; !words.empty(); words = without_first(words)) {
        out.emplace_back(words.substr(0, words.find_first_of(" \t")));
      }
    }
  }
  return out;
}

struct Reference {
  std::string name;  ///< as the OBJ or MTL has it, with slashes
  std::string path;
};

/// Returns the file that a reference means: the longest end of it that names one, or its last part,
/// where the path is that of another machine.
std::optional<Reference> find_reference(const std::string& folder, std::string_view reference) {
  for (std::string_view name = reference; !name.empty(); name = without_first(name)) {
    if (auto place = side_file_path(folder, name)) {
      return Reference{core::with_slashes(name), *std::move(place)};
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
  std::set<std::string> known;  // paths
  // An OBJ names files of materials, and those name textures. Missing ones are a note.
  for (std::size_t i = 0; i < files.size(); ++i) {
    const std::string extension = extension_of(files[i].name);
    if (extension != "obj" && extension != "mtl") {
      continue;
    }
    for (const std::string& reference : obj_references(without_zeros(files[i].content))) {
      const auto found = find_reference(folder_of(path), reference);
      if (!found || !known.insert(found->path).second) {
        continue;
      }
      const std::string_view last = core::last_part(found->name);
      const bool is_taken = std::any_of(files.begin(), files.end(), [&](const NamedFile& each) {
        return core::last_part(each.name) == last;
      });
      if (auto file = read_file(found->path)) {
        files.push_back({is_taken ? found->name : std::string(last), *std::move(file)});
      }
    }
  }
  return files;
}

}  // namespace cli
