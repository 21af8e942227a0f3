#include "core/scene_io/gltf_schema.h"

#include <algorithm>
#include <array>
#include <set>
#include <string_view>
#include <vector>

#include "core/description/scene_description.h"
#include "core/image_io/radiance.h"

namespace core {
namespace {

using K = JsonKind;
using M = SchemaMember;
using D = MaterialDescription;

constexpr bool kRequired = true;

constexpr M integer(std::string_view name, bool required, double min,
                    std::string_view one_of = {}) {
  return {.name = name,
          .kind = K::kInteger,
          .required = required,
          .min = min,
          .one_of = one_of,
          .repair = required || one_of.empty() ? Repair::kRefuse : Repair::kLeaveOut};
}
constexpr M number(std::string_view name, double min, double max, bool required = false) {
  return {.name = name,
          .kind = K::kNumber,
          .required = required,
          .min = min,
          .max = max,
          .repair = Repair::kClamp};
}
constexpr M string(std::string_view name, bool required = false, std::string_view one_of = {}) {
  return {.name = name,
          .kind = K::kString,
          .required = required,
          .one_of = one_of,
          .repair = Repair::kLeaveOut};
}
constexpr M boolean(std::string_view name) {
  return {.name = name, .kind = K::kBoolean, .repair = Repair::kLeaveOut};
}
constexpr M index(std::string_view name, std::string_view refers_to, bool required = false) {
  return {
      .name = name, .kind = K::kInteger, .required = required, .min = 0, .refers_to = refers_to};
}
constexpr M indices(std::string_view name, std::string_view refers_to, bool required = false) {
  return {
      .name = name, .kind = K::kIntegers, .required = required, .min = 0, .refers_to = refers_to};
}
constexpr M object(std::string_view name, std::string_view child, bool required = false) {
  return {.name = name, .kind = K::kObject, .required = required, .child = child};
}
constexpr M objects(std::string_view name, std::string_view child, bool required = false) {
  return {.name = name, .kind = K::kObjects, .required = required, .child = child};
}
constexpr M numbers(std::string_view name, std::size_t count, double min = -1e300,
                    double max = 1e300) {
  return {.name = name,
          .kind = K::kNumbers,
          .min = min,
          .max = max,
          .count_min = count,
          .count_max = count,
          .repair = Repair::kClamp};
}
constexpr M quaternion(std::string_view name) {
  M row = numbers(name, 4, -1.001, 1.001);
  row.repair = Repair::kNormalize;
  return row;
}
/// Part of a node's transform.
constexpr M transform(std::string_view name, std::size_t count) {
  M row = numbers(name, count, -3.4e38, 3.4e38);
  row.repair = Repair::kRefuse;
  return row;
}
constexpr M with_default(M row, double otherwise) {
  row.otherwise = otherwise;
  return row;
}
constexpr M number_list(std::string_view name) {
  return {.name = name, .kind = K::kNumbers, .repair = Repair::kLeaveOut};
}
constexpr M strings(std::string_view name) { return {.name = name, .kind = K::kStrings}; }
constexpr M texture(std::string_view name) { return object(name, "textureInfo"); }
constexpr M factor(std::string_view name) { return number(name, 0, 1); }

/// Rows that are a value of the material.
constexpr M as(M row, float D::*value) {
  row.number = value;
  return row;
}
constexpr M as(M row, Rgb D::*value) {
  row.color = value;
  return row;
}
constexpr M as(M row, TextureDescription D::*value) {
  row.texture = value;
  return row;
}
constexpr M factor(std::string_view name, float D::*value) { return as(factor(name), value); }
constexpr M color(std::string_view name, Rgb D::*value, double max = 1) {
  return as(numbers(name, 3, 0, max), value);
}
constexpr M texture(std::string_view name, TextureDescription D::*value) {
  return as(texture(name), value);
}

constexpr double kBig = 3.4e38;
constexpr double kBright = 1e18;
static_assert(static_cast<float>(kBright) == kRadianceMost);
constexpr std::string_view kComponentTypes = "5120|5121|5122|5123|5125|5126";

constexpr std::array kRoot = {object("asset", "asset", kRequired),
                              objects("accessors", "accessor"),
                              objects("animations", "animation"),
                              objects("buffers", "buffer"),
                              objects("bufferViews", "bufferView"),
                              objects("cameras", "camera"),
                              objects("images", "image"),
                              objects("materials", "material"),
                              objects("meshes", "mesh"),
                              objects("nodes", "node"),
                              objects("samplers", "sampler"),
                              objects("scenes", "scene"),
                              objects("skins", "skin"),
                              objects("textures", "texture"),
                              index("scene", "scenes"),
                              strings("extensionsUsed"),
                              strings("extensionsRequired")};
constexpr std::array kAsset = {string("version", kRequired), string("minVersion"),
                               string("generator")};
constexpr std::array kAccessor = {index("bufferView", "bufferViews"),
                                  integer("byteOffset", false, 0),
                                  integer("componentType", kRequired, 0, kComponentTypes),
                                  boolean("normalized"),
                                  integer("count", kRequired, 1),
                                  string("type", kRequired, "SCALAR|VEC2|VEC3|VEC4|MAT2|MAT3|MAT4"),
                                  object("sparse", "sparse"),
                                  string("name")};
constexpr std::array kSparse = {integer("count", kRequired, 1),
                                object("indices", "sparseIndices", kRequired),
                                object("values", "sparseValues", kRequired)};
constexpr std::array kSparseIndices = {index("bufferView", "bufferViews", kRequired),
                                       integer("byteOffset", false, 0),
                                       integer("componentType", kRequired, 0, "5121|5123|5125")};
constexpr std::array kSparseValues = {index("bufferView", "bufferViews", kRequired),
                                      integer("byteOffset", false, 0)};
constexpr std::array kBuffer = {integer("byteLength", kRequired, 1), string("uri"), string("name")};
constexpr std::array kBufferView = {
    index("buffer", "buffers", kRequired), integer("byteOffset", false, 0),
    integer("byteLength", kRequired, 1),
    M{.name = "byteStride", .kind = K::kInteger, .min = 4, .max = 252, .repair = Repair::kKeep},
    string("name")};
constexpr std::array kMeshopt = {
    index("buffer", "buffers", kRequired),
    integer("byteOffset", false, 0),
    integer("byteLength", kRequired, 1),
    M{.name = "byteStride", .kind = K::kInteger, .required = true, .min = 1, .max = 256},
    integer("count", kRequired, 1),
    string("mode", kRequired, "ATTRIBUTES|TRIANGLES|INDICES"),
    string("filter", false, "NONE|OCTAHEDRAL|QUATERNION|EXPONENTIAL")};
constexpr std::array kMeshoptBuffer = {boolean("fallback")};
constexpr std::array kImage = {string("uri"), string("mimeType"),
                               index("bufferView", "bufferViews"), string("name")};
constexpr std::array kSampler = {integer("magFilter", false, 0, "9728|9729"),
                                 integer("minFilter", false, 0, "9728|9729|9984|9985|9986|9987"),
                                 integer("wrapS", false, 0, "33071|33648|10497"),
                                 integer("wrapT", false, 0, "33071|33648|10497"), string("name")};
constexpr std::array kTexture = {index("source", "images"), index("sampler", "samplers"),
                                 string("name")};
constexpr std::array kTextureSource = {index("source", "images", kRequired)};
constexpr M kTexCoord = {.name = "texCoord", .kind = K::kInteger, .min = 0, .max = 65535};
constexpr std::array kTextureInfo = {index("index", "textures", kRequired), kTexCoord,
                                     number("scale", -kBig, kBig), number("strength", 0, 1)};
/// Occlusion is computed: its texture is not read, and its references need not exist.
constexpr std::array kOcclusionInfo = {number("strength", 0, 1)};
constexpr std::array kTextureTransform = {numbers("offset", 2), number("rotation", -kBig, kBig),
                                          numbers("scale", 2), kTexCoord};

constexpr std::array kCamera = {string("type", kRequired, "perspective|orthographic"),
                                object("perspective", "perspective"),
                                object("orthographic", "orthographic"), string("name")};
constexpr std::array kPerspective = {
    M{.name = "yfov", .required = true, .min = 1e-6, .max = 3.14159265},
    number("aspectRatio", 1e-6, 1e6), with_default(number("znear", 0, kBig, kRequired), 0),
    number("zfar", 0, kBig)};
constexpr std::array kOrthographic = {number("xmag", -kBig, kBig, kRequired),
                                      number("ymag", -kBig, kBig, kRequired),
                                      with_default(number("znear", 0, kBig, kRequired), 0),
                                      with_default(number("zfar", 0, kBig, kRequired), kBig)};
constexpr std::array kScene = {indices("nodes", "nodes"), string("name")};
constexpr std::array kNode = {index("camera", "cameras"), indices("children", "nodes"),
                              index("skin", "skins"),     transform("matrix", 16),
                              index("mesh", "meshes"),    quaternion("rotation"),
                              transform("scale", 3),      transform("translation", 3),
                              number_list("weights"),     string("name")};
constexpr std::array kNodeLight = {index("light", "lights", kRequired)};
constexpr std::array kNodeVisibility = {boolean("visible")};
constexpr std::array kGpuInstancing = {M{.name = "attributes",
                                         .kind = K::kIntegerMap,
                                         .required = true,
                                         .min = 0,
                                         .refers_to = "accessors"}};
constexpr std::array kMesh = {objects("primitives", "primitive", kRequired), number_list("weights"),
                              string("name")};
constexpr std::array kPrimitive = {
    M{.name = "attributes",
      .kind = K::kIntegerMap,
      .required = true,
      .min = 0,
      .refers_to = "accessors",
      .count_min = 1},
    index("indices", "accessors"), index("material", "materials"),
    M{.name = "mode", .kind = K::kInteger, .min = 0, .max = 6},
    M{.name = "targets", .kind = K::kIntegerMaps, .min = 0, .refers_to = "accessors"}};
constexpr std::array kDraco = {
    index("bufferView", "bufferViews", kRequired),
    M{.name = "attributes", .kind = K::kIntegerMap, .required = true, .min = 0}};
constexpr std::array kVariantMappings = {objects("mappings", "variantMapping", kRequired)};
constexpr std::array kVariantMapping = {index("material", "materials", kRequired),
                                        indices("variants", "variants", kRequired)};
constexpr std::array kVariants = {objects("variants", "variant", kRequired)};
constexpr std::array kVariant = {string("name", kRequired)};
constexpr std::array kSkin = {index("inverseBindMatrices", "accessors"), index("skeleton", "nodes"),
                              M{.name = "joints",
                                .kind = K::kIntegers,
                                .required = true,
                                .min = 0,
                                .refers_to = "nodes",
                                .count_min = 1},
                              string("name")};
constexpr std::array kAnimation = {objects("channels", "channel", kRequired),
                                   objects("samplers", "animationSampler", kRequired),
                                   string("name")};
constexpr std::array kChannel = {integer("sampler", kRequired, 0),
                                 object("target", "target", kRequired)};
constexpr std::array kTarget = {index("node", "nodes"), string("path", kRequired)};
constexpr std::array kPointerTarget = {string("pointer", kRequired)};
constexpr std::array kAnimationSampler = {index("input", "accessors", kRequired),
                                          string("interpolation", false, "LINEAR|STEP|CUBICSPLINE"),
                                          index("output", "accessors", kRequired)};
constexpr std::array kLights = {objects("lights", "light", kRequired)};
constexpr std::array kLight = {numbers("color", 3, 0, 1),
                               number("intensity", 0, kBright),
                               string("type", kRequired, "directional|point|spot"),
                               number("range", 0, kBig),
                               object("spot", "spot"),
                               string("name")};
constexpr std::array kSpot = {number("innerConeAngle", 0, 1.5707964),
                              number("outerConeAngle", 0, 1.5707964)};
constexpr std::array kProfiles = {objects("lights", "profile", kRequired)};
constexpr std::array kProfile = {string("uri"), index("bufferView", "bufferViews"),
                                 string("mimeType", false, "application/x-ies-lm-63"),
                                 string("name")};
constexpr std::array kNodeProfile = {index("light", "light profiles", kRequired),
                                     number("multiplier", 0, kBright), numbers("color", 3, 0, 1)};
constexpr std::array kImageLights = {objects("lights", "imageLight", kRequired)};
constexpr std::array kImageLight = {string("name"),
                                    quaternion("rotation"),
                                    number("intensity", 0, kBright),
                                    M{.name = "irradianceCoefficients",
                                      .kind = K::kNumberRows,
                                      .required = true,
                                      .count_min = 9,
                                      .count_max = 9,
                                      .row_count = 3},
                                    M{.name = "specularImages",
                                      .kind = K::kIntegerRows,
                                      .required = true,
                                      .min = 0,
                                      .refers_to = "images",
                                      .count_min = 1,
                                      .row_count = 6},
                                    integer("specularImageSize", kRequired, 1)};
constexpr std::array kSceneImageLight = {index("light", "image-based lights", kRequired)};

constexpr std::array kMaterial = {object("pbrMetallicRoughness", "pbr"),
                                  texture("normalTexture"),
                                  object("occlusionTexture", "occlusionInfo"),
                                  texture("emissiveTexture"),
                                  numbers("emissiveFactor", 3, 0, 1),
                                  string("alphaMode", false, "OPAQUE|MASK|BLEND"),
                                  number("alphaCutoff", 0, kBig),
                                  boolean("doubleSided"),
                                  string("name")};
constexpr std::array kPbr = {numbers("baseColorFactor", 4, 0, 1), texture("baseColorTexture"),
                             factor("metallicFactor"), factor("roughnessFactor"),
                             texture("metallicRoughnessTexture")};
constexpr std::array kEmissiveStrength = {number("emissiveStrength", 0, kBright)};
constexpr std::array kIor = {as(number("ior", 0, 1e4), &D::ior)};
constexpr std::array kSpecular = {factor("specularFactor", &D::specular),
                                  texture("specularTexture", &D::specular_texture),
                                  color("specularColorFactor", &D::specular_color, kBig),
                                  texture("specularColorTexture", &D::specular_color_texture)};
constexpr std::array kAnisotropy = {
    factor("anisotropyStrength", &D::anisotropy),
    as(number("anisotropyRotation", -kBig, kBig), &D::anisotropy_rotation_rad),
    texture("anisotropyTexture", &D::anisotropy_texture)};
constexpr std::array kClearcoat = {
    factor("clearcoatFactor", &D::clearcoat), texture("clearcoatTexture", &D::clearcoat_texture),
    factor("clearcoatRoughnessFactor", &D::clearcoat_roughness),
    texture("clearcoatRoughnessTexture", &D::clearcoat_roughness_texture),
    texture("clearcoatNormalTexture", &D::clearcoat_normal_texture)};
constexpr std::array kSheen = {color("sheenColorFactor", &D::sheen_color),
                               texture("sheenColorTexture", &D::sheen_color_texture),
                               factor("sheenRoughnessFactor", &D::sheen_roughness),
                               texture("sheenRoughnessTexture", &D::sheen_roughness_texture)};
constexpr std::array kIridescence = {
    factor("iridescenceFactor", &D::iridescence),
    texture("iridescenceTexture", &D::iridescence_texture),
    as(number("iridescenceIor", 1, 1e4), &D::iridescence_ior),
    as(number("iridescenceThicknessMinimum", 0, kBig), &D::iridescence_thickness_min_nm),
    as(number("iridescenceThicknessMaximum", 0, kBig), &D::iridescence_thickness_max_nm),
    texture("iridescenceThicknessTexture", &D::iridescence_thickness_texture)};
constexpr std::array kTransmission = {factor("transmissionFactor", &D::transmission),
                                      texture("transmissionTexture", &D::transmission_texture)};
constexpr std::array kVolume = {
    as(number("thicknessFactor", 0, kBig), &D::thickness),
    texture("thicknessTexture", &D::thickness_texture),
    as(number("attenuationDistance", -kBig, kBig), &D::attenuation_distance),
    color("attenuationColor", &D::attenuation_color)};
constexpr std::array kVolumeScatter = {
    color("multiscatterColor", &D::multiscatter_color), numbers("multiscatterColorFactor", 3, 0, 1),
    as(number("scatterAnisotropy", -0.999, 0.999), &D::scatter_anisotropy)};
constexpr std::array kDispersion = {as(number("dispersion", 0, kBig), &D::dispersion)};
constexpr std::array kDiffuseTransmission = {
    factor("diffuseTransmissionFactor", &D::diffuse_transmission),
    texture("diffuseTransmissionTexture", &D::diffuse_transmission_texture),
    color("diffuseTransmissionColorFactor", &D::diffuse_transmission_color),
    texture("diffuseTransmissionColorTexture", &D::diffuse_transmission_color_texture)};
constexpr std::array kScatter = {
    factor("scatterStrengthFactor"), numbers("multiscatterColorFactor", 3, 0, 1),
    texture("multiscatterColorTexture"), number("scatterAnisotropy", -0.999, 0.999)};
constexpr std::array kSpecGloss = {numbers("diffuseFactor", 4, 0, 1), texture("diffuseTexture"),
                                   numbers("specularFactor", 3, 0, 1), factor("glossinessFactor"),
                                   texture("specularGlossinessTexture")};

constexpr std::array kSchemas = {
    Schema{"root", kRoot},
    Schema{"asset", kAsset},
    Schema{"accessor", kAccessor},
    Schema{"sparse", kSparse},
    Schema{"sparseIndices", kSparseIndices},
    Schema{"sparseValues", kSparseValues},
    Schema{"buffer", kBuffer},
    Schema{"buffer/EXT_meshopt_compression", kMeshoptBuffer},
    Schema{"bufferView", kBufferView},
    Schema{"bufferView/EXT_meshopt_compression", kMeshopt},
    Schema{"image", kImage},
    Schema{"sampler", kSampler},
    Schema{"texture", kTexture},
    Schema{"texture/EXT_texture_webp", kTextureSource},
    Schema{"texture/KHR_texture_basisu", kTextureSource},
    Schema{"textureInfo", kTextureInfo},
    Schema{"occlusionInfo", kOcclusionInfo},
    Schema{"textureInfo/KHR_texture_transform", kTextureTransform},
    Schema{"camera", kCamera},
    Schema{"perspective", kPerspective},
    Schema{"orthographic", kOrthographic},
    Schema{"scene", kScene},
    Schema{"node", kNode},
    Schema{"node/EXT_lights_ies", kNodeProfile},
    Schema{"node/KHR_lights_punctual", kNodeLight},
    Schema{"node/KHR_node_visibility", kNodeVisibility},
    Schema{"node/EXT_mesh_gpu_instancing", kGpuInstancing},
    Schema{"mesh", kMesh},
    Schema{"primitive", kPrimitive},
    Schema{"primitive/KHR_draco_mesh_compression", kDraco},
    Schema{"primitive/KHR_materials_variants", kVariantMappings},
    Schema{"variantMapping", kVariantMapping},
    Schema{"root/KHR_materials_variants", kVariants},
    Schema{"variant", kVariant},
    Schema{"skin", kSkin},
    Schema{"animation", kAnimation},
    Schema{"channel", kChannel},
    Schema{"target", kTarget},
    Schema{"target/KHR_animation_pointer", kPointerTarget},
    Schema{"animationSampler", kAnimationSampler},
    Schema{"root/EXT_lights_ies", kProfiles},
    Schema{"profile", kProfile},
    Schema{"root/EXT_lights_image_based", kImageLights},
    Schema{"imageLight", kImageLight},
    Schema{"scene/EXT_lights_image_based", kSceneImageLight},
    Schema{"root/KHR_lights_punctual", kLights},
    Schema{"light", kLight},
    Schema{"spot", kSpot},
    Schema{"material", kMaterial},
    Schema{"pbr", kPbr},
};

// In the order in which they are written.
constexpr std::array kMaterialExtensions = {
    Schema{"material/KHR_materials_emissive_strength", kEmissiveStrength},
    Schema{"material/KHR_materials_specular", kSpecular},
    Schema{"material/KHR_materials_transmission", kTransmission},
    Schema{"material/KHR_materials_volume", kVolume},
    Schema{"material/KHR_materials_volume_scatter", kVolumeScatter},
    Schema{"material/KHR_materials_clearcoat", kClearcoat},
    Schema{"material/KHR_materials_sheen", kSheen},
    Schema{"material/KHR_materials_iridescence", kIridescence},
    Schema{"material/KHR_materials_anisotropy", kAnisotropy},
    Schema{"material/KHR_materials_diffuse_transmission", kDiffuseTransmission},
    Schema{"material/KHR_materials_ior", kIor},
    Schema{"material/KHR_materials_dispersion", kDispersion},
    Schema{"material/KHR_materials_scatter", kScatter},
    Schema{"material/KHR_materials_pbrSpecularGlossiness", kSpecGloss},
};

constexpr std::array<std::span<const Schema>, 2> kTables = {kSchemas, kMaterialExtensions};

/// Supported extensions whose schema has no members, or is that of the core.
constexpr std::array<std::string_view, 4> kWithoutMembers = {
    "KHR_materials_unlit", "KHR_mesh_quantization", "KHR_xmp", "KHR_xmp_json_ld"};

}  // namespace

const std::span<const SchemaMember>* find_schema(std::string_view name) {
  for (const std::span<const Schema> rows : kTables) {
    for (const Schema& row : rows) {
      if (row.name == name) {
        return &row.members;
      }
    }
  }
  return nullptr;
}

std::span<const Schema> material_extensions() { return kMaterialExtensions; }

bool is_supported_extension(std::string_view name) {
  const auto all = supported_extensions();
  return std::find(all.begin(), all.end(), name) != all.end();
}

std::span<const std::string_view> supported_extensions() {
  static const std::vector<std::string_view> kNames = [] {
    std::set<std::string_view> all(kWithoutMembers.begin(), kWithoutMembers.end());
    for (const std::span<const Schema> rows : kTables) {
      for (const Schema& row : rows) {
        if (const auto slash = row.name.find('/'); slash != std::string_view::npos) {
          all.insert(row.name.substr(slash + 1));
        }
      }
    }
    return std::vector<std::string_view>(all.begin(), all.end());
  }();
  return kNames;
}

}  // namespace core
