#include "tests/support/asset_files.h"

#include <algorithm>
#include <cstdlib>

#include "core/base/check.h"
#include "core/image_io/image_io.h"
#include "tests/support/read_bytes.h"

namespace test_support {

namespace fs = std::filesystem;

namespace {

fs::path named_folder() {
  const char* named = std::getenv("TESSERA_ASSETS");
  return named != nullptr ? fs::path(named)
                          : fs::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "assets";
}

}  // namespace

std::optional<fs::path> assets_folder() {
  const fs::path folder = named_folder();
  std::error_code error;
  if (!fs::is_directory(folder, error)) {
    return std::nullopt;
  }
  return folder;
}

std::string missing_assets() {
  return "DID NOT RUN: no assets at " + named_folder().string() +
         "; TESSERA_ASSETS can name another folder";
}

std::vector<std::string> asset_names(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string extension = entry.path().extension().string();
    if (entry.is_regular_file() && (extension == ".glb" || extension == ".gltf")) {
      names.push_back(entry.path().lexically_relative(folder).generic_string());
    }
  }
  std::sort(names.begin(), names.end());
  return names;
}

core::Result<core::SceneDescription> load_asset(const fs::path& file,
                                                const core::GltfOptions& options) {
  const fs::path home = file.parent_path();
  const auto resolve = [&home](std::string_view uri) -> core::SharedBytes {
    const fs::path side = home / std::string(uri);
    std::error_code error;
    if (!fs::is_regular_file(side, error)) {
      return nullptr;
    }
    return std::make_shared<const core::Bytes>(read_bytes(side));
  };
  return core::load_gltf(read_bytes(file), resolve, options);
}

std::shared_ptr<const core::Environment> load_sky(const fs::path& file,
                                                  const core::EnvironmentSettings& settings) {
  const auto image = core::decode_image(read_bytes(file), core::ImageLimits{});
  CHECK(image);
  auto sky = core::Environment::create(&*image, settings);
  CHECK(sky);
  return *sky;
}

}  // namespace test_support
