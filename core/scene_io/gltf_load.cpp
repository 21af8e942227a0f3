#include "core/scene_io/gltf_load.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/gltf_check.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_environment.h"
#include "core/scene_io/gltf_ies.h"
#include "core/scene_io/gltf_images.h"
#include "core/scene_io/gltf_materials.h"
#include "core/scene_io/gltf_meshes.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_objects.h"
#include "core/scene_io/gltf_place.h"
#include "core/scene_io/gltf_pointer.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/gltf_uri.h"
#include "core/scene_io/shutter.h"

namespace core {
namespace {

constexpr std::size_t kWarningsMax = 100;

// Memory of JSON as two documents, one after the other, and as tinygltf's model. Measured by
// tests/stress/memory --measure: 190 per number in a list; 300 per object of three members.
constexpr std::uint64_t kObjectBytes = 1000;
constexpr std::uint64_t kValueBytes = 200;
constexpr std::uint64_t kTextCopies = 3;

/// Returns kTooLarge if JSON would need more memory than the limit.
Status check_json_bytes(std::string_view json, const GltfLimits& limits) {
  std::uint64_t bytes = kTextCopies * json.size();
  bool in_string = false;
  for (std::size_t i = 0; i < json.size(); ++i) {
    const char c = json[i];
    if (in_string) {
      i += c == '\\' ? 1 : 0;
      in_string = c != '"';
    } else {
      in_string = c == '"';
      bytes += c == '{' ? kObjectBytes : c == ',' || c == ':' || c == '[' ? kValueBytes : 0;
    }
  }
  if (bytes > limits.decoded_bytes_max) {
    return Error{ErrorCode::kTooLarge,
                 "the JSON takes " + std::to_string(bytes) +
                     " bytes when parsed; the whole scene "
                     "may have " +
                     std::to_string(limits.decoded_bytes_max),
                 ""};
  }
  return limits.admit ? limits.admit(bytes) : ok_status();
}

void read_names(const tinygltf::Model& model, SceneDescription& scene) {
  const int own = model.defaultScene;
  if (own >= 0 && own < static_cast<int>(model.scenes.size())) {
    scene.name = model.scenes[static_cast<std::size_t>(own)].name;
  }
  scene.extensions = model.extensionsUsed;
  for (const tinygltf::Animation& animation : model.animations) {
    scene.animations.push_back(animation.name);
  }
  if (const auto* variants = find_extension(model.extensions, "KHR_materials_variants")) {
    for (const tinygltf::Value& variant : value_array(variants->Get("variants"))) {
      scene.variants.push_back(variant.Get("name").Get<std::string>());
    }
  }
}

Result<int> find_variant(const SceneDescription& scene, const std::optional<std::string>& name) {
  if (!name) {
    return -1;
  }
  const auto it = std::find(scene.variants.begin(), scene.variants.end(), *name);
  if (it != scene.variants.end()) {
    return static_cast<int>(it - scene.variants.begin());
  }
  std::string list;
  for (const std::string& variant : scene.variants) {
    list += (list.empty() ? "" : ", ") + variant;
  }
  return Error{
      ErrorCode::kInvalidArgument,
      "the scene has no variant \"" + *name + "\"" + (list.empty() ? "" : "; it has " + list),
      "/variant"};
}

/// Returns the nodes that animations move; other animated values are set in `model`.
Result<AnimatedNodes> play_animations(const CheckedGltf& checked, GltfSource& source,
                                      const GltfOptions& options, tinygltf::Model& model,
                                      std::vector<std::string>& warnings) {
  if (!options.time_seconds) {
    return AnimatedNodes();
  }
  auto moment = evaluate_animations(model, source, *options.time_seconds, warnings);
  if (!moment) {
    return moment.error();
  }
  if (!moment->values.empty()) {
    if (options.shutter_seconds > 0) {
      warnings.emplace_back(
          "While the shutter is open, properties animated by KHR_animation_pointer, other than "
          "transforms, keep their values at its opening.");
    }
    auto changed = parse_model(with_values(checked.model_json, moment->values));
    if (!changed) {
      return changed.error();
    }
    model = *std::move(changed);
  }
  return std::move(moment->nodes);
}

void keep_warnings_short(std::vector<std::string>& warnings) {
  if (warnings.size() > kWarningsMax) {
    const std::size_t more = warnings.size() - kWarningsMax;
    warnings.resize(kWarningsMax);
    warnings.push_back("and " + std::to_string(more) + " more warnings");
  }
}

Result<SceneDescription> load_moment(std::span<const std::byte> file, const ResolveUri& resolve,
                                     const GltfOptions& options) {
  auto container = open_container(file, options.limits);
  if (!container) {
    return container.error();
  }
  if (auto status = check_json_bytes(container->json, options.limits); !status) {
    return status.error();
  }
  auto checked = check_gltf(*container);
  if (!checked) {
    return checked.error();
  }
  auto model = parse_model(checked->model_json);
  if (!model) {
    return model.error();
  }
  const std::vector<int> texture_images = choose_texture_images(*model, checked->tables, resolve);
  std::vector<int> needed_images = texture_images;
  std::erase(needed_images, -1);
  const auto environment_images = images_of_environment(*model, options.scene_index);
  if (!environment_images) {
    return environment_images.error();
  }
  needed_images.insert(needed_images.end(), environment_images->begin(), environment_images->end());
  auto source =
      GltfSource::open(checked->tables, *container, resolve, needed_images, options.limits);
  if (!source) {
    return source.error();
  }
  SceneDescription scene;
  scene.warnings = std::move(checked->warnings);
  read_names(*model, scene);
  auto variant = find_variant(scene, options.variant);
  if (!variant) {
    return variant.error();
  }
  auto animated = play_animations(*checked, *source, options, *model, scene.warnings);
  if (!animated) {
    return animated.error();
  }
  GltfImages images(*model, *source, texture_images, options.limits, scene);
  if (auto status = read_materials(*model, images, scene); !status) {
    return status.error();
  }
  if (!options.geometry_only) {
    if (auto status = images.decode_all(); !status) {
      return status.error();
    }
  }
  if (auto status = number_objects(*model, checked->tables, scene); !status) {
    return status.error();
  }
  if (auto status = read_profiles(*source, scene); !status) {
    return status.error();
  }
  GltfMeshes meshes(*model, *source, options, *variant, scene);
  if (auto status = place_nodes(*model, *source, meshes, options, *animated, scene); !status) {
    return status.error();
  }
  if (!options.geometry_only) {
    auto environment = read_environment(*model, *source, options);
    if (!environment) {
      return environment.error();
    }
    scene.environment = *std::move(environment);
  }
  keep_warnings_short(scene.warnings);
  return scene;
}

}  // namespace

Result<SceneDescription> load_gltf(std::span<const std::byte> file, const ResolveUri& resolve,
                                   const GltfOptions& options) {
  if (options.shutter_seconds > 0 && !options.time_seconds) {
    return Error{ErrorCode::kInvalidArgument, "in the rest pose nothing moves", "/shutter_seconds"};
  }
  auto scene = load_moment(file, resolve, options);
  if (!scene || !(options.shutter_seconds > 0) || scene->animations.empty()) {
    return scene;
  }
  GltfOptions then = options;
  then.geometry_only = true;
  then.origin = scene->origin;
  std::vector<SceneDescription> later;
  for (int step = 1; step < kShutterSteps; ++step) {
    then.time_seconds =
        *options.time_seconds + options.shutter_seconds * step / (kShutterSteps - 1);
    auto moment = load_moment(file, resolve, then);
    if (!moment) {
      return moment.error();
    }
    later.push_back(*std::move(moment));
  }
  if (const Status opened = open_shutter(*scene, later, options.limits.decoded_bytes_max);
      !opened) {
    return opened.error();
  }
  return scene;
}

Result<std::vector<std::string>> gltf_uris(std::span<const std::byte> file,
                                           const GltfLimits& limits) {
  auto container = open_container(file, limits);
  if (!container) {
    return container.error();
  }
  if (auto status = check_json_bytes(container->json, limits); !status) {
    return status.error();
  }
  auto checked = check_gltf(*container);
  if (!checked) {
    return checked.error();
  }
  std::vector<std::string> uris;
  const auto add = [&uris](const std::optional<std::string>& uri) {
    if (uri && !is_data_uri(*uri)) {
      const std::string name = percent_decode(*uri);
      if (std::find(uris.begin(), uris.end(), name) == uris.end()) {
        uris.push_back(name);
      }
    }
  };
  for (const GltfBuffer& buffer : checked->tables.buffers) {
    add(buffer.uri);
  }
  for (const GltfImage& image : checked->tables.images) {
    add(image.uri);
  }
  for (const GltfProfile& profile : checked->tables.profiles) {
    add(profile.uri);
  }
  return uris;
}

}  // namespace core
