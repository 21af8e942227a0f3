/// Names of objects and materials, and the ids that Cryptomatte makes of them.
///
/// Source: Friedman and Jones 2015, "Fully automatic ID mattes with support for motion blur and
/// transparency", and the Cryptomatte specification 1.2.0, Psyop.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/description/scene_description.h"
#include "core/scene/scene_data.h"

namespace core {

/// MurmurHash3_x86_32 of the bytes, seed 0 (Appleby).
std::uint32_t murmur3(std::string_view bytes) noexcept;

/// The hash of a name, changed in one bit where its bits would be no finite, normal float. Never 0.
std::uint32_t matte_id(std::string_view name) noexcept;

/// No two are equal: of equal names all but the first get "#" and their number in the file, and
/// names that are empty are /nodes/N or /materials/N.
std::vector<std::string> object_names(std::span<const ObjectDescription> objects);
std::vector<std::string> material_names(std::span<const std::string> names);

/// matte_id() of the names; of objects by their id.
std::vector<std::uint32_t> object_mattes(std::span<const ObjectDescription> objects);
std::vector<std::uint32_t> material_mattes(std::span<const std::string> names);

/// Numbers the objects, instances and primitives of what was not made of a file, as write_glb()
/// writes them, and fills the tables of mattes.
void number_objects(SceneDescription& from, SceneData& to);

}  // namespace core
