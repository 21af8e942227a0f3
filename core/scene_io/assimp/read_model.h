/// Reads a model by libassimp and writes it as a GLB.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/scene_io/gltf_load.h"

namespace core {

struct ModelFile {
  std::string name;
  Bytes content;
};

struct ReadModel {
  Bytes glb;
  std::vector<std::string> notes;
  std::string fault;  ///< why there is no GLB; empty: there is one
};

/// extension: stl, obj, ply or 3mf, of the first file. The others are found by the last parts of
/// their names.
ReadModel read_model(const std::string& extension, std::vector<ModelFile> files);

}  // namespace core
