#include "core/scene_io/gltf_place.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "core/base/invalid.h"
#include "core/scene_io/gltf_accessor.h"
#include "core/scene_io/gltf_animation.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_nodes.h"
#include "core/scene_io/gltf_origin.h"

namespace core {
namespace {

std::vector<float> narrowed(const std::vector<double>& values) {
  std::vector<float> out;
  for (const double v : values) {
    out.push_back(static_cast<float>(v));
  }
  return out;
}

// Returns whether a map has no inverse, which Embree instances need.
bool is_singular(const Transform& m) {
  const float lengths = length(m.x) * length(m.y) * length(m.z);
  return !(std::abs(m.determinant()) > 1e-9F * lengths);
}

class NodePlacer {
 public:
  NodePlacer(const tinygltf::Model& model, GltfSource& source, GltfMeshes& meshes,
             const GltfOptions& options, const AnimatedNodes& animated, SceneDescription& scene)
      : model_(model),
        source_(source),
        meshes_(meshes),
        options_(options),
        animated_(animated),
        scene_(scene) {}

  Status run() {
    auto world = world_matrices(model_, animated_);
    auto order = nodes_of_scene(model_, options_.scene_index);
    if (!world || !order) {
      return world ? order.error() : world.error();
    }
    world_ = *std::move(world);
    first_instance_.resize(model_.nodes.size());
    for (const ObjectDescription& object : scene_.objects) {
      first_instance_[object.id - 1] = object.first_instance;
    }
    const std::vector<bool> visible = visible_nodes(model_);
    const std::vector<bool> visible_once = visible_nodes(model_, animated_);
    for (const int node : *order) {
      place_camera(node);
      const bool is_visible = visible[static_cast<std::size_t>(node)];
      if (is_visible || visible_once[static_cast<std::size_t>(node)]) {
        // Hidden by an animation, a light is as if faded: still a light of the scene.
        const float shown = is_visible ? 1 : 0;
        place_light(node, shown);
        place_profile(node, shown);
      }
      if (!is_visible) {
        continue;
      }
      if (auto status = place_mesh(node); !status) {
        return status;
      }
    }
    count_from_origin();
    return ok_status();
  }

 private:
  const tinygltf::Node& node_at(int node) const {
    return model_.nodes[static_cast<std::size_t>(node)];
  }
  const Affine& matrix_of(int node) const { return world_[static_cast<std::size_t>(node)]; }

  /// Subtracts the scene's origin in double, before positions become floats.
  void count_from_origin() {
    scene_.origin =
        options_.origin ? *options_.origin : find_origin(scene_, instances_, scene_.warnings);
    const auto put = [this](const std::vector<Affine>& from, auto& to) {
      for (std::size_t i = 0; i < from.size(); ++i) {
        to[i].to_world = from[i].from(scene_.origin).to_transform();
      }
    };
    put(instances_, scene_.instances);
    put(lights_, scene_.lights);
    put(cameras_, scene_.cameras);
  }

  void place_camera(int node) {
    const int index = node_at(node).camera;
    if (index < 0 || source_.tables().fault_of("cameras", index) != nullptr) {
      return;
    }
    const tinygltf::Camera& in = model_.cameras[static_cast<std::size_t>(index)];
    CameraDescription& camera = scene_.cameras.emplace_back();
    camera.name = in.name.empty() ? node_at(node).name : in.name;
    camera.orthographic = in.type == "orthographic";
    if (camera.orthographic) {
      camera.x_magnification = static_cast<float>(std::abs(in.orthographic.xmag));
      camera.y_magnification = static_cast<float>(std::abs(in.orthographic.ymag));
      set_planes(camera, in.orthographic.znear, in.orthographic.zfar);
    } else {
      camera.vertical_fov_rad = static_cast<float>(in.perspective.yfov);
      camera.aspect_ratio = static_cast<float>(in.perspective.aspectRatio);
      set_planes(camera, in.perspective.znear, in.perspective.zfar);
    }
    cameras_.push_back(matrix_of(node));
  }

  /// Absent planes are 0 in tinygltf's model.
  static void set_planes(CameraDescription& camera, double znear, double zfar) {
    camera.near_m = static_cast<float>(std::max(znear, 0.0));
    if (zfar > znear) {
      camera.far_m = static_cast<float>(zfar);
    }
  }

  void place_light(int node, float shown) {
    const auto* extension = find_extension(node_at(node).extensions, "KHR_lights_punctual");
    if (extension == nullptr) {
      return;
    }
    const tinygltf::Light& in =
        model_.lights[static_cast<std::size_t>(value_integer(*extension, "light", 0))];
    PunctualLightDescription& light = scene_.lights.emplace_back();
    light.name = in.name.empty() ? node_at(node).name : in.name;
    light.type = in.type == "directional" ? PunctualType::kDirectional
                 : in.type == "spot"      ? PunctualType::kSpot
                                          : PunctualType::kPoint;
    const float intensity = static_cast<float>(in.intensity) * shown;
    const std::vector<float> color = narrowed(in.color);
    light.intensity =
        color.size() == 3 ? Rgb{color[0], color[1], color[2]} * intensity : Rgb(intensity);
    light.range_m = static_cast<float>(in.range);
    light.inner_cone_rad = static_cast<float>(in.spot.innerConeAngle);
    light.outer_cone_rad = static_cast<float>(in.spot.outerConeAngle);
    lights_.push_back(without_scale(matrix_of(node)));
    light.group = group_of(node);
  }

  void place_profile(int node, float shown) {
    const auto* extension = find_extension(node_at(node).extensions, "EXT_lights_ies");
    if (extension == nullptr) {
      return;
    }
    PunctualLightDescription& light = scene_.lights.emplace_back();
    light.name = node_at(node).name;
    light.type = PunctualType::kProfile;
    light.intensity =
        value_rgb(*extension, "color", Rgb(1)) * value_number(*extension, "multiplier", 1) * shown;
    light.profile = value_integer(*extension, "light", 0);
    lights_.push_back(without_scale(matrix_of(node)));
    light.group = group_of(node);
  }

  /// Light group: extras.light_group, else the node's name.
  std::string group_of(int node) const {
    const tinygltf::Node& n = node_at(node);
    if (n.extras.IsObject() && n.extras.Has("light_group") &&
        n.extras.Get("light_group").IsString()) {
      return n.extras.Get("light_group").Get<std::string>();
    }
    return n.name;
  }

  std::vector<float> weights_of(int node) const {
    const tinygltf::Node& n = node_at(node);
    const auto it = animated_.find(node);
    if (it != animated_.end() && !it->second.weights.empty()) {
      return it->second.weights;
    }
    const auto& own =
        n.weights.empty() ? model_.meshes[static_cast<std::size_t>(n.mesh)].weights : n.weights;
    return narrowed(own);
  }

  Status place_mesh(int node) {
    const tinygltf::Node& n = node_at(node);
    if (n.mesh < 0) {
      return ok_status();
    }
    MeshUse use;
    use.mesh = n.mesh;
    use.weights = weights_of(node);
    if (n.skin >= 0) {
      return place_skinned(node, use);
    }
    if (const auto* extension = find_extension(n.extensions, "EXT_mesh_gpu_instancing")) {
      return place_many(node, use, extension->Get("attributes"));
    }
    return place(node, use, matrix_of(node));
  }

  /// copy: as for add_instance().
  Status place(int node, MeshUse use, const Affine& matrix, std::uint32_t copy = 0) {
    Transform to_world = matrix.to_transform();
    if (!is_singular(to_world)) {
      return add_instance(use, matrix, node, copy);
    }
    const bool nothing_left = is_zero(cross(to_world.x, to_world.y)) &&
                              is_zero(cross(to_world.y, to_world.z)) &&
                              is_zero(cross(to_world.z, to_world.x));
    if (nothing_left) {
      return ok_status();  // scaled to a point or a line, as animations do to hide objects
    }
    use.node = node;
    use.copy = copy;
    Affine moved;
    moved.column[3] = matrix.column[3];
    to_world.t = {};
    use.baked = &to_world;
    return add_instance(use, moved, node, copy);
  }

  static bool is_zero(Vec3 v) { return !(length_squared(v) > 0); }

  /// copy: index among the node's instances.
  Status add_instance(const MeshUse& use, const Affine& to_world, int node,
                      std::uint32_t copy = 0) {
    auto mesh = meshes_.mesh_for(use);
    if (!mesh) {
      return mesh.error();
    }
    if (*mesh < 0) {
      return ok_status();
    }
    if (scene_.instances.size() >= options_.limits.instances_max) {
      return Error{
          ErrorCode::kTooLarge,
          "more than " + std::to_string(options_.limits.instances_max) + " instances in the scene",
          "/nodes/" + std::to_string(node)};
    }
    instances_.push_back(to_world);
    scene_.instances.push_back({*mesh,
                                {},
                                group_of(node),
                                static_cast<std::uint32_t>(node) + 1,
                                first_instance_[static_cast<std::size_t>(node)] + copy});
    return ok_status();
  }

  // The vertices follow the joints in world space; the node's own transform does not apply.
  Status place_skinned(int node, MeshUse& use) {
    const int skin_index = node_at(node).skin;
    const tinygltf::Skin& skin = model_.skins[static_cast<std::size_t>(skin_index)];
    const std::string where = "/skins/" + std::to_string(skin_index);
    std::vector<float> inverse_bind;
    if (skin.inverseBindMatrices >= 0) {
      const std::string place = where + "/inverseBindMatrices";
      if (auto status = check_shape(source_, skin.inverseBindMatrices, {4, 4}, place); !status) {
        return status;
      }
      auto read = read_floats(source_, skin.inverseBindMatrices, place);
      if (!read) {
        return read.error();
      }
      inverse_bind = *std::move(read);
      if (inverse_bind.size() < skin.joints.size() * 16) {
        return invalid(place, std::to_string(inverse_bind.size() / 16) + " matrices for " +
                                  std::to_string(skin.joints.size()) + " joints");
      }
    }
    // Near the joints, so that vertices far from the file's origin keep their detail.
    const Affine base = base_of(skin.joints);
    std::vector<Transform> joints;
    for (std::size_t j = 0; j < skin.joints.size(); ++j) {
      Affine matrix = world_[static_cast<std::size_t>(skin.joints[j])];
      if (!inverse_bind.empty()) {
        Affine inverse;
        for (std::size_t c = 0; c < 4; ++c) {
          const float* column = inverse_bind.data() + j * 16 + c * 4;
          inverse.column[c] = {static_cast<double>(column[0]), static_cast<double>(column[1]),
                               static_cast<double>(column[2])};
        }
        matrix = matrix * inverse;
      }
      if (!matrix.is_finite()) {
        return invalid(where + "/joints/" + std::to_string(j),
                       "the joint's matrix is too large for a 32-bit float");
      }
      joints.push_back(
          matrix.from({base.column[3][0], base.column[3][1], base.column[3][2]}).to_transform());
    }
    use.node = node;
    use.joint_matrices = joints;
    return add_instance(use, base, node);
  }

  /// A translation to the joints of a skin if they are far away, else none.
  Affine base_of(const std::vector<int>& joints) const {
    PlaceBox box;
    for (const int joint : joints) {
      const auto& t = matrix_of(joint).column[3];
      box.add({t[0], t[1], t[2]});
    }
    const Place near = far_origin(box);
    Affine out;
    out.column[3] = {near.x, near.y, near.z};
    return out;
  }

  Status place_many(int node, MeshUse& use, const tinygltf::Value& attributes) {
    const std::string where =
        "/nodes/" + std::to_string(node) + "/extensions/EXT_mesh_gpu_instancing/attributes";
    std::vector<Vec3> translations;
    std::vector<Vec4> rotations;
    std::vector<Vec3> scales;
    std::optional<std::size_t> count;
    Status status = read_instances(translations, attributes, "TRANSLATION", where, count);
    status = status ? read_instances(rotations, attributes, "ROTATION", where, count) : status;
    status = status ? read_instances(scales, attributes, "SCALE", where, count) : status;
    if (!status) {
      return status;
    }
    // The list grows by doubling.
    status = source_.budget().take(2 * sizeof(InstanceDescription) * count.value_or(0), where);
    if (!status) {
      return status;
    }
    for (std::size_t i = 0; i < count.value_or(0); ++i) {
      const Affine local = affine_from_parts(translations.empty() ? Vec3{} : translations[i],
                                             rotations.empty() ? Vec4{0, 0, 0, 1} : rotations[i],
                                             scales.empty() ? Vec3{1, 1, 1} : scales[i]);
      const Affine to_world = world_[static_cast<std::size_t>(node)] * local;
      if (!to_world.is_finite()) {
        return invalid(where, "instance " + std::to_string(i) + " is too large for a 32-bit float");
      }
      if (status = place(node, use, to_world, static_cast<std::uint32_t>(i)); !status) {
        return status;
      }
    }
    return ok_status();
  }

  template <typename V>
  Status read_instances(std::vector<V>& to, const tinygltf::Value& attributes, const char* name,
                        const std::string& attributes_where, std::optional<std::size_t>& count) {
    if (!attributes.Has(name)) {
      return ok_status();
    }
    const std::string where = attributes_where + "/" + name;
    const int accessor = attributes.Get(name).GetNumberAsInt();
    if (auto status =
            check_shape(source_, accessor, {static_cast<int>(sizeof(V) / sizeof(float)), 1}, where);
        !status) {
      return status;
    }
    auto floats = read_floats(source_, accessor, where);
    if (!floats) {
      return floats.error();
    }
    to = to_vectors<V>(*floats);
    count = count.value_or(to.size());
    if (to.size() != *count) {
      return invalid(where, std::to_string(to.size()) + " elements, but there are " +
                                std::to_string(*count) + " instances");
    }
    return ok_status();
  }

  const tinygltf::Model& model_;
  GltfSource& source_;
  GltfMeshes& meshes_;
  const GltfOptions& options_;
  const AnimatedNodes& animated_;
  SceneDescription& scene_;
  std::vector<Affine> world_;
  std::vector<Affine> instances_, lights_, cameras_;  ///< of those in scene_
  std::vector<std::uint32_t> first_instance_;         ///< of each node
};

}  // namespace

Status place_nodes(const tinygltf::Model& model, GltfSource& source, GltfMeshes& meshes,
                   const GltfOptions& options, const AnimatedNodes& animated,
                   SceneDescription& scene) {
  return NodePlacer(model, source, meshes, options, animated, scene).run();
}

}  // namespace core
