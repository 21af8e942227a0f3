/// Material: a glTF material with its textures resolved, as shading reads it.
#pragma once

#include <cstdint>

#include "core/bsdf/bsdf.h"
#include "core/color/rgb.h"
#include "core/description/scene_description.h"
#include "core/media/medium.h"
#include "core/textures/texture.h"

namespace core {

/// A texture as a material uses it; texture null: the factor alone.
struct TextureSlot {
  const Texture* texture = nullptr;
  TextureDescription description;
  /// The same for slots that read the same places of textures of the same size. Not 0.
  std::uint32_t places = 0;
};

/// A material as shading uses it, with its textures resolved.
struct Material {
  MaterialDescription factors;
  BsdfParameters plain;  ///< as the factors alone give them
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
  bool has_texture = false;  ///< any of the above
  bool has_layers = false;   ///< clearcoat, sheen, iridescence or diffuse transmission
  bool is_emissive = false;
  bool has_alpha = false;  ///< MASK or BLEND: hits may be holes
  bool is_volume = false;  ///< bounds a solid (thickness > 0)
  bool transmits = false;  ///< thin or solid, clear or diffuse
  bool is_clear = false;   ///< may have null scattering; Bsdf::straight() returns how much
  Medium medium;           ///< inside
};

}  // namespace core
