#include "clients/cli/converted_model.h"

#include <algorithm>
#include <deque>
#include <span>
#include <utility>
#include <vector>

#include "clients/cli/files.h"

namespace cli {

core::Result<core::Converted> convert_model(const std::string& path,
                                            const core::Converters& converters) {
  auto model = read_file(path);
  if (!model) {
    return model.error();
  }
  std::deque<std::pair<std::string, std::string>> contents;  // by name; references stay valid
  contents.emplace_back(path.substr(path.find_last_of('/') + 1), *std::move(model));
  // An OBJ names files of materials, and those name textures. Missing ones are a note.
  for (std::size_t i = 0; i < contents.size(); ++i) {
    const std::string extension = core::extension_of_name(contents[i].first);
    if (extension != "obj" && extension != "mtl") {
      continue;
    }
    for (const std::string& name : core::obj_references(contents[i].second)) {
      const bool is_known = std::any_of(contents.begin(), contents.end(),
                                        [&](const auto& each) { return each.first == name; });
      const auto place = side_file_path(folder_of(path), name);
      auto file = is_known || !place ? core::Result<std::string>(core::Error{}) : read_file(*place);
      if (file) {
        contents.emplace_back(name, *std::move(file));
      }
    }
  }
  std::vector<core::FileToConvert> files;
  for (const auto& [name, content] : contents) {
    files.push_back(
        {.name = name, .content = std::as_bytes(std::span(content.data(), content.size()))});
  }
  return core::convert_to_glb(files, converters, {});
}

}  // namespace cli
