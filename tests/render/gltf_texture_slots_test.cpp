// Every texture of glTF's materials against its factors: a texture of one texel looks as if the
// factors were multiplied by those channels of the texel that glTF 2.0 and the KHR extensions name,
// and one of many cells as if by the cell that its coordinates and its transform lead to.
// The rows are checked against the schema that the loader reads by, so that a new texture without a
// row fails.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "core/scene_io/gltf_schema.h"
#include "tests/render/gltf_stage.h"

namespace {

using core::MaterialDescription;
using core::Rgb;
using core::SceneDescription;
using core::TextureDescription;
using core::Vec3;

/// Red, green, blue, alpha, 0 to 255.
using Texel = std::array<int, 4>;
constexpr Texel kTexel = {51, 102, 153, 204};
/// A normal of (0.30, 0.10, 0.80); z stays positive if the channels are exchanged.
constexpr Texel kNormal = {166, 140, 230, 200};

/// A channel of data.
float data(const Texel& t, std::size_t channel) { return static_cast<float>(t[channel]) / 255; }
/// A colour, which is stored as sRGB.
Rgb color(const Texel& t) {
  const auto linear = [&t](std::size_t c) {
    return static_cast<float>(test_support::srgb_to_linear(t[c]));
  };
  return {linear(0), linear(1), linear(2)};
}
Vec3 normal(const Texel& t) {
  return core::normalize(Vec3{2 * data(t, 0) - 1, 2 * data(t, 1) - 1, 2 * data(t, 2) - 1});
}

struct Row {
  std::string_view name;  ///< of the member in the file
  TextureDescription MaterialDescription::*texture;
  std::function<void(MaterialDescription&)> prepare;  ///< makes the texture visible
  /// Puts the texel into the factors, or into the vertex normals.
  std::function<void(SceneDescription&, const Texel&)> apply;
  Texel texel = kTexel;
  bool is_known_unused = false;  ///< a path tracer has no use for it
};

MaterialDescription& material(SceneDescription& scene) { return scene.materials[0]; }

void plain(MaterialDescription& m) {
  m.metallic = 0;
  m.roughness = 0.5F;
  m.base_color = {0.8F, 0.6F, 0.4F};
}
void metal(MaterialDescription& m) {
  m.roughness = 0.5F;
  m.base_color = {0.5F, 0.4F, 0.3F};
}
void coated(MaterialDescription& m) {
  plain(m);
  m.base_color = {0, 0, 0};
  m.specular = 0;
  m.clearcoat = 1;
  m.clearcoat_roughness = 1;
}
void with_film(MaterialDescription& m) {
  metal(m);
  m.iridescence = 1;
  m.iridescence_thickness_min_nm = 150;
  m.iridescence_thickness_max_nm = 550;
}

void turn_vertex_normals(SceneDescription& scene, const Texel& t) {
  scene.meshes[0].primitives[0].normals.assign(4, normal(t));
}
void change_nothing(SceneDescription&, const Texel&) {}

std::vector<Row> rows() {
  using M = MaterialDescription;
  using S = SceneDescription;
  return {
      {"baseColorTexture", &M::base_color_texture,
       [](M& m) {
         plain(m);
         m.alpha_mode = core::AlphaMode::kMask;
         m.alpha_cutoff = 0.7F;  // between alpha and the other channels
       },
       [](S& s, const Texel& t) {
         material(s).base_color *= color(t);
         material(s).base_alpha *= data(t, 3);
       }},
      {"metallicRoughnessTexture", &M::metallic_roughness_texture,
       [](M& m) {
         metal(m);
         m.roughness = 1;
       },
       [](S& s, const Texel& t) {
         material(s).roughness *= data(t, 1);
         material(s).metallic *= data(t, 2);
       }},
      {"normalTexture", &M::normal_texture, &plain, &turn_vertex_normals, kNormal},
      {"occlusionTexture", &M::occlusion_texture, &plain, &change_nothing, kTexel, true},
      {"emissiveTexture", &M::emissive_texture,
       [](M& m) {
         m.emissive = {1, 0.5F, 2};
       },
       [](S& s, const Texel& t) { material(s).emissive *= color(t); }},
      {"specularTexture", &M::specular_texture, &plain,
       [](S& s, const Texel& t) { material(s).specular *= data(t, 3); }},
      {"specularColorTexture", &M::specular_color_texture, &plain,
       [](S& s, const Texel& t) { material(s).specular_color *= color(t); }},
      {"transmissionTexture", &M::transmission_texture,
       [](M& m) {
         plain(m);
         m.transmission = 1;
       },
       [](S& s, const Texel& t) { material(s).transmission *= data(t, 0); }},
      {"thicknessTexture", &M::thickness_texture,
       [](M& m) {
         plain(m);
         m.transmission = 1;
         m.thickness = 1;
       },
       &change_nothing, kTexel, true},
      {"clearcoatTexture", &M::clearcoat_texture, &coated,
       [](S& s, const Texel& t) { material(s).clearcoat *= data(t, 0); }},
      {"clearcoatRoughnessTexture", &M::clearcoat_roughness_texture, &coated,
       [](S& s, const Texel& t) { material(s).clearcoat_roughness *= data(t, 1); }},
      {"clearcoatNormalTexture", &M::clearcoat_normal_texture, &coated, &turn_vertex_normals,
       kNormal},
      {"sheenColorTexture", &M::sheen_color_texture,
       [](M& m) {
         plain(m);
         m.sheen_color = {1, 1, 1};
         m.sheen_roughness = 0.5F;
       },
       [](S& s, const Texel& t) { material(s).sheen_color *= color(t); }},
      {"sheenRoughnessTexture", &M::sheen_roughness_texture,
       [](M& m) {
         plain(m);
         m.sheen_color = {1, 1, 1};
         m.sheen_roughness = 1;
       },
       [](S& s, const Texel& t) { material(s).sheen_roughness *= data(t, 3); }},
      {"iridescenceTexture", &M::iridescence_texture, &with_film,
       [](S& s, const Texel& t) { material(s).iridescence *= data(t, 0); }},
      {"iridescenceThicknessTexture", &M::iridescence_thickness_texture, &with_film,
       [](S& s, const Texel& t) {
         material(s).iridescence_thickness_max_nm = 150 + 400 * data(t, 1);
       }},
      {"anisotropyTexture", &M::anisotropy_texture,
       [](M& m) {
         metal(m);
         m.anisotropy = 1;
         m.anisotropy_rotation_rad = 0.5F;
       },
       [](S& s, const Texel& t) {
         material(s).anisotropy *= data(t, 2);
         material(s).anisotropy_rotation_rad += std::atan2(2 * data(t, 1) - 1, 2 * data(t, 0) - 1);
       }},
      {"diffuseTransmissionTexture", &M::diffuse_transmission_texture,
       [](M& m) {
         plain(m);
         m.diffuse_transmission = 1;
       },
       [](S& s, const Texel& t) { material(s).diffuse_transmission *= data(t, 3); }},
      {"diffuseTransmissionColorTexture", &M::diffuse_transmission_color_texture,
       [](M& m) {
         plain(m);
         m.diffuse_transmission = 1;
       },
       [](S& s, const Texel& t) { material(s).diffuse_transmission_color *= color(t); }},
  };
}

SceneDescription stage_of(const Row& row) {
  MaterialDescription m;
  row.prepare(m);
  m.double_sided = true;
  return test_support::stage(m);
}

/// The patch under a sun before it and, for what is transmitted, under one behind it.
std::array<Rgb, 2> shown(const SceneDescription& scene) {
  std::array<Rgb, 2> out;
  for (std::size_t i = 0; i < 2; ++i) {
    SceneDescription lit = scene;
    lit.lights.push_back(
        test_support::sun(test_support::towards(i == 0 ? 25 : 155, 50), {1, 1, 1}));
    out[i] = test_support::pixel(test_support::shoot_glb(lit, {}), 4, 4);
  }
  return out;
}

/// Largest difference of a channel, relative to the brighter value.
float difference(const std::array<Rgb, 2>& a, const std::array<Rgb, 2>& b) {
  float most = 0;
  for (std::size_t i = 0; i < 2; ++i) {
    for (int c = 0; c < 3; ++c) {
      const float bright = std::max(a[i][c], b[i][c]);
      most = std::max(most, bright > 1e-5F ? std::abs(a[i][c] - b[i][c]) / bright : 0);
    }
  }
  return most;
}

// A texel's 8 bits are exact in the factors; the rest is rounding of single precision.
TEST(GltfTextureSlots, ATextureCountsAsItsTexelInTheFactors) {
  for (const Row& row : rows()) {
    SceneDescription textured = stage_of(row);
    (material(textured).*row.texture).image = test_support::add_image(
        textured, 1, 1, 4, std::vector<int>(row.texel.begin(), row.texel.end()));
    const std::array<Rgb, 2> seen = shown(textured);
    SceneDescription by_factors = stage_of(row);
    row.apply(by_factors, row.texel);
    EXPECT_LT(difference(seen, shown(by_factors)), 1e-3F) << row.name;
  }
}

/// Cells of an image, a side.
constexpr int kCells = 4;
constexpr int kCellPx = 4;

/// An image with the texel in the cell of column and row 2, and its complement in all others.
int add_cells(SceneDescription& scene, const Texel& texel) {
  std::vector<int> values;
  for (int y = 0; y < kCells * kCellPx; ++y) {
    for (int x = 0; x < kCells * kCellPx; ++x) {
      const bool is_cell = x / kCellPx == 2 && y / kCellPx == 2;
      for (const int channel : texel) {
        values.push_back(is_cell ? channel : 255 - channel);
      }
    }
  }
  return test_support::add_image(scene, kCells * kCellPx, kCells * kCellPx, 4, values);
}

/// Texture coordinates within a hundredth around the centre of a cell, v downwards.
std::vector<core::Vec2> cell_uv(int column, int row) {
  const float u = (static_cast<float>(column) + 0.5F) / kCells;
  const float v = (static_cast<float>(row) + 0.5F) / kCells;
  return {{u - 0.01F, v + 0.01F},
          {u + 0.01F, v + 0.01F},
          {u + 0.01F, v - 0.01F},
          {u - 0.01F, v - 0.01F}};
}

/// Set 0 is in cell (0, 0), set 1 in (1, 0); u + 1/4 and 3 v + 1/4 take set 1 to (2, 2). Without
/// the set it would be (1, 2), without the offset (1, 1), without the scale (2, 1).
SceneDescription placed(const Row& row, int uv_set, const std::array<float, 6>& transform) {
  SceneDescription scene = stage_of(row);
  scene.meshes[0].primitives[0].uv = {cell_uv(0, 0), cell_uv(1, 0)};
  TextureDescription& texture = material(scene).*row.texture;
  texture.image = add_cells(scene, row.texel);
  texture.nearest = true;
  texture.uv_set = uv_set;
  texture.uv_transform = transform;
  return scene;
}
constexpr std::array<float, 6> kTransform = {1, 0, 0.25F, 0, 3, 0.25F};

TEST(GltfTextureSlots, EveryTextureIsReadFromItsSetThroughItsTransform) {
  for (const Row& row : rows()) {
    SceneDescription by_factors = stage_of(row);
    row.apply(by_factors, row.texel);
    EXPECT_LT(difference(shown(placed(row, 1, kTransform)), shown(by_factors)), 1e-3F) << row.name;
  }
}

// The test above could not tell a lost set, offset or scale if it looked the same.
TEST(GltfTextureSlots, ALostSetOrPartOfATransformIsSeen) {
  for (const Row& row : rows()) {
    if (row.is_known_unused) {
      continue;
    }
    const std::array<Rgb, 2> right = shown(placed(row, 1, kTransform));
    const auto seen = [&](int uv_set, const std::array<float, 6>& transform) {
      return difference(right, shown(placed(row, uv_set, transform)));
    };
    EXPECT_GT(seen(0, kTransform), 0.01F) << row.name << ": the set";
    EXPECT_GT(seen(1, {1, 0, 0.25F, 0, 1, 0.25F}), 0.01F) << row.name << ": the scale";
    EXPECT_GT(seen(1, {1, 0, 0, 0, 3, 0}), 0.01F) << row.name << ": the offset";
    EXPECT_GT(seen(1, {1, 0, 0, 0, 1, 0}), 0.01F) << row.name << ": the transform";
  }
}

// The test above could not tell a channel from another if exchanged ones looked the same.
TEST(GltfTextureSlots, AnyOtherOrderOfTheChannelsIsSeen) {
  for (const Row& row : rows()) {
    if (row.is_known_unused) {
      continue;
    }
    SceneDescription right = stage_of(row);
    row.apply(right, row.texel);
    for (std::size_t shift = 1; shift < 4; ++shift) {
      Texel turned;
      for (std::size_t c = 0; c < 4; ++c) {
        turned[c] = row.texel[(c + shift) % 4];
      }
      SceneDescription wrong = stage_of(row);
      row.apply(wrong, turned);
      EXPECT_GT(difference(shown(right), shown(wrong)), 0.01F) << row.name << " " << shift;
    }
  }
}

/// Adds the names of the textures of a schema.
void add_textures(std::string_view schema, std::set<std::string_view>& names) {
  const auto* members = core::find_schema(schema);
  ASSERT_NE(members, nullptr) << schema;
  for (const core::SchemaMember& member : *members) {
    if (member.child == "textureInfo" || member.child == "occlusionInfo") {
      names.insert(member.name);
    }
  }
}

TEST(GltfTextureSlots, EveryTextureOfTheSchemaHasARow) {
  std::set<std::string_view> names;
  add_textures("material", names);
  add_textures("pbr", names);
  for (const std::string_view extension : core::supported_extensions()) {
    const std::string schema = "material/" + std::string(extension);
    if (core::find_schema(schema) != nullptr) {
      add_textures(schema, names);
    }
  }
  std::set<std::string_view> tested;
  for (const Row& row : rows()) {
    EXPECT_TRUE(tested.insert(row.name).second) << row.name;
  }
  // Translated by the loader into the textures above; GltfMaterial.* test how.
  tested.insert({"diffuseTexture", "specularGlossinessTexture", "multiscatterColorTexture"});
  EXPECT_EQ(names, tested);
}

}  // namespace
