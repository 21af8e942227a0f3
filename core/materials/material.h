/// Material: a glTF material with resolved textures, as used for shading.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "core/bsdf/bsdf_types.h"
#include "core/color/rgb.h"
#include "core/description/scene_description.h"
#include "core/media/medium.h"
#include "core/textures/texture.h"

namespace core {

/// The axes of a map whose coordinates are transformed by KHR_texture_transform, relative to the
/// tangents that were made for meshes of the material.
struct MapAxes {
  float along_tangent = 1;  ///< of +u of the map: 1 or -1; 0: neither, which the triangle gives
  float sign = 1;           ///< of its bitangent; -1: the transform mirrors
};
/// tangents: MaterialDescription::tangent_map(), if any. Returns {} for a singular transform.
MapAxes map_axes(const TextureDescription& map,
                 const std::optional<TextureDescription>& tangents) noexcept;

/// A texture used by a material; if the texture is null, the factor applies alone.
struct TextureSlot {
  const Texture* texture = nullptr;
  TextureDescription description;
  MapAxes axes;
  /// Equal for slots that read textures of the same size at the same positions. Not 0.
  std::uint32_t places = 0;
};

/// A material with resolved textures.
struct Material {
  MaterialDescription factors;
  BsdfParameters plain;  ///< from the factors alone
  TextureSlot base_color;
  TextureSlot metallic_roughness;
  TextureSlot normal;
  TextureSlot emissive;
  TextureSlot specular;
  TextureSlot specular_color;
  TextureSlot transmission;
  TextureSlot anisotropy;
  TextureSlot clearcoat;
  TextureSlot clearcoat_roughness;
  TextureSlot clearcoat_normal;
  TextureSlot sheen_color;
  TextureSlot sheen_roughness;
  TextureSlot iridescence;
  TextureSlot iridescence_thickness;
  TextureSlot diffuse_transmission;
  TextureSlot diffuse_transmission_color;
  bool has_texture = false;  ///< some slot has a texture
  bool has_layers = false;   ///< clearcoat, sheen, iridescence or diffuse transmission
  bool is_emissive = false;
  bool has_alpha = false;  ///< MASK or BLEND: hits may fall on holes
  bool is_volume = false;  ///< bounds a solid (thickness > 0)
  bool transmits = false;  ///< thin or solid, specular or diffuse
  bool is_clear =
      false;  ///< may scatter without deflection; Bsdf::null_transmittance() returns the fraction
  Medium medium;  ///< interior medium
};

/// What the lanes of core/wave do with a texture. kByFactor: refuse it if its factor is not 0.
enum class MapInLanes { kRefused, kRead, kByFactor };

/// The textures of a material, one row each. Whatever checks, numbers or resolves them walks the
/// rows.
struct MaterialMap {
  TextureDescription MaterialDescription::*description;
  TextureSlot Material::*slot;  ///< null: it is read by nothing
  bool is_color = false;        ///< stored as sRGB
  bool is_layer = false;        ///< of BsdfLayers: only if the material has any of them
  bool is_shaded = true;        ///< read by shade()
  MapInLanes in_lanes = MapInLanes::kRefused;  ///< if is_shaded
};

inline constexpr std::array kMaterialMaps = {
    MaterialMap{&MaterialDescription::base_color_texture, &Material::base_color, true, false, true,
                MapInLanes::kRead},
    MaterialMap{&MaterialDescription::metallic_roughness_texture, &Material::metallic_roughness,
                false, false, true, MapInLanes::kRead},
    MaterialMap{&MaterialDescription::normal_texture, &Material::normal, false, false, true,
                MapInLanes::kRead},
    MaterialMap{&MaterialDescription::emissive_texture, &Material::emissive, true, false, false},
    MaterialMap{&MaterialDescription::specular_texture, &Material::specular},
    MaterialMap{&MaterialDescription::specular_color_texture, &Material::specular_color, true},
    MaterialMap{&MaterialDescription::transmission_texture, &Material::transmission},
    MaterialMap{&MaterialDescription::thickness_texture, nullptr},
    MaterialMap{&MaterialDescription::anisotropy_texture, &Material::anisotropy, false, false, true,
                MapInLanes::kByFactor},
    MaterialMap{&MaterialDescription::clearcoat_texture, &Material::clearcoat, false, true, true,
                MapInLanes::kRead},
    MaterialMap{&MaterialDescription::clearcoat_roughness_texture, &Material::clearcoat_roughness,
                false, true, true, MapInLanes::kRead},
    MaterialMap{&MaterialDescription::clearcoat_normal_texture, &Material::clearcoat_normal, false,
                true, true, MapInLanes::kRead},
    MaterialMap{&MaterialDescription::sheen_color_texture, &Material::sheen_color, true, true, true,
                MapInLanes::kRead},
    MaterialMap{&MaterialDescription::sheen_roughness_texture, &Material::sheen_roughness, false,
                true, true, MapInLanes::kRead},
    MaterialMap{&MaterialDescription::iridescence_texture, &Material::iridescence, false, true},
    MaterialMap{&MaterialDescription::iridescence_thickness_texture,
                &Material::iridescence_thickness, false, true},
    MaterialMap{&MaterialDescription::diffuse_transmission_texture, &Material::diffuse_transmission,
                false, true},
    MaterialMap{&MaterialDescription::diffuse_transmission_color_texture,
                &Material::diffuse_transmission_color, true, true},
};

}  // namespace core
