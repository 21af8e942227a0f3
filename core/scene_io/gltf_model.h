/// The structure of a glTF document as tinygltf sees it, after check_gltf(); and small readers for
/// extension objects.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"
#include "core/color/rgb.h"
#include "core/scene_io/tinygltf.h"

namespace core {

/// Parses the reduced document and checks what no schema row can express: the nodes form a forest,
/// cameras and spots have their objects, channels their samplers.
/// Errors: kInvalidArgument with a JSON pointer.
Result<tinygltf::Model> parse_model(const std::string& model_json);

/// The object of an extension, or null.
const tinygltf::Value* find_extension(const tinygltf::ExtensionMap& extensions, const char* name);

/// Members of an extension object; types were checked by the schemas.
float value_number(const tinygltf::Value& object, const char* name, float otherwise);
int value_integer(const tinygltf::Value& object, const char* name, int otherwise);
/// The elements of an array; none of anything else. (Value::Get takes an int or a size_t, by
/// version.)
const std::vector<tinygltf::Value>& value_array(const tinygltf::Value& value);
Rgb value_rgb(const tinygltf::Value& object, const char* name, Rgb otherwise);

}  // namespace core
