/// The folder of third-party glTF assets: finding, listing and loading its files.
///
/// TESSERA_ASSETS names the folder; else it is ../shared/assets beside the repository.
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/lights/environment.h"
#include "core/scene/scene.h"
#include "core/scene_io/gltf_load.h"

namespace test_support {

/// Empty when there is no such folder.
std::optional<std::filesystem::path> assets_folder();
/// Every .glb and .gltf of the folder and of those in it, sorted; relative to the folder.
std::vector<std::string> asset_names(const std::filesystem::path& folder);

/// The whole file; empty when it cannot be read.
core::Bytes read_file(const std::filesystem::path& file);
/// Side files come from the asset's own folder.
core::Result<core::SceneDescription> load_asset(const std::filesystem::path& file,
                                                const core::GltfOptions& options = {});
/// An equirectangular picture as the sky; stops the program when it cannot be read.
std::shared_ptr<const core::Environment> load_sky(const std::filesystem::path& file,
                                                  const core::EnvironmentSettings& settings = {});

}  // namespace test_support
