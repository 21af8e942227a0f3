#include "clients/cli/converted_model.h"

#include <span>
#include <vector>

#include "clients/cli/model_files.h"

namespace cli {

core::Result<core::Converted> convert_model(const std::string& path,
                                            const core::Converters& converters) {
  const auto files = read_model_files(path);
  if (!files) {
    return files.error();
  }
  std::vector<core::FileToConvert> given;
  for (const NamedFile& file : *files) {
    given.push_back(
        {.name = file.name,
         .content = std::as_bytes(std::span(file.content.data(), file.content.size()))});
  }
  return core::convert_to_glb(given, converters, {});
}

}  // namespace cli
