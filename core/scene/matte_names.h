/// Names of objects and materials, and their Cryptomatte ids.
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

/// Returns MurmurHash3_x86_32 of the bytes, with seed 0 (Appleby).
std::uint32_t murmur3(std::string_view bytes) noexcept;

/// Returns the hash of a name, with one bit changed if it would not be a finite, normal float.
/// Never 0.
std::uint32_t matte_id(std::string_view name) noexcept;

/// Returns unique names: of equal names all but the first get "#" and their index in the file;
/// empty names become /nodes/N or /materials/N.
std::vector<std::string> object_names(std::span<const ObjectDescription> objects);
std::vector<std::string> material_names(std::span<const std::string> names);

/// Return the matte_id() of the names; those of objects are indexed by object id.
std::vector<std::uint32_t> object_mattes(std::span<const ObjectDescription> objects);
std::vector<std::uint32_t> material_mattes(std::span<const std::string> names);

/// Numbers the objects, instances and primitives of scenes that are not from a file, as write_glb()
/// writes them, and fills the tables of mattes.
void number_objects(SceneDescription& from, SceneData& to);

}  // namespace core
