/// A model with the files beside it that its format does not contain.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"

namespace cli {

struct NamedFile {
  std::string name;  ///< without folders, unless another file has this name
  std::string content;
};
/// Returns the model, and of an OBJ the materials and textures that lie beside it. (For those of a
/// glTF the server asks.) Errors: of read_file() for the model.
core::Result<std::vector<NamedFile>> read_model_files(const std::string& path);

}  // namespace cli
