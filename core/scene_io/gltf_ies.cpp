#include "core/scene_io/gltf_ies.h"

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "core/scene_io/ies.h"

namespace core {
namespace {

/// A number of at least two characters becomes a double, and by symmetry up to four times a float
/// of the intensity and two of the sampling distribution.
constexpr std::uint64_t kBytesPerCharacter = 28;

}  // namespace

Status read_profiles(GltfSource& source, SceneDescription& scene) {
  for (std::size_t i = 0; i < source.tables().profiles.size(); ++i) {
    const std::string where = "/extensions/EXT_lights_ies/lights/" + std::to_string(i);
    if (!source.tables().uses("light profiles", i)) {
      scene.profiles.push_back(nullptr);
      continue;
    }
    const auto file = source.profile_file(static_cast<int>(i));
    if (!file) {
      return file.error();
    }
    if (auto status = source.budget().take(file->size() * kBytesPerCharacter, where); !status) {
      return status.error();
    }
    const std::string_view text(reinterpret_cast<const char*>(file->data()), file->size());
    std::vector<std::string> warnings;
    auto profile = read_ies(text, warnings);
    if (!profile) {
      return Error{profile.error().code, profile.error().message, where};
    }
    for (std::string& warning : warnings) {
      scene.warnings.emplace_back("light_profile", where, std::move(warning));
    }
    scene.profiles.push_back(std::make_shared<const IesProfile>(*std::move(profile)));
  }
  return ok_status();
}

}  // namespace core
