/// Bringing files to the server.
#pragma once

#include <string>

#include "clients/cli/api_client.h"

namespace cli {

/// The asset id of the file, sent only if the server does not have it yet.
core::Result<std::string> upload_asset(ApiClient& client, const std::string& path);

/// The scene id for a .glb, .zip or .gltf file; of the last the files it names are sent along, from
/// its own folder only.
core::Result<std::string> upload_scene(ApiClient& client, const std::string& path);

}  // namespace cli
