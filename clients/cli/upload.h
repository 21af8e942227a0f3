/// Uploads of files to the server.
#pragma once

#include <string>

#include "clients/cli/api_client.h"

namespace cli {

/// Returns the asset id of the file; uploads it only if the server does not have it.
core::Result<std::string> upload_asset(ApiClient& client, const std::string& path);

/// Returns the scene id for a .glb, .zip or .gltf file; uploads the files beside a document that
/// the server asks for, from its own folder only.
core::Result<std::string> upload_scene(ApiClient& client, const std::string& path);

}  // namespace cli
