#include "api/answers/matte_manifest.h"

#include <array>
#include <cstdio>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"
#include "core/scene/matte_names.h"

namespace api {
namespace {

std::string hex(std::uint32_t value) {
  std::array<char, 9> text{};
  std::snprintf(text.data(), text.size(), "%08x", value);
  return text.data();
}

std::string manifest(const std::vector<std::string>& names) {
  nlohmann::json out = nlohmann::json::object();
  for (const std::string& name : names) {
    out[name] = hex(core::matte_id(name));
  }
  return out.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::vector<std::string> names_of(const core::SceneSummary& scene, bool objects) {
  if (objects) {
    return core::object_names(scene.objects);
  }
  std::vector<std::string> materials = scene.materials;
  materials.emplace_back("default");
  return core::material_names(materials);
}

}  // namespace

void add_mattes(std::map<std::string, std::string>& texts, const core::FilmSettings& film,
                const core::Scene* scene) {
  for (const core::LayerEntry& row : core::layers()) {
    if (row.form != core::LayerForm::kMattes || !(film.*row.recorded)) {
      continue;
    }
    const std::string_view layer = core::matte_layer(row);
    constexpr std::size_t kKeyDigits = 7;
    const std::string key = "cryptomatte/" + hex(core::murmur3(layer)).substr(0, kKeyDigits) + "/";
    texts[key + "name"] = layer;
    texts[key + "hash"] = "MurmurHash3_32";
    texts[key + "conversion"] = "uint32_to_float32";
    if (scene != nullptr) {
      const bool objects = row.recorded == &core::FilmSettings::object_mattes;
      texts[key + "manifest"] = manifest(names_of(scene->summary(), objects));
    }
  }
}

}  // namespace api
