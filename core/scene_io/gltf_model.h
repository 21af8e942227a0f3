/// The structure of a glTF document as parsed by tinygltf after check_gltf(), and readers for
/// extension objects.
#pragma once

#include <string>
#include <vector>

#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Parses the reduced document and checks properties that the schemas cannot express: nodes form a
/// forest, cameras and spots have their objects, channels their samplers. Errors: kInvalidArgument
/// with a JSON pointer.
Result<tinygltf::Model> parse_model(const std::string& model_json);

/// Returns the object of an extension, or null.
const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Read members of an extension object; the schemas have checked the types.
float value_number(const tinygltf::Value& object, const char* name, float otherwise);
int value_integer(const tinygltf::Value& object, const char* name, int otherwise);
/// Returns the elements of an array; none for other values. (Value::Get takes an int or a size_t,
/// depending on the version.)
const std::vector<tinygltf::Value>& value_array(const tinygltf::Value& value);
Rgb value_rgb(const tinygltf::Value& object, const char* name, Rgb otherwise);

}  // namespace core
