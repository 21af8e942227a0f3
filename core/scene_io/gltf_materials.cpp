#include "core/scene_io/gltf_materials.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <set>
#include <span>
#include <string>

#include "core/materials/material.h"
#include "core/scene_io/gltf_ior.h"
#include "core/scene_io/gltf_model.h"
#include "core/scene_io/gltf_schema.h"

namespace core {
namespace {

Rgb rgb_of(const std::vector<double>& v, Rgb otherwise) {
  return v.size() < 3
             ? otherwise
             : Rgb{static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

template <typename Info>
TextureReference reference_of(const Info& info) {
  return {info.index, info.texCoord, find_extension(info.extensions, "KHR_texture_transform")};
}

TextureReference reference_of(const tinygltf::Value& extension, const char* name) {
  if (!extension.Has(name)) {
    return {};
  }
  const tinygltf::Value& info = extension.Get(name);
  TextureReference reference = {value_integer(info, "index", -1),
                                value_integer(info, "texCoord", 0), nullptr};
  if (info.Has("extensions") && info.Get("extensions").Has("KHR_texture_transform")) {
    reference.transform = &info.Get("extensions").Get("KHR_texture_transform");
  }
  return reference;
}

float component(const Image& image, std::size_t pixel, int channel) {
  const std::size_t i =
      pixel * static_cast<std::size_t>(image.channels) + static_cast<std::size_t>(channel);
  switch (image.type) {
    case PixelType::kU8:
      return static_cast<float>(std::to_integer<int>(image.bytes[i])) / 255.0F;
    case PixelType::kU16: {
      std::uint16_t value = 0;
      std::memcpy(&value, image.bytes.data() + i * sizeof(value), sizeof(value));
      return static_cast<float>(value) / 65535.0F;
    }
    case PixelType::kF32:
      break;
  }
  float value = 0;
  std::memcpy(&value, image.bytes.data() + i * sizeof(value), sizeof(value));
  return value;
}

// Green holds 1 - glossiness, blue 0 (no metal).
Image roughness_from_glossiness(const Image& source, float glossiness) {
  Image image{source.width, source.height, 3, PixelType::kU8, {}};
  image.bytes.resize(image.value_count());
  const std::size_t pixels = image.value_count() / 3;
  const bool has_alpha = source.channels == 4 || source.channels == 2;
  for (std::size_t p = 0; p < pixels; ++p) {
    const float gloss = glossiness * (has_alpha ? component(source, p, source.channels - 1) : 1.0F);
    image.bytes[p * 3 + 1] =
        static_cast<std::byte>(std::lround(std::clamp(1 - gloss, 0.0F, 1.0F) * 255.0F));
  }
  return image;
}

/// Reads one material; the first error of a texture is kept and ends the work at the next step.
class MaterialReader {
 public:
  MaterialReader(const tinygltf::Material& in, GltfImages& images, SceneDescription& scene)
      : in_(in), images_(images), scene_(scene) {}

  Result<MaterialDescription> read() {
    read_core();
    read_extensions();
    read_ior_curve();
    read_priority();
    if (const auto* e = extension("KHR_materials_pbrSpecularGlossiness")) {
      read_specular_glossiness(*e);
    }
    if (status_) {
      status_ = number_uv_sets();
    }
    if (!status_) {
      return status_.error();
    }
    return m_;
  }

 private:
  const tinygltf::Value* extension(const char* name) const {
    return find_extension(in_.extensions, name);
  }

  void texture(TextureDescription& to, const TextureReference& reference) {
    if (!status_) {
      return;
    }
    auto description = images_.texture(reference);
    if (description) {
      to = *description;
    } else {
      status_ = description.error();
    }
  }

  /// Any two sets of coordinates can be used by one material; their numbers become 0 and 1.
  Status number_uv_sets() {
    std::set<int> sets;
    for (const MaterialMap& map : kMaterialMaps) {
      if (const TextureDescription& t = m_.*map.description; t.image >= 0) {
        sets.insert(t.uv_set);
      }
    }
    if (sets.empty() || *sets.rbegin() <= 1) {
      return ok_status();
    }
    if (sets.size() > m_.uv_sets.size()) {
      return Error{ErrorCode::kInvalidArgument,
                   "a material can use two sets of texture coordinates; this one uses " +
                       std::to_string(sets.size()),
                   "/materials/" + std::to_string(scene_.materials.size())};
    }
    m_.occlusion_texture = {};  // a path tracer has no use for it
    m_.uv_sets = {*sets.begin(), sets.size() > 1 ? *sets.rbegin() : 0};
    for (const MaterialMap& map : kMaterialMaps) {
      int& set = (m_.*map.description).uv_set;
      set = set == m_.uv_sets[0] ? 0 : 1;
    }
    return ok_status();
  }

  void read_core() {
    const tinygltf::PbrMetallicRoughness& pbr = in_.pbrMetallicRoughness;
    m_.name = in_.name;
    m_.base_color = rgb_of(pbr.baseColorFactor, {1, 1, 1});
    m_.base_alpha =
        pbr.baseColorFactor.size() == 4 ? static_cast<float>(pbr.baseColorFactor[3]) : 1.0F;
    texture(m_.base_color_texture, reference_of(pbr.baseColorTexture));
    m_.metallic = static_cast<float>(pbr.metallicFactor);
    m_.roughness = static_cast<float>(pbr.roughnessFactor);
    texture(m_.metallic_roughness_texture, reference_of(pbr.metallicRoughnessTexture));
    texture(m_.normal_texture, reference_of(in_.normalTexture));
    m_.normal_scale = static_cast<float>(in_.normalTexture.scale);
    m_.occlusion_strength = static_cast<float>(in_.occlusionTexture.strength);
    m_.emissive = rgb_of(in_.emissiveFactor, {0, 0, 0});
    texture(m_.emissive_texture, reference_of(in_.emissiveTexture));
    m_.alpha_mode = in_.alphaMode == "MASK"    ? AlphaMode::kMask
                    : in_.alphaMode == "BLEND" ? AlphaMode::kBlend
                                               : AlphaMode::kOpaque;
    m_.alpha_cutoff = static_cast<float>(in_.alphaCutoff);
    m_.double_sided = in_.doubleSided;
  }

  void read_extensions() {
    m_.unlit = extension("KHR_materials_unlit") != nullptr;
    if (const auto* e = extension("KHR_materials_emissive_strength")) {
      const float strength = value_number(*e, "emissiveStrength", 1);
      m_.emissive = m_.emissive * strength;
      scene_.has_emissive_strength = scene_.has_emissive_strength || strength > 1;
    }
    for (const Schema& schema : material_extensions()) {
      const std::string name(schema.name.substr(schema.name.find('/') + 1));
      if (const auto* e = extension(name.c_str())) {
        read_values(*e, schema.members);
      }
    }
    if (m_.ior != 0 && m_.ior < 1) {
      status_ = Error{ErrorCode::kInvalidArgument, "ior must be 0, or 1 and above",
                      "/materials/" + std::to_string(scene_.materials.size()) +
                          "/extensions/KHR_materials_ior/ior"};
    }
    m_.attenuation_distance = std::max(m_.attenuation_distance, 0.0F);
    if (const auto* e = extension("KHR_materials_clearcoat");
        e != nullptr && e->Has("clearcoatNormalTexture")) {
      m_.clearcoat_normal_scale = value_number(e->Get("clearcoatNormalTexture"), "scale", 1);
    }
    if (const auto* e = extension("KHR_materials_volume_scatter")) {
      m_.multiscatter_color = value_rgb(*e, "multiscatterColorFactor", m_.multiscatter_color);
      warn_of_scatter_texture(*e);
    }
    if (const auto* e = extension("KHR_materials_scatter")) {
      read_scatter(*e);
    }
  }

  void read_values(const tinygltf::Value& e, std::span<const SchemaMember> members) {
    for (const SchemaMember& row : members) {
      const std::string name(row.name);
      if (row.number != nullptr) {
        m_.*row.number = value_number(e, name.c_str(), m_.*row.number);
      } else if (row.color != nullptr) {
        m_.*row.color = value_rgb(e, name.c_str(), m_.*row.color);
      } else if (row.texture != nullptr) {
        texture(m_.*row.texture, reference_of(e, name.c_str()));
      }
    }
  }

  void warn(const std::string& what) {
    scene_.warnings.emplace_back("material",
                                 "/materials/" + std::to_string(scene_.materials.size()),
                                 "material '" + m_.name + "': " + what);
  }

  /// The curve of extras counts instead of KHR_materials_ior, and for paths of wavelengths instead
  /// of KHR_materials_dispersion.
  void read_ior_curve() {
    auto curve =
        core::read_ior_curve(in_.extras, "/materials/" + std::to_string(scene_.materials.size()));
    if (!curve) {
      if (status_) {
        status_ = curve.error();
      }
      return;
    }
    if (!curve->is_known()) {
      return;
    }
    if (extension("KHR_materials_pbrSpecularGlossiness") != nullptr) {
      warn(
          "KHR_materials_pbrSpecularGlossiness has no index of refraction; the curve in extras has "
          "no effect");
      return;
    }
    m_.ior_curve = *curve;
    const float n_d = curve->at(kLineDNm);
    if (extension("KHR_materials_ior") != nullptr) {
      warn_of_contradiction("KHR_materials_ior", m_.ior, n_d, "which is used");
    }
    if (extension("KHR_materials_dispersion") != nullptr) {
      const float dispersion = 20 * (curve->at(kLineFNm) - curve->at(kLineCNm)) / (n_d - 1);
      warn_of_contradiction("KHR_materials_dispersion", m_.dispersion, dispersion,
                            "which is used if spectral is true");
    }
    m_.ior = n_d;
    if (m_.thickness <= 0 || (m_.transmission <= 0 && m_.diffuse_transmission <= 0)) {
      warn(
          "the curve in extras causes dispersion only in volumes (KHR_materials_volume with a "
          "thickness); elsewhere its index at 587.6 nm is used");
    }
  }

  /// extras.priority: which solid owns shared space (core/media/medium_stack.h).
  void read_priority() {
    if (!in_.extras.IsObject() || !in_.extras.Has("priority")) {
      return;
    }
    constexpr double kMost = 1000000;
    const tinygltf::Value& priority = in_.extras.Get("priority");
    const double value = priority.IsNumber() ? priority.GetNumberAsDouble() : kMost + 1;
    if (!(std::fabs(value) <= kMost) || value != std::floor(value)) {
      warn("extras.priority is ignored: it is not an integer from -1000000 to 1000000");
      return;
    }
    m_.priority = static_cast<int>(value);
    if (m_.thickness <= 0 || (m_.transmission <= 0 && m_.diffuse_transmission <= 0)) {
      warn(
          "extras.priority has no effect: the material bounds no volume (KHR_materials_volume with "
          "a thickness)");
    }
  }

  /// Values agree if they differ by no more than rounding to two decimals.
  void warn_of_contradiction(const char* extension_name, float theirs, float ours,
                             const char* which) {
    if (std::fabs(theirs - ours) > 0.005F) {
      char text[128];
      std::snprintf(text, sizeof text, "%s says %.4g, the curve in extras %.4g, %s", extension_name,
                    static_cast<double>(theirs), static_cast<double>(ours), which);
      warn(text);
    }
  }

  /// Textures apply to surfaces, and the medium is inside.
  void warn_of_scatter_texture(const tinygltf::Value& e) {
    if (e.Has("multiscatterColorTexture")) {
      warn("multiscatterColorTexture is ignored in volumes; only multiscatterColorFactor is used");
    }
  }

  /// KHR_materials_scatter: with a volume the medium scatters; thin walls transmit that share
  /// diffusely instead of straight on.
  void read_scatter(const tinygltf::Value& e) {
    const float strength = value_number(e, "scatterStrengthFactor", 1);
    const Rgb color = value_rgb(e, "multiscatterColorFactor", {1, 1, 1});
    if (m_.thickness > 0) {
      m_.multiscatter_color = color * strength;
      m_.scatter_anisotropy = value_number(e, "scatterAnisotropy", 0);
      warn_of_scatter_texture(e);
      return;
    }
    const float straight = m_.transmission * (1 - strength);
    if (straight < 1) {
      m_.diffuse_transmission = m_.transmission * strength / (1 - straight);
      m_.diffuse_transmission_color = color;
      texture(m_.diffuse_transmission_color_texture, reference_of(e, "multiscatterColorTexture"));
    }
    m_.transmission = straight;
    if (m_.transmission_texture.image >= 0) {
      warn(
          "transmissionTexture is ignored with KHR_materials_scatter on thin walls; only "
          "transmissionFactor is used");
      m_.transmission_texture = {};
    }
  }

  void read_specular_glossiness(const tinygltf::Value& e) {
    m_.base_color = value_rgb(e, "diffuseFactor", {1, 1, 1});
    m_.base_alpha = e.Has("diffuseFactor") && e.Get("diffuseFactor").ArrayLen() == 4
                        ? static_cast<float>(e.Get("diffuseFactor").Get(3).GetNumberAsDouble())
                        : 1.0F;
    m_.base_color_texture = {};
    texture(m_.base_color_texture, reference_of(e, "diffuseTexture"));
    m_.metallic = 0;
    m_.ior = 0;
    m_.specular = 1;
    m_.specular_color = value_rgb(e, "specularFactor", {1, 1, 1});
    texture(m_.specular_color_texture, reference_of(e, "specularGlossinessTexture"));
    const float glossiness = value_number(e, "glossinessFactor", 1);
    m_.roughness = 1 - glossiness;
    m_.metallic_roughness_texture = {};
    if (status_ && m_.specular_color_texture.image >= 0) {
      status_ = images_.decode_all();
    }
    if (status_ && m_.specular_color_texture.image >= 0) {
      const auto image = static_cast<std::size_t>(m_.specular_color_texture.image);
      m_.metallic_roughness_texture = m_.specular_color_texture;
      m_.metallic_roughness_texture.image =
          images_.add(roughness_from_glossiness(*scene_.images[image], glossiness));
      m_.roughness = 1;
    }
  }

  const tinygltf::Material& in_;
  GltfImages& images_;
  SceneDescription& scene_;
  MaterialDescription m_;
  Status status_ = ok_status();
};

}  // namespace

Status read_materials(const tinygltf::Model& model, const GltfTables& tables, GltfImages& images,
                      SceneDescription& scene) {
  for (const tinygltf::Material& in : model.materials) {
    auto material = MaterialReader(in, images, scene).read();
    if (!material && !tables.uses("materials", scene.materials.size())) {
      scene.materials.emplace_back().name = in.name;
      continue;
    }
    if (!material) {
      return material.error();
    }
    scene.materials.push_back(*std::move(material));
  }
  return ok_status();
}

}  // namespace core
