#include "core/scene/scene_builder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include "core/materials/material.h"
#include "core/materials/shade.h"
#include "core/math/numbers.h"
#include "core/scene/camera_planes.h"
#include "core/scene/check_geometry.h"
#include "core/scene/crowding.h"
#include "core/scene/divide_triangles.h"
#include "core/scene/drawn.h"
#include "core/scene/light_groups.h"
#include "core/scene/matte_names.h"
#include "core/scene/mean_emission.h"
#include "core/scene/placed_meshes.h"
#include "core/scene/round_facets.h"
#include "core/scene/set_apart.h"
#include "core/scene/single_faces.h"
#include "core/scene/solids.h"
#include "core/scene/turn_pieces.h"

namespace core {
namespace {

/// Adds the parts, one kind after another.
class Builder {
 public:
  Builder(SceneDescription& from, SceneData& to) : from_(from), to_(to) {}

  Status run(int threads, std::string_view isa, const std::stop_token& stop) {
    to_.origin = from_.origin;
    to_.light_groups = {kEnvironmentGroupName};
    if (Status s = add_materials(); !s) {
      return s;
    }
    if (Status s = check_geometry(from_); !s) {
      return s;
    }
    number_objects(from_, to_);
    extremes_ = extreme_points_of(from_);
    for (const Vec3& point : extremes_) {
      bounds_.add(point);
    }
    if (!from_.framed.empty()) {
      extremes_ = from_.framed;
    }
    place_meshes();
    PlacedFrom placed_from = {from_, instance_of_, top_level_};
    placed_from.pieces = turn_pieces(to_, placed_from);
    const std::size_t added = divide_triangles(to_);
    if (Status s = build_accel(threads, isa, stop); !s) {
      return s;
    }
    add_lights();
    placed_triangles_ -= added;
    find_solids(to_, placed_from);
    check_planes(from_, bounds());
    Bounds box = bounds_;
    box.add(ground_bounds_);
    box.add(moved_bounds_);
    to_.center = box.empty() ? Vec3{} : box.center();
    to_.radius_m = box.empty() ? 0.0F : 0.5F * length(box.diagonal());
    find_single_faces(to_, parallel_for(threads), stop);
    return ok_status();
  }

  /// Returns what automatic cameras frame: the model, and around it on a catcher, which is the only
  /// level ground, for a quarter of its height: the shadow of light that falls at 76 degrees or
  /// more, and most of longer ones, since the image is higher or wider than the model.
  Bounds bounds() const {
    Bounds out;
    for (const Vec3& point : extremes_) {
      out.add(point);
    }
    if (to_.ground && !out.empty() && !(ground_bounds_.diagonal().y > 0)) {
      const float reach = 0.25F * out.diagonal().y;
      out.min.x -= reach;
      out.min.z -= reach;
      out.max.x += reach;
      out.max.z += reach;
    }
    return out;
  }

  const std::vector<Vec3>& extremes() const { return extremes_; }
  std::size_t placed_triangles() const { return placed_triangles_; }

 private:
  /// The properties that determine which texels a slot reads: size, set, transform, wrap modes,
  /// nearest.
  using Places = std::tuple<int, int, int, std::array<float, 6>, TextureWrap, TextureWrap, bool>;

  TextureSlot slot(const TextureDescription& description, bool srgb) {
    TextureSlot out;
    out.description = description;
    if (description.image < 0) {
      return out;
    }
    const auto key = std::make_pair(description.image, srgb);
    auto it = textures_.find(key);
    if (it == textures_.end()) {
      to_.textures.push_back(
          Texture::create(*from_.images[static_cast<std::size_t>(description.image)], srgb));
      it = textures_.emplace(key, to_.textures.back().get()).first;
    }
    out.texture = it->second;
    const Places places = {out.texture->width(),     out.texture->height(), description.uv_set,
                           description.uv_transform, description.wrap_u,    description.wrap_v,
                           description.nearest};
    const auto next = static_cast<std::uint32_t>(places_.size()) + 1;
    out.places = places_.emplace(places, next).first->second;
    return out;
  }

  void add_maps(const MaterialDescription& d, Material& m) {
    m.has_layers = d.has_layers();
    for (const MaterialMap& map : kMaterialMaps) {
      if (map.slot != nullptr && (m.has_layers || !map.is_layer)) {
        m.*map.slot = slot(d.*map.description, map.is_color);
        (m.*map.slot).axes = map_axes(d.*map.description, d.tangent_map());
        m.has_texture = m.has_texture || (map.is_shaded && (m.*map.slot).texture != nullptr);
      }
    }
  }

  Status add_materials() {
    from_.materials.push_back(MaterialDescription{});  // glTF's default material
    from_.materials.back().name = "default";
    std::size_t number = 0;
    for (const MaterialDescription& d : from_.materials) {
      const std::string where = "/materials/" + std::to_string(number++);
      for (const MaterialMap& map : kMaterialMaps) {
        const int image = map.slot != nullptr ? (d.*map.description).image : -1;
        if (image >= static_cast<int>(from_.images.size()) ||
            (image >= 0 && from_.images[static_cast<std::size_t>(image)] == nullptr)) {
          return Error{ErrorCode::kInvalidArgument,
                       "the material refers to an image that does not exist", where};
        }
      }
      Material m;
      m.factors = d;
      add_maps(d, m);
      m.is_emissive = !is_black(d.unlit ? d.base_color : d.emissive);
      m.has_alpha = d.alpha_mode == AlphaMode::kMask || (d.alpha_mode == AlphaMode::kBlend);
      m.transmits = (d.transmission > 0 && d.ior != 0) || d.diffuse_transmission > 0;
      m.is_volume = d.bounds_solids();
      m.medium = m.is_volume ? medium_within(d) : Medium{};
      m.plain = plain_parameters(d, m.is_volume);
      to_.has_volumes = to_.has_volumes || m.is_volume;
      to_.has_scattering = to_.has_scattering || m.medium.scatters();
      to_.materials.push_back(std::move(m));
    }
    for (Material& m : to_.materials) {
      m.is_clear = may_be_clear(m);
      to_.has_clear = to_.has_clear || m.is_clear;
    }
    return ok_status();
  }

  /// Thin walls that are smooth somewhere, and solids whose index may equal that of their
  /// surroundings.
  bool may_be_clear(const Material& m) const {
    const MaterialDescription& d = m.factors;
    const bool textured = m.metallic_roughness.texture != nullptr;
    if (!(d.transmission > 0) || d.unlit || (d.metallic >= 1 && !textured)) {
      return false;
    }
    if (!m.is_volume) {
      constexpr float kSmooth = 0.028F;  // a quarter above the roughness limit of Bsdf's mirrors
      return d.roughness < kSmooth || textured;
    }
    return !(d.dispersion > 0) &&
           (d.ior == 1 ||
            std::any_of(to_.materials.begin(), to_.materials.end(), [&](const Material& other) {
              return &other != &m && other.is_volume && other.factors.ior == d.ior;
            }));
  }

  /// Returns its index; the last is glTF's default material.
  std::uint32_t material_of(const PrimitiveDescription& p) const {
    return p.material < 0 || p.material + 1 >= static_cast<int>(to_.materials.size())
               ? static_cast<std::uint32_t>(to_.materials.size() - 1)
               : static_cast<std::uint32_t>(p.material);
  }

  MeshData take(PrimitiveDescription&& p, const Transform* to_world) {
    MeshData mesh;
    mesh.material = material_of(p);
    mesh.primitive = p.id;
    mesh.positions = std::move(p.positions);
    mesh.indices = std::move(p.indices);
    mesh.normals = std::move(p.normals);
    mesh.tangents = std::move(p.tangents);
    mesh.tangent_uv_set = p.tangent_uv_set;
    mesh.uv = std::move(p.uv);
    mesh.colors = std::move(p.colors);
    mesh.file_vertices = std::move(p.file_vertices);
    mesh.in_world_space = to_world != nullptr;
    if (to_world != nullptr) {
      const bool mirrored = to_world->determinant() < 0;
      for (Vec3& v : mesh.positions) {
        v = exact_point(*to_world, v);
      }
      for (Vec3& n : mesh.normals) {
        n = normalize_or(to_world->normal(n), {0, 0, 1});
      }
      for (Vec4& t : mesh.tangents) {
        const Vec3 moved = normalize_or(to_world->vector({t.x, t.y, t.z}), {1, 0, 0});
        t = {moved.x, moved.y, moved.z, mirrored ? -t.w : t.w};
      }
      if (mirrored) {  // keep counter-clockwise triangles in front
        for (std::size_t i = 0; i + 2 < mesh.indices.size(); i += 3) {
          std::swap(mesh.indices[i + 1], mesh.indices[i + 2]);
        }
      }
    }
    mesh.positions.reserve(mesh.positions.size() + 1);
    mesh.positions.push_back(Vec3{});
    if (!mesh.normals.empty()) {
      mesh.normals.reserve(mesh.normals.size() + 1);
      mesh.normals.push_back(Vec3{});
    }
    mesh.later = std::move(p.later);
    for (MovedVertices& moved : mesh.later) {
      moved.positions.reserve(moved.positions.size() + 1);
      moved.positions.push_back(Vec3{});
    }
    return mesh;
  }

  /// Removes further instances of a mesh that emits in one place: each would be a light, and only
  /// one of them is seen.
  void drop_coincident_emitters() {
    std::set<std::pair<int, std::array<float, 12>>> places;
    std::erase_if(from_.instances, [&](const InstanceDescription& each) {
      const auto& primitives = from_.meshes[static_cast<std::size_t>(each.mesh)].primitives;
      const bool emits =
          std::any_of(primitives.begin(), primitives.end(), [this](const PrimitiveDescription& p) {
            return to_.materials[material_of(p)].is_emissive;
          });
      return emits &&
             !places.emplace(each.mesh, std::bit_cast<std::array<float, 12>>(each.to_world)).second;
    });
  }

  void place_meshes() {
    drop_coincident_emitters();
    std::vector<int> uses(from_.meshes.size(), 0);
    for (const InstanceDescription& instance : from_.instances) {
      ++uses[static_cast<std::size_t>(instance.mesh)];
    }
    // Meshes used once are transformed to world space, which saves a level of traversal.
    std::vector<std::uint32_t> tree_of(from_.meshes.size(), 0);
    for (const InstanceDescription& instance : from_.instances) {
      const auto id = static_cast<std::size_t>(instance.mesh);
      for (PrimitiveDescription& p : from_.meshes[id].primitives) {
        if (uses[id] != 1 || p.indices.empty()) {
          continue;
        }
        to_.meshes.push_back(take(std::move(p), &instance.to_world));
        if (instance.is_ground) {
          to_.ground = static_cast<std::uint32_t>(to_.placed.size());
        }
        to_.placed.push_back({static_cast<std::uint32_t>(to_.meshes.size() - 1), kNoLight,
                              group_of(instance, to_.meshes.back().material), instance.object,
                              instance.instance});
        instance_of_.push_back(&instance);
      }
    }
    top_level_ = to_.placed.size();
    for (std::size_t id = 0; id < from_.meshes.size(); ++id) {
      if (uses[id] < 2) {
        continue;
      }
      tree_of[id] = static_cast<std::uint32_t>(groups_.size());
      groups_.emplace_back();
      for (PrimitiveDescription& p : from_.meshes[id].primitives) {
        if (p.indices.empty()) {
          continue;
        }
        to_.meshes.push_back(take(std::move(p), nullptr));
        groups_.back().push_back(static_cast<std::uint32_t>(to_.meshes.size() - 1));
      }
    }
    for (const InstanceDescription& instance : from_.instances) {
      const auto id = static_cast<std::size_t>(instance.mesh);
      if (uses[id] < 2 || groups_[tree_of[id]].empty() ||
          !(std::fabs(instance.to_world.determinant()) >= std::numeric_limits<float>::min())) {
        continue;
      }
      to_.instances.push_back({instance.to_world, static_cast<std::uint32_t>(to_.placed.size()),
                               instance_error(instance.to_world)});
      instance_groups_.push_back(tree_of[id]);
      for (const std::uint32_t mesh : groups_[tree_of[id]]) {
        to_.placed.push_back({mesh, kNoLight, group_of(instance, to_.meshes[mesh].material),
                              instance.object, instance.instance});
        instance_of_.push_back(&instance);
      }
    }
  }

  /// Returns whether the emission, or the coverage of what emits, differs from place to place.
  static bool varies_over_surface(const MeshData& mesh, const Material& material) {
    const bool by_base = material.base_color.texture != nullptr || !mesh.colors.empty();
    return (material.factors.unlit ? by_base : material.emissive.texture != nullptr) ||
           (material.has_alpha && by_base);
  }

  /// Returns the light group; meshes without emission get the first.
  std::uint32_t group_of(const InstanceDescription& instance, std::uint32_t material) {
    const Material& m = to_.materials[material];
    if (!m.is_emissive && !m.factors.unlit) {
      return kEnvironmentGroup;
    }
    const std::string& mesh = from_.meshes[static_cast<std::size_t>(instance.mesh)].name;
    return light_group(to_.light_groups, instance.group.empty() ? mesh : instance.group);
  }

  AccelGeometry geometry(const MeshData& mesh) const {
    const std::size_t count = mesh.positions.size() - 1;
    AccelGeometry out = {std::span(mesh.positions).first(count), mesh.indices};
    out.has_holes = to_.materials[mesh.material].has_alpha;
    for (const MovedVertices& moved : mesh.later) {
      out.later.push_back(std::span(moved.positions).first(count));
    }
    return out;
  }

  Status build_accel(int threads, std::string_view isa, const std::stop_token& stop) {
    std::vector<AccelGeometry> top;
    for (std::size_t i = 0; i < top_level_; ++i) {
      top.push_back(geometry(to_.meshes[to_.placed[i].mesh]));
    }
    std::vector<std::vector<AccelGeometry>> groups;
    for (const auto& group : groups_) {
      groups.emplace_back();
      for (const std::uint32_t mesh : group) {
        groups.back().push_back(geometry(to_.meshes[mesh]));
      }
    }
    std::vector<AccelInstance> instances;
    for (std::size_t i = 0; i < to_.instances.size(); ++i) {
      instances.push_back({instance_groups_[i], to_.instances[i].to_world});
    }
    const auto build = [&]() -> Status {
      auto accel = Accel::build(top, groups, instances, threads, isa, stop, to_.has_volumes);
      if (!accel) {
        return accel.error();
      }
      to_.accel = std::move(accel).value();
      return ok_status();
    };
    Status status = build();
    if (status && set_apart(to_, bounds_.empty() ? 0 : 0.5F * length(bounds_.diagonal()))) {
      status = build();
    }
    return status ? find_round_facets(to_, stop) : status;
  }

  void add_lights() {
    std::vector<LightBounds> bounds;
    for_each_placed(to_, [&](std::uint32_t placed, std::uint32_t instance, std::uint32_t) {
      visit_placed(placed, instance, bounds);
    });
    for (const PunctualLightDescription& d : from_.lights) {
      if (is_black(d.intensity)) {
        continue;
      }
      const IesProfile* const profile =
          d.type == PunctualType::kProfile
              ? from_.profiles[static_cast<std::size_t>(d.profile)].get()
              : nullptr;
      if (profile != nullptr && !(profile->lumens() > 0)) {
        continue;
      }
      PunctualLight light = punctual_light(d, profile);
      light.group = light_group(to_.light_groups, d.group.empty() ? d.name : d.group);
      to_.punctual_lights.push_back(light);
    }
    // Directional lights are not in the tree: they come last.
    std::stable_partition(
        to_.punctual_lights.begin(), to_.punctual_lights.end(),
        [](const PunctualLight& l) { return l.type != PunctualType::kDirectional; });
    for (const PunctualLight& light : to_.punctual_lights) {
      if (light.type == PunctualType::kDirectional) {
        break;
      }
      bounds.push_back(light_bounds(light));
    }
    to_.profiles = from_.profiles;
    to_.light_tree = LightTree(bounds);
  }

  void visit_placed(std::uint32_t placed, std::uint32_t number, std::vector<LightBounds>& bounds) {
    const PlacedInstance* instance = number == kNoInstance ? nullptr : &to_.instances[number];
    const Transform* to_world = instance == nullptr ? nullptr : &instance->to_world;
    const MeshData& mesh = to_.meshes[to_.placed[placed].mesh];
    const Material& material = to_.materials[mesh.material];
    placed_triangles_ += mesh.triangle_count();
    for (std::size_t i = 0; placed == to_.ground && i + 1 < mesh.positions.size(); ++i) {
      ground_bounds_.add(mesh.positions[i]);
    }
    for (const MovedVertices& moved : mesh.later) {
      for (std::size_t i = 0; i + 1 < moved.positions.size(); ++i) {
        moved_bounds_.add(moved.positions[i]);
      }
    }
    if (!material.is_emissive || !mesh.later.empty()) {
      return;  // light samples have no time: only paths find the light of moving emitters
    }
    to_.placed[placed].first_light = static_cast<std::uint32_t>(to_.triangle_lights.size());
    const bool mirrored = to_world != nullptr && to_world->determinant() < 0;
    for (std::uint32_t t = 0; t < mesh.triangle_count(); ++t) {
      const auto vertex = [&](std::size_t k) {
        const Vec3 v = mesh.positions[mesh.indices[3 * std::size_t{t} + k]];
        return to_world == nullptr ? v : to_world->point(v);
      };
      TriangleLight light;
      light.p0 = vertex(0);
      light.edge1 = vertex(1) - light.p0;
      light.edge2 = vertex(2) - light.p0;
      const Vec3 n = cross(light.edge1, light.edge2);
      const float twice_area = length(n);
      light.area_m2 = 0.5F * twice_area;
      light.normal = normalize_or(mirrored ? -n : n, {0, 0, 1});
      light.error_m = face_error_m({vertex(0), vertex(1), vertex(2)}, twice_area,
                                   instance == nullptr ? InstanceError{} : instance->error);
      light.placed = placed;
      light.triangle = t;
      light.instance = number;
      light.two_sided = material.factors.emits_from_both_sides();
      light.is_coated = material.factors.clearcoat > 0 && !material.factors.unlit;
      light.varies = light.is_coated || varies_over_surface(mesh, material);
      light.radiance = mean_emission_.of(light);
      LightBounds b;
      b.box.add(light.p0);
      b.box.add(light.p0 + light.edge1);
      b.box.add(light.p0 + light.edge2);
      b.axis = light.normal;
      b.cos_theta_o = 1;
      b.cos_theta_e = 0;
      b.two_sided = light.two_sided;
      // Zero only for a triangle that emits nowhere: the tree leaves it out.
      if (!is_black(light.radiance)) {
        b.power = std::max(luminance(light.radiance) * light.area_m2, 1e-30F);
      }
      bounds.push_back(b);
      to_.triangle_lights.push_back(light);
    }
  }

  SceneDescription& from_;
  SceneData& to_;
  std::map<std::pair<int, bool>, const Texture*> textures_;
  std::map<Places, std::uint32_t> places_;
  MeanEmission mean_emission_{to_};
  std::vector<std::vector<std::uint32_t>> groups_;
  std::vector<std::uint32_t> instance_groups_;
  std::size_t top_level_ = 0;
  std::vector<const InstanceDescription*> instance_of_;  ///< of each placed mesh
  std::size_t placed_triangles_ = 0;
  std::vector<Vec3> extremes_;  ///< SceneSummary::extremes
  Bounds bounds_;               ///< of the model
  Bounds ground_bounds_;        ///< of the ground
  Bounds moved_bounds_;         ///< at later times of an open shutter
};

}  // namespace

Result<PlacedGeometry> build_scene_data(SceneDescription& from, SceneData& to, int threads,
                                        std::string_view isa, const std::stop_token& stop) {
  Builder builder(from, to);
  if (Status status = builder.run(threads, isa, stop); !status) {
    return status.error();
  }
  return PlacedGeometry{builder.bounds(), builder.extremes(), builder.placed_triangles()};
}

}  // namespace core
