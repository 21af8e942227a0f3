// write_glb(): writes a scene description as a GLB.
#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

#include "core/base/check.h"
#include "core/image_io/image_io.h"
#include "core/scene_io/glb_writer.h"
#include "core/scene_io/gltf_schema.h"

namespace core {
namespace {

using Json = nlohmann::json;

constexpr int kFloat = 5126;
constexpr int kU16 = 5123;
constexpr int kU32 = 5125;

Json array_of(Rgb c) { return Json::array({c.r, c.g, c.b}); }
Json array_of(Vec3 v) { return Json::array({v.x, v.y, v.z}); }

template <typename T>
std::span<const std::byte> bytes_of(const std::vector<T>& values) {
  return std::as_bytes(std::span(values));
}

class SceneWriter {
 public:
  explicit SceneWriter(const SceneDescription& scene) : scene_(scene) {}

  Bytes run() {
    for (const auto& image : scene_.images) {
      write_image(*image);
    }
    for (const MaterialDescription& material : scene_.materials) {
      writer_.add("materials", material_json(material).dump());
    }
    for (const MeshDescription& mesh : scene_.meshes) {
      write_mesh(mesh);
    }
    for (const InstanceDescription& instance : scene_.instances) {
      const std::string& name = scene_.meshes[static_cast<std::size_t>(instance.mesh)].name;
      write_node({{"mesh", instance.mesh}, {"name", name}}, instance.to_world);
    }
    for (const CameraDescription& camera : scene_.cameras) {
      write_camera(camera);
    }
    write_lights();
    return writer_.finish();
  }

 private:
  void write_image(const Image& image) {
    CHECK(image.type == PixelType::kU8);
    FloatImage pixels{image.width, image.height, {}, {}};
    const char* names[] = {"R", "G", "B", "A"};
    for (int c = 0; c < image.channels; ++c) {
      pixels.channel_names.emplace_back(names[c]);
    }
    // encode_image() divides by alpha; colour where alpha is 0 is lost.
    const auto channels = static_cast<std::size_t>(image.channels);
    for (std::size_t i = 0; i < image.bytes.size(); ++i) {
      const auto value = [&image](std::size_t at) {
        return static_cast<float>(std::to_integer<int>(image.bytes[at])) / 255.0F;
      };
      const bool is_color_with_alpha = channels == 4 && i % 4 != 3;
      pixels.values.push_back(is_color_with_alpha ? value(i) * value(i / 4 * 4 + 3) : value(i));
    }
    EncodeOptions options;
    options.is_color = false;  // the bytes are already encoded
    const auto png = encode_image(pixels, image_formats()[0], options);
    if (!png) {  // The module that encodes images is not installed; no scene is at fault.
      check_failed(png.error().message.c_str(), __FILE__, __LINE__);
    }
    const int view = writer_.add_view(*png);
    writer_.add("images", Json{{"bufferView", view}, {"mimeType", "image/png"}}.dump());
  }

  // One texture object per use: samplers and textures are small.
  Json texture_json(const TextureDescription& texture) {
    const auto wrap = [](TextureWrap w) {
      return w == TextureWrap::kRepeat ? 10497
                                       : (w == TextureWrap::kMirroredRepeat ? 33648 : 33071);
    };
    const Json sampler = {{"wrapS", wrap(texture.wrap_u)},
                          {"wrapT", wrap(texture.wrap_v)},
                          {"magFilter", texture.nearest ? 9728 : 9729}};
    const int sampler_index = writer_.add("samplers", sampler.dump());
    const Json object = {{"source", texture.image}, {"sampler", sampler_index}};
    Json info = {{"index", writer_.add("textures", object.dump())}, {"texCoord", texture.uv_set}};
    const auto& m = texture.uv_transform;
    if (m != std::array<float, 6>{1, 0, 0, 0, 1, 0}) {
      // m is rotation times scale: [c sx, s sy, ox; -s sx, c sy, oy].
      writer_.use_extension("KHR_texture_transform");
      const float rotation = std::atan2(-m[3], m[0]);
      const float mirrored = m[0] * m[4] - m[1] * m[3] < 0 ? -1.0F : 1.0F;
      info["extensions"]["KHR_texture_transform"] = {
          {"offset", {m[2], m[5]}},
          {"rotation", rotation},
          {"scale", {std::hypot(m[0], m[3]), mirrored * std::hypot(m[1], m[4])}}};
    }
    return info;
  }

  void put_texture(Json& object, const std::string& name, const TextureDescription& texture) {
    if (texture.image >= 0) {
      object[name] = texture_json(texture);
    }
  }

  void put_extension(Json& material, std::string_view name, Json extension) {
    if (!extension.is_null()) {
      writer_.use_extension(name);
      material["extensions"][std::string(name)] = std::move(extension);
    }
  }

  Json material_json(const MaterialDescription& m) {
    Json json = {{"name", m.name}, {"doubleSided", m.double_sided}};
    Json& pbr = json["pbrMetallicRoughness"];
    pbr["baseColorFactor"] = {m.base_color.r, m.base_color.g, m.base_color.b, m.base_alpha};
    pbr["metallicFactor"] = m.metallic;
    pbr["roughnessFactor"] = m.roughness;
    put_texture(pbr, "baseColorTexture", m.base_color_texture);
    put_texture(pbr, "metallicRoughnessTexture", m.metallic_roughness_texture);
    put_texture(json, "normalTexture", m.normal_texture);
    if (json.contains("normalTexture")) {
      json["normalTexture"]["scale"] = m.normal_scale;
    }
    put_texture(json, "occlusionTexture", m.occlusion_texture);
    put_texture(json, "emissiveTexture", m.emissive_texture);
    if (m.alpha_mode != AlphaMode::kOpaque) {
      json["alphaMode"] = m.alpha_mode == AlphaMode::kMask ? "MASK" : "BLEND";
    }
    if (m.alpha_mode == AlphaMode::kMask) {
      json["alphaCutoff"] = m.alpha_cutoff;
    }
    const float strength = max_component(m.emissive);
    if (strength > 1) {
      json["emissiveFactor"] = array_of(m.emissive / strength);
      put_extension(json, "KHR_materials_emissive_strength", {{"emissiveStrength", strength}});
    } else if (strength > 0) {
      json["emissiveFactor"] = array_of(m.emissive);
    }
    if (m.unlit) {
      put_extension(json, "KHR_materials_unlit", Json::object());
    }
    for (const Schema& extension : material_extensions()) {
      put_extension(json, extension.name.substr(extension.name.find('/') + 1),
                    extension_json(m, extension.members));
    }
    if (m.ior_curve.formula == IorFormula::kCauchy) {
      json["extras"]["ior_cauchy"] = m.ior_curve.a;
    } else if (m.ior_curve.formula == IorFormula::kSellmeier) {
      json["extras"]["ior_sellmeier"] = {{"b", m.ior_curve.a}, {"c_um2", m.ior_curve.c}};
    }
    if (m.priority != 0) {
      json["extras"]["priority"] = m.priority;
    }
    return json;
  }

  /// Returns the values that are not the defaults; null if all are.
  Json extension_json(const MaterialDescription& m, std::span<const SchemaMember> members) {
    static const MaterialDescription kDefaults;
    Json e;
    for (const SchemaMember& row : members) {
      const std::string name(row.name);
      if (row.number != nullptr && m.*row.number != kDefaults.*row.number) {
        e[name] = m.*row.number;
      } else if (row.color != nullptr && !(m.*row.color == kDefaults.*row.color)) {
        e[name] = array_of(m.*row.color);
      } else if (row.texture != nullptr) {
        put_texture(e, name, m.*row.texture);
      }
    }
    if (e.contains("clearcoatNormalTexture")) {
      e["clearcoatNormalTexture"]["scale"] = m.clearcoat_normal_scale;
    }
    return e;
  }

  template <typename T>
  void put_attribute(Json& attributes, const char* name, const std::vector<T>& values) {
    if (!values.empty()) {
      const char* type = sizeof(T) == 8 ? "VEC2" : (sizeof(T) == 12 ? "VEC3" : "VEC4");
      attributes[name] = writer_.add_accessor(bytes_of(values), kFloat, type, values.size());
    }
  }

  // Positions have bounds, as the specification requires.
  int position_accessor(const std::vector<Vec3>& positions) {
    Bounds bounds;
    for (const Vec3 p : positions) {
      bounds.add(p);
    }
    const Json range = {{"min", array_of(bounds.min)}, {"max", array_of(bounds.max)}};
    return writer_.add_accessor(bytes_of(positions), kFloat, "VEC3", positions.size(),
                                range.dump());
  }

  int index_accessor(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
    if (vertices > 65535) {
      return writer_.add_accessor(bytes_of(indices), kU32, "SCALAR", indices.size());
    }
    std::vector<std::uint16_t> narrow;
    for (const std::uint32_t i : indices) {
      narrow.push_back(static_cast<std::uint16_t>(i));
    }
    return writer_.add_accessor(bytes_of(narrow), kU16, "SCALAR", narrow.size());
  }

  void write_mesh(const MeshDescription& mesh) {
    Json primitives = Json::array();
    for (const PrimitiveDescription& p : mesh.primitives) {
      Json attributes = {{"POSITION", position_accessor(p.positions)}};
      put_attribute(attributes, "NORMAL", p.normals);
      put_attribute(attributes, "TANGENT", p.tangents);
      put_attribute(attributes, "TEXCOORD_0", p.uv[0]);
      put_attribute(attributes, "TEXCOORD_1", p.uv[1]);
      put_attribute(attributes, "COLOR_0", p.colors);
      Json primitive = {{"attributes", attributes},
                        {"indices", index_accessor(p.indices, p.positions.size())}};
      if (p.material >= 0) {
        primitive["material"] = p.material;
      }
      primitives.push_back(primitive);
    }
    writer_.add("meshes", Json{{"name", mesh.name}, {"primitives", primitives}}.dump());
  }

  void write_node(Json node, const Transform& m) {
    const Place t = scene_.origin + m.t;
    const Json place = scene_.origin == Place{} ? array_of(m.t) : Json::array({t.x, t.y, t.z});
    if (!(m.x == Vec3{1, 0, 0} && m.y == Vec3{0, 1, 0} && m.z == Vec3{0, 0, 1})) {
      node["matrix"] = {m.x.x, m.x.y, m.x.z, 0, m.y.x,    m.y.y,    m.y.z,    0,
                        m.z.x, m.z.y, m.z.z, 0, place[0], place[1], place[2], 1};
    } else if (!(m.t == Vec3{} && scene_.origin == Place{})) {
      node["translation"] = place;
    }
    writer_.add("nodes", node.dump());
  }

  void write_camera(const CameraDescription& camera) {
    // glTF requires planes: these are none (Camera::set_planes).
    constexpr float kNear = 1e-30F;
    constexpr float kFar = 1e30F;
    Json json = {{"name", camera.name}};
    if (camera.orthographic) {
      json["type"] = "orthographic";
      json["orthographic"] = {{"xmag", camera.x_magnification},
                              {"ymag", camera.y_magnification},
                              {"znear", camera.near_m},
                              {"zfar", std::min(camera.far_m, kFar)}};
    } else {
      json["type"] = "perspective";
      json["perspective"] = {{"yfov", camera.vertical_fov_rad},
                             {"znear", std::max(camera.near_m, kNear)}};
      if (camera.far_m < kFar) {
        json["perspective"]["zfar"] = camera.far_m;
      }
      if (camera.aspect_ratio > 0) {
        json["perspective"]["aspectRatio"] = camera.aspect_ratio;
      }
    }
    write_node({{"camera", writer_.add("cameras", json.dump())}, {"name", camera.name}},
               camera.to_world);
  }

  void write_lights() {
    if (scene_.lights.empty()) {
      return;
    }
    Json lights = Json::array();
    for (const PunctualLightDescription& light : scene_.lights) {
      CHECK(light.type != PunctualType::kProfile);
      const float strength = max_component(light.intensity);
      Json json = {{"name", light.name}, {"intensity", strength}};
      json["color"] = array_of(strength > 0 ? light.intensity / strength : Rgb(1));
      json["type"] = light.type == PunctualType::kDirectional ? "directional"
                     : light.type == PunctualType::kSpot      ? "spot"
                                                              : "point";
      if (light.type == PunctualType::kSpot) {
        json["spot"] = {{"innerConeAngle", light.inner_cone_rad},
                        {"outerConeAngle", light.outer_cone_rad}};
      }
      if (light.range_m > 0) {
        json["range"] = light.range_m;
      }
      const Json reference = {{"KHR_lights_punctual", {{"light", lights.size()}}}};
      write_node({{"name", light.name}, {"extensions", reference}}, light.to_world);
      lights.push_back(json);
    }
    writer_.use_extension("KHR_lights_punctual");
    writer_.set("extensions", Json{{"KHR_lights_punctual", {{"lights", lights}}}}.dump());
  }

  const SceneDescription& scene_;
  GlbWriter writer_;
};

}  // namespace

Bytes write_glb(const SceneDescription& scene) { return SceneWriter(scene).run(); }

}  // namespace core
