/// Files on the user's side: reading, writing, and the files that a glTF document names.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/result.h"

namespace cli {

/// The whole file. Errors: kNotFound or kInvalidArgument with the path in `where`.
core::Result<std::string> read_file(const std::string& path);
/// Writes next to `path` and renames, so that a half-written file is never seen. "-" is stdout.
core::Status write_file(const std::string& path, std::string_view bytes);
bool is_file(const std::string& path);
/// The model that a path means: the file itself, or the one .glb or .gltf in a folder (folders
/// inside not counted). Empty when it may be a name: nothing is there, or a folder without one
/// model that is named without a slash. Errors: kNotFound for other folders without a model or with
/// several.
core::Result<std::optional<std::string>> model_file(const std::string& path);

/// "png" of "a/b.PNG"; empty without one.
std::string extension_of(const std::string& path);
std::string folder_of(const std::string& path);

/// The uris of buffers and images in a glTF JSON document, in order, each once, data: left out.
core::Result<std::vector<std::string>> gltf_side_files(std::string_view document);
/// Where a side file is: percent-decoded and inside `folder`, symbolic links followed.
/// Errors: kForbidden for a place outside the folder or an absolute address, kNotFound.
core::Result<std::string> side_file_path(const std::string& folder, std::string_view uri);

/// SHA-256 as 64 lower-case hex digits.
std::string sha256_hex(std::string_view bytes);

}  // namespace cli
