/// Parts of a 3MF that libassimp does not read (the unit) or does not check (transforms).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/scene_io/gltf_load.h"

namespace core {

/// Returns the unit that the model names in its first element; libassimp leaves lengths as they
/// are.
std::string unit_of_3mf(const Bytes& file);

/// Returns an error text if a transform of a model has not the twelve numbers of the 3MF Core
/// Specification, 3.3; empty: none. libassimp reads beyond them.
std::string check_3mf(const Bytes& file);

}  // namespace core
