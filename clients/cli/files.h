/// Local files: reading, writing, and the files beside a glTF document.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/base/result.h"

namespace cli {

/// Reads the whole file. Errors: kNotFound or kInvalidArgument with the path in `where`.
core::Result<std::string> read_file(const std::string& path);
/// Writes next to the file and renames, so that no half-written file is visible. Symbolic links are
/// kept: the file behind them is written. Devices and pipes are written in place. "-" is stdout.
core::Status write_file(const std::string& path, std::string_view bytes);
/// Returns the error of write_file() if the folder of `path` does not take files.
core::Status check_writable(const std::string& path);
bool is_file(const std::string& path);
/// Returns the model at a path: the file itself, or the only .glb or .gltf in a folder (not in its
/// subfolders). Returns empty if the path may be the name of a scene: no such file, or a folder
/// without a single model whose name has no slash. Errors: kNotFound for other folders without a
/// model or with several.
core::Result<std::optional<std::string>> model_file(const std::string& path);

/// Returns "png" for "a/b.PNG"; empty without an extension.
std::string extension_of(const std::string& path);
std::string folder_of(const std::string& path);

/// Returns the path of a side file inside `folder`, with symbolic links resolved: of that name,
/// else of the only one that Windows or macOS would take for it (core::FileNames). name: a uri,
/// percent-decoded. Errors: kForbidden for a path outside the folder or an absolute address,
/// kNotFound.
core::Result<std::string> side_file_path(const std::string& folder, std::string_view name);

}  // namespace cli
