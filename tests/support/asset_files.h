/// Finds, lists and loads files of the folder of third-party glTF assets.
///
/// TESSERA_ASSETS names the folder; the default is ../shared/assets next to the repository.
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

/// Returns nothing if the folder does not exist.
std::optional<std::filesystem::path> assets_folder();
/// Returns why tests that need the folder are skipped, with its path.
std::string missing_assets();
/// Lists every .glb and .gltf of the folder and its subfolders, sorted; relative to the folder.
std::vector<std::string> asset_names(const std::filesystem::path& folder);

/// Loads an asset; external files are read from the asset's folder.
core::Result<core::SceneDescription> load_asset(const std::filesystem::path& file,
                                                const core::GltfOptions& options = {});
/// Loads an equirectangular image as the environment; stops the program if it cannot be read.
std::shared_ptr<const core::Environment> load_sky(const std::filesystem::path& file,
                                                  const core::EnvironmentSettings& settings = {});

}  // namespace test_support
