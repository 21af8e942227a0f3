#include "core/scene_io/gltf_load.h"

#include <algorithm>
#include <cstdint>
#include <utility>

#include "core/base/text.h"
#include "core/math/extreme_points.h"
#include "core/scene/drawn.h"
#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/gltf_check.h"
#include "core/scene_io/gltf_container.h"
#include "core/scene_io/gltf_environment.h"
#include "core/scene_io/gltf_ies.h"
#include "core/scene_io/gltf_images.h"
#include "core/scene_io/gltf_materials.h"
#include "core/scene_io/gltf_meshes.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_nodes.h"
#include "core/scene_io/gltf_objects.h"
#include "core/scene_io/gltf_place.h"
#include "core/scene_io/gltf_pointer.h"
#include "core/scene_io/gltf_repairs.h"
#include "core/scene_io/gltf_source.h"
#include "core/scene_io/shutter.h"

namespace core {
namespace {

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
                     " bytes when parsed; the whole scene may have " +
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
  const std::string list = joined(scene.variants, ", ");
  return Error{
      ErrorCode::kInvalidArgument,
      "the scene has no variant \"" + *name + "\"" + (list.empty() ? "" : "; it has " + list),
      "/variant"};
}

/// Returns the nodes that animations move or show; other animated values are set in `model`. In the
/// rest pose nothing moves, but what is shown at some time is known.
Result<AnimatedMoment> play_animations(const CheckedGltf& checked, GltfSource& source,
                                       const GltfOptions& options, tinygltf::Model& model,
                                       GltfRepairs& repairs) {
  if (!options.time_seconds) {
    AnimatedMoment rest;
    GltfRepairs ignored(/*is_strict=*/false);
    if (!source.tables().pointers.empty()) {
      auto any = evaluate_animations(model, source, {}, ignored);
      if (!any) {
        return any.error();
      }
      rest.has_emissive_strength = any->has_emissive_strength;
      for (const auto& [node, animated] : any->nodes) {
        rest.nodes[node].is_shown_once = animated.is_shown_once;
      }
    }
    return rest;
  }
  const double now = *options.time_seconds;
  const double opening = options.opening_seconds.value_or(now);
  auto moment = evaluate_animations(model, source,
                                    {now, opening, opening + options.shutter_seconds}, repairs);
  if (!moment) {
    return moment;
  }
  if (!moment->values.empty()) {
    if (options.shutter_seconds > 0) {
      repairs.note(
          "shutter", "",
          "While the shutter is open, properties animated by KHR_animation_pointer, other than "
          "transforms, keep their values at its opening.");
    }
    auto changed = parse_model(with_values(checked.model_json, moment->values));
    if (!changed) {
      return changed.error();
    }
    model = *std::move(changed);
  }
  return moment;
}

/// A document without the bytes that it refers to.
struct OpenedGltf {
  GltfContainer container;
  CheckedGltf checked;
  tinygltf::Model model;
  std::vector<int> texture_images;  ///< of each texture, or -1
  std::vector<int> needed_images;
};

Result<OpenedGltf> open_gltf(std::span<const std::byte> file, const ResolveUri& resolve,
                             int scene_index, const GltfLimits& limits, GltfRepairs& repairs) {
  auto container = open_container(file, limits, repairs);
  if (!container) {
    return container.error();
  }
  if (auto status = check_json_bytes(container->json, limits); !status) {
    return status.error();
  }
  auto checked = check_gltf(*container, repairs);
  if (!checked) {
    return checked.error();
  }
  auto model = parse_model(checked->model_json);
  if (!model) {
    return model.error();
  }
  OpenedGltf opened{*std::move(container), *std::move(checked), *std::move(model), {}, {}};
  opened.texture_images = choose_texture_images(opened.model, opened.checked.tables, resolve);
  for (std::size_t i = 0; i < opened.texture_images.size(); ++i) {
    const int image = opened.texture_images[i];
    const GltfTables& tables = opened.checked.tables;
    if (image >= 0 && (tables.uses("textures", i) ||
                       is_there(tables.images[static_cast<std::size_t>(image)], resolve))) {
      opened.needed_images.push_back(image);
    }
  }
  const auto of_environment = images_of_environment(opened.model, scene_index);
  if (!of_environment) {
    return of_environment.error();
  }
  opened.needed_images.insert(opened.needed_images.end(), of_environment->begin(),
                              of_environment->end());
  return opened;
}

/// Returns whether drawn meshes may differ between the times of an animation.
bool moves_meshes(const tinygltf::Model& model, const AnimatedMoment& animated,
                  const std::vector<int>& nodes) {
  std::vector<bool> moves(model.nodes.size());
  bool any = !animated.values.empty();
  for (const int node : nodes) {  // parents first
    const auto n = static_cast<std::size_t>(node);
    moves[n] = moves[n] || animated.nodes.contains(node);
    any = any || (moves[n] && model.nodes[n].mesh >= 0);
    for (const int child : model.nodes[n].children) {
      moves[static_cast<std::size_t>(child)] = moves[n];
    }
  }
  for (const tinygltf::Skin& skin : model.skins) {
    any = any || std::any_of(skin.joints.begin(), skin.joints.end(),
                             [&](int joint) { return moves[static_cast<std::size_t>(joint)]; });
  }
  return any;
}

/// A scene at one time, and the first and the last at which its meshes differ.
struct LoadedMoment {
  SceneDescription scene;
  double first_seconds = 0;
  double last_seconds = 0;
};

Result<LoadedMoment> load_moment(std::span<const std::byte> file, const ResolveUri& resolve,
                                 const GltfOptions& options) {
  GltfRepairs repairs(options.is_strict);
  auto opened = open_gltf(file, resolve, options.scene_index, options.limits, repairs);
  if (!opened) {
    return opened.error();
  }
  auto& [container, checked, model, texture_images, needed_images] = *opened;
  auto source =
      GltfSource::open(checked.tables, container, resolve, needed_images, options.limits, repairs);
  if (!source) {
    return source.error();
  }
  LoadedMoment loaded;
  SceneDescription& scene = loaded.scene;
  read_names(model, scene);
  auto variant = find_variant(scene, options.variant);
  if (!variant) {
    return variant.error();
  }
  auto animated = play_animations(checked, *source, options, model, repairs);
  if (!animated) {
    return animated.error();
  }
  scene.has_emissive_strength = animated->has_emissive_strength;
  GltfImages images(model, *source, texture_images, options.limits, scene);
  if (auto status = read_materials(model, checked.tables, images, scene); !status) {
    return status.error();
  }
  if (!options.geometry_only) {
    if (auto status = images.decode_all(); !status) {
      return status.error();
    }
  }
  if (auto status = number_objects(model, checked.tables, scene); !status) {
    return status.error();
  }
  if (auto status = read_profiles(*source, scene); !status) {
    return status.error();
  }
  const auto nodes = nodes_of_scene(model, options.scene_index);
  if (nodes && moves_meshes(model, *animated, *nodes)) {
    loaded.first_seconds = animated->first_seconds;
    loaded.last_seconds = animated->last_seconds;
  }
  GltfMeshes meshes(model, *source, options, *variant, repairs, scene);
  if (auto status = place_nodes(model, *source, meshes, options, animated->nodes, scene); !status) {
    return status.error();
  }
  if (!options.geometry_only) {
    auto environment = read_environment(model, *source, options, scene.warnings);
    if (!environment) {
      return environment.error();
    }
    scene.environment = *std::move(environment);
  }
  std::vector<Warning> all = repairs.take();
  all.insert(all.end(), scene.warnings.begin(), scene.warnings.end());
  shorten(all);
  scene.warnings = std::move(all);
  return loaded;
}

/// Number of times of an animation at which automatic cameras frame the model, with its first and
/// last: as many as core/scene_io/shutter.h reads.
constexpr int kFramedTimes = kShutterSteps;

/// Fills scene.framed, which must not depend on the time at which the scene was loaded. Errors:
/// those of load_gltf() that are not about the content of the file.
Status frame_animation(std::span<const std::byte> file, const ResolveUri& resolve,
                       const GltfOptions& options, LoadedMoment& loaded) {
  GltfOptions then = options;
  then.geometry_only = true;
  then.is_strict = false;
  then.origin = loaded.scene.origin;
  // One moment is in memory at a time.
  std::uint64_t most = 0;
  std::uint64_t taken = 0;
  then.limits.admit = [&](std::uint64_t bytes) {
    taken += bytes;
    const std::uint64_t more = taken > most ? taken - most : 0;
    most += more;
    return options.limits.admit ? options.limits.admit(more) : ok_status();
  };
  ExtremePoints extremes;
  for (int step = 0; step < kFramedTimes; ++step) {
    const double part = static_cast<double>(step) / (kFramedTimes - 1);
    then.time_seconds = loaded.first_seconds * (1 - part) + loaded.last_seconds * part;
    taken = 0;
    auto moment = load_moment(file, resolve, then);
    if (!moment) {
      if (moment.error().code == ErrorCode::kInvalidArgument) {
        continue;  // of another time than the one asked for
      }
      return moment.error();
    }
    moment->scene.images = loaded.scene.images;  // whose alpha hides triangles
    for (const Vec3& point : extreme_points_of(moment->scene)) {
      extremes.add(point);
    }
  }
  loaded.scene.framed = extremes.points();
  return ok_status();
}

}  // namespace

Result<SceneDescription> load_gltf(std::span<const std::byte> file, const ResolveUri& resolve,
                                   const GltfOptions& options) {
  if (options.shutter_seconds > 0 && !options.time_seconds) {
    return Error{ErrorCode::kInvalidArgument, "in the rest pose nothing moves", "/shutter_seconds"};
  }
  auto loaded = load_moment(file, resolve, options);
  if (!loaded) {
    return loaded.error();
  }
  SceneDescription& scene = loaded->scene;
  if (options.time_seconds && !options.origin && loaded->first_seconds < loaded->last_seconds) {
    if (const Status framed = frame_animation(file, resolve, options, *loaded); !framed) {
      return framed.error();
    }
  }
  if (!(options.shutter_seconds > 0) || scene.animations.empty()) {
    return std::move(scene);
  }
  GltfOptions then = options;
  then.geometry_only = true;
  then.origin = scene.origin;
  then.opening_seconds = options.time_seconds;
  std::vector<SceneDescription> later;
  for (int step = 1; step < kShutterSteps; ++step) {
    then.time_seconds =
        *options.time_seconds + options.shutter_seconds * step / (kShutterSteps - 1);
    auto moment = load_moment(file, resolve, then);
    if (!moment) {
      return moment.error();
    }
    later.push_back(std::move(moment->scene));
  }
  if (const Status opened = open_shutter(scene, later, options.limits.decoded_bytes_max); !opened) {
    return opened.error();
  }
  return std::move(scene);
}

Result<std::vector<std::string>> gltf_files(std::span<const std::byte> file, const HasFile& has,
                                            const GltfLimits& limits) {
  static const SharedBytes kThere = std::make_shared<const Bytes>();
  const auto resolve = [&has](std::string_view name) { return has(name) ? kThere : nullptr; };
  GltfRepairs repairs(/*is_strict=*/false);
  const auto opened = open_gltf(file, resolve, GltfOptions().scene_index, limits, repairs);
  if (!opened) {
    return opened.error();
  }
  std::vector<std::string> names;
  for (const SideFile& each : side_files(opened->checked.tables, opened->needed_images)) {
    if (each.required || has(each.name)) {
      names.push_back(each.name);
    }
  }
  return names;
}

}  // namespace core
