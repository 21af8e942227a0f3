/// SceneDescription: plain data that a loader fills and from which core::Scene is built.
///
/// Metres, y up, right-handed. Indices refer to other parts; -1 means none. Nothing is checked
/// here: Scene::build() refuses invalid data. Formulas: glTF 2.0 and its KHR extensions.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/warning.h"
#include "core/color/ior_curve.h"
#include "core/color/rgb.h"
#include "core/description/moved_vertices.h"
#include "core/description/surface_layers.h"
#include "core/image_io/image.h"
#include "core/math/bounds.h"
#include "core/math/place.h"
#include "core/math/transform.h"
#include "core/math/vec.h"

namespace core {

class IesProfile;

enum class TextureWrap : std::uint8_t { kRepeat, kMirroredRepeat, kClampToEdge };

/// A texture reference of a material.
struct TextureDescription {
  int image = -1;  ///< into SceneDescription::images; -1: no texture, only the factor
  int uv_set = 0;  ///< 0 or 1: into PrimitiveDescription::uv
  TextureWrap wrap_u = TextureWrap::kRepeat;
  TextureWrap wrap_v = TextureWrap::kRepeat;
  bool nearest = false;  ///< magnification filter NEAREST
  /// KHR_texture_transform as rows of a 2x3 matrix: u' = m[0] u + m[1] v + m[2], v' = m[3] ...
  std::array<float, 6> uv_transform = {1, 0, 0, 0, 1, 0};

  /// Returns whether +u of the transformed coordinates is neither along nor against +u of those of
  /// the mesh: it is along d dP/du - c dP/dv, the first column of the inverse of (a b; c d).
  bool turns_u() const noexcept {
    const auto& m = uv_transform;
    const float determinant = m[0] * m[4] - m[1] * m[3];
    return m[3] != 0 && determinant != 0 && std::isfinite(determinant);
  }
};

enum class AlphaMode : std::uint8_t { kOpaque, kMask, kBlend };

/// Factors multiply their textures. Defaults are glTF's.
struct MaterialDescription : SurfaceLayers {
  std::string name;
  std::array<int, 2> uv_sets = {0, 1};  ///< TEXCOORD_n of the file for uv_set 0 and 1
  Rgb base_color = {1, 1, 1};
  float base_alpha = 1;
  TextureDescription base_color_texture;  ///< sRGB, RGBA
  float metallic = 1;
  float roughness = 1;                            ///< perceptual: alpha = roughness^2
  TextureDescription metallic_roughness_texture;  ///< linear; G roughness, B metallic
  TextureDescription normal_texture;              ///< linear, tangent space
  float normal_scale = 1;
  TextureDescription
      occlusion_texture;  ///< linear R; unused, since a path tracer computes occlusion
  float occlusion_strength = 1;
  Rgb emissive = {0, 0, 0};  ///< factor times KHR_materials_emissive_strength; W/(m^2 sr)
  TextureDescription emissive_texture;  ///< sRGB
  AlphaMode alpha_mode = AlphaMode::kOpaque;
  float alpha_cutoff = 0.5F;
  bool double_sided = false;
  bool unlit = false;
  float ior = 1.5F;  ///< 0: infinitely reflective (KHR_materials_ior)
  float specular = 1;
  TextureDescription specular_texture;  ///< A
  Rgb specular_color = {1, 1, 1};
  TextureDescription specular_color_texture;  ///< sRGB
  float transmission = 0;
  TextureDescription transmission_texture;  ///< R
  float thickness = 0;                      ///< 0: thin-walled; positive: the mesh bounds a volume
  TextureDescription thickness_texture;
  int priority = 0;  ///< where solids overlap, space belongs to the highest (extras.priority)
  float attenuation_distance = 0;  ///< metres; 0 or less: infinite
  Rgb attenuation_color = {1, 1, 1};
  Rgb multiscatter_color = {0, 0, 0};    ///< of an infinitely deep medium under diffuse light; 0:
                                         ///< absorbs only
  float scatter_anisotropy = 0;          ///< mean cosine of the scattering angle
  TextureDescription clearcoat_texture;  ///< R
  TextureDescription clearcoat_roughness_texture;  ///< G
  TextureDescription clearcoat_normal_texture;
  float clearcoat_normal_scale = 1;
  TextureDescription sheen_color_texture;      ///< sRGB
  TextureDescription sheen_roughness_texture;  ///< A
  TextureDescription iridescence_texture;      ///< R
  float iridescence_thickness_min_nm = 100;
  float iridescence_thickness_max_nm = 400;
  TextureDescription iridescence_thickness_texture;  ///< G
  float anisotropy = 0;
  float anisotropy_rotation_rad = 0;
  TextureDescription anisotropy_texture;  ///< RG direction, B strength
  float dispersion = 0;                   ///< 20 / Abbe number; 0: none
  IorCurve ior_curve;  ///< for paths of wavelengths, instead of `dispersion`; `ior` is its n_d
  TextureDescription diffuse_transmission_texture;        ///< A
  TextureDescription diffuse_transmission_color_texture;  ///< sRGB

  /// Returns whether meshes of this material bound solids; other walls that transmit are thin.
  bool bounds_solids() const noexcept {
    return (transmission > 0 || diffuse_transmission > 0) && thickness > 0;
  }
  /// Returns the texture along whose coordinates missing tangents are made; empty: the material
  /// needs none. Its transform is not the identity only if it turns.
  std::optional<TextureDescription> tangent_map() const {
    std::optional<TextureDescription> map;
    if (anisotropy != 0) {
      map = anisotropy_texture;
    }
    for (const TextureDescription* normals : {&clearcoat_normal_texture, &normal_texture}) {
      if (normals->image >= 0) {
        map = *normals;
      }
    }
    // Anisotropy without a texture follows the coordinates of the mesh.
    const bool is_plain = anisotropy != 0 && anisotropy_texture.image < 0;
    if (map && (is_plain || !map->turns_u())) {
      map->uv_transform = TextureDescription().uv_transform;
    }
    return map;
  }
  /// Returns whether the back emits as the front does, if the material emits.
  bool emits_from_both_sides() const noexcept { return double_sided || unlit; }
};

/// Triangles of one material. All attribute arrays are empty or as long as positions.
struct PrimitiveDescription {
  std::vector<Vec3> positions;          ///< object space
  std::vector<Vec3> normals;            ///< empty: flat normals are computed from the triangles
  std::vector<Vec4> tangents;           ///< w: handedness of the bitangent, cross(n, t) * w
  int tangent_uv_set = -1;              ///< from which tangents were computed; -1: from the file
  std::array<std::vector<Vec2>, 2> uv;  ///< v = 0 at the top row
  std::vector<Vec4> colors;             ///< linear RGBA
  std::vector<std::uint32_t> indices;  ///< three per triangle; never empty, each < positions.size()
  /// Index of each vertex in the file, where tangents split vertices; empty: the same.
  std::vector<std::uint32_t> file_vertices;
  int material = -1;     ///< -1: glTF's default material
  std::uint32_t id = 0;  ///< 1 + index among the primitives of all meshes of the file; 0: among
                         ///< those here
  /// World-space vertices at further, evenly spaced times of an open shutter, the last at its end.
  /// Pre: only one instance uses the mesh. Empty: no motion.
  std::vector<MovedVertices> later = {};
};

struct MeshDescription {
  std::string name;
  std::vector<PrimitiveDescription> primitives;
};

/// A mesh placed in the world. Meshes used by several instances are stored once.
struct InstanceDescription {
  int mesh = -1;
  Transform to_world;
  std::string group = {};      ///< light group, if it emits; empty: the mesh's name
  std::uint32_t object = 0;    ///< ObjectDescription::id; 0: an object of its own
  std::uint32_t instance = 0;  ///< in the object's range; 0: the object itself
  bool is_ground = false;  ///< added below the model (core/scene/ground.h), outside of its bounds
};

/// A node of the file with a mesh. Ids depend only on the file, so all views, variants and times of
/// a scene have the same ones.
struct ObjectDescription {
  std::uint32_t id = 0;              ///< 1 + index of the node
  std::string name;                  ///< of the node, or else of its mesh; may be empty
  std::uint32_t first_instance = 0;  ///< first id of its instances; 1 for the first node
  std::uint32_t instances = 1;       ///< more than one with EXT_mesh_gpu_instancing
};

enum class PunctualType : std::uint8_t { kDirectional, kPoint, kSpot, kProfile };

/// KHR_lights_punctual, or EXT_lights_ies (kProfile). Emits along -z of to_world. Units:
/// candela and lux.
struct PunctualLightDescription {
  std::string name;
  std::string group;  ///< light group; empty: its name
  PunctualType type = PunctualType::kPoint;
  Rgb intensity = {1, 1, 1};  ///< color * intensity: candela (point, spot), lux (directional);
                              ///< color * multiplier for profiles
  float range_m = 0;          ///< 0: infinite
  float inner_cone_rad = 0;
  float outer_cone_rad = 0.7853982F;
  int profile = -1;  ///< into SceneDescription::profiles
  Transform to_world;
};

struct CameraDescription {
  std::string name;
  bool orthographic = false;
  float vertical_fov_rad = 0.7853982F;  ///< perspective
  float aspect_ratio = 0;               ///< 0: that of the film
  float x_magnification = 1;            ///< orthographic: half the width in metres
  float y_magnification = 1;            ///< orthographic: half the height in metres
  float near_m = 0;  ///< camera rays see nothing nearer than this, along the direction of view
  float far_m = std::numeric_limits<float>::infinity();  ///< nor anything farther
  Transform to_world;                                    ///< looks along -z, y up
  std::vector<Transform> later = {};  ///< as in PrimitiveDescription; empty: no motion
};

struct SceneDescription {
  std::string name;
  /// Point of the file's world from which all positions here count.
  Place origin;
  std::vector<std::shared_ptr<const Image>> images;
  std::vector<MaterialDescription> materials;
  std::vector<MeshDescription> meshes;
  std::vector<InstanceDescription> instances;
  std::vector<ObjectDescription> objects;      ///< by id; empty: one per instance
  std::vector<std::uint32_t> mesh_primitives;  ///< of each mesh of the file; empty: those of
                                               ///< `meshes`
  std::vector<PunctualLightDescription> lights;
  std::vector<std::shared_ptr<const IesProfile>> profiles;  ///< null: no light uses it
  /// The scene's own environment, as Environment::create() takes it: RGB floats; or null.
  std::shared_ptr<const Image> environment;
  std::vector<CameraDescription> cameras;
  std::vector<std::string> variants;
  std::vector<std::string> animations;
  /// Extreme points [m] of the model over its whole animation, the same at all its times; automatic
  /// cameras and grounds follow them. Empty: those of the model here.
  std::vector<Vec3> framed;
  std::vector<std::string> extensions;  ///< extensionsUsed
  std::vector<Warning> warnings;
  bool has_emissive_strength =
      false;  ///< some material's KHR_materials_emissive_strength is above 1
};

}  // namespace core
