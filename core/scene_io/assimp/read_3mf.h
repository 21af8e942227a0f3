/// Parts of a 3MF that libassimp does not read (the unit) or does not check (transforms).
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/scene_io/gltf_load.h"

namespace core {

/// Returns the unit that the model names in its first element; libassimp leaves lengths as they
/// are.
std::string unit_of_3mf(const Bytes& file);

/// Returns an error text if there is no model, or one is not in UTF-8, has its objects in other
/// files, or has a transform without the twelve numbers of the 3MF Core Specification, 3.3, beyond
/// which libassimp reads; empty: none. Adds notes of materials that are left out.
std::string check_3mf(const Bytes& file, std::vector<std::string>& notes);

}  // namespace core
