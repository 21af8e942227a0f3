/// Uploads of files to the server.
#pragma once

#include <string>

#include "clients/cli/api_client.h"
#include "clients/cli/job_json.h"

namespace cli {

/// Returns the asset id of the file; uploads it only if the server does not have it.
core::Result<std::string> upload_asset(ApiClient& client, const std::string& path);

/// Prints the warnings of a scene or job of the server to stderr, one per line. known: warnings
/// printed before; may be null.
void tell_warnings(const Json& described, const Json& known = {});

/// Returns whether the file's extension is that of a model rather than of an asset.
bool is_model(const std::string& path);

/// Returns the scene id for a .glb, .zip or .gltf file, or one that the server converts, and prints
/// its warnings; uploads the files beside a document that the server asks for, from its own folder
/// only. is_strict: the server refuses what it would mend.
core::Result<std::string> upload_scene(ApiClient& client, const std::string& path,
                                       bool is_strict = false);

}  // namespace cli
