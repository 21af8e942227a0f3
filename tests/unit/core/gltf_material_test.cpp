#include <algorithm>
#include <span>

#include "core/image_io/image_io.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::MaterialDescription;
using core::Rgb;

MaterialDescription material_of(const std::string& members) {
  const auto scene = load_material(members);
  if (!scene) {
    ADD_FAILURE() << scene.error().where << ": " << scene.error().message;
    return {};
  }
  return scene->materials.at(0);
}

MaterialDescription extended(const std::string& name, const std::string& members) {
  return material_of("\"extensions\":{\"" + name + "\":{" + members + "}}");
}

// A PNG of one pixel, with colour and alpha as stored in the file.
core::Bytes pixel_png(float r, float g, float b, float a) {
  core::EncodeOptions options;
  options.is_color = false;
  return *core::encode_image({1, 1, {"R", "G", "B", "A"}, {r * a, g * a, b * a, a}},
                             core::image_formats()[0], options);
}

int add_image(core::GlbWriter& writer, const core::Bytes& png) {
  return writer.add(
      "images", "{\"mimeType\":\"image/png\",\"bufferView\":" + number(writer.add_view(png)) + "}");
}

TEST(GltfMaterial, WarnsOfTexturesWithOtherPrimariesThanThoseOfRec709) {
  const std::string hdr =
      "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\nPRIMARIES=.708 .292 .17 .797 .131 .046 .3127 .329\n\n"
      "-Y 1 +X 1\n\x80\x80\x80\x81";
  const auto bytes = std::as_bytes(std::span(hdr.data(), hdr.size()));
  core::GlbWriter writer;
  add_image(writer, core::Bytes(bytes.begin(), bytes.end()));
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})");
  add_triangle(writer, "\"material\":0");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  const auto is_it = [](const core::Warning& warning) { return warning.code == "primaries"; };
  EXPECT_EQ(std::count_if(scene->warnings.begin(), scene->warnings.end(), is_it), 1);
}

// Decoders fill what is missing of a JPEG with grey, without an error.
TEST(GltfMaterial, TellsThatAJpegIsCut) {
  const core::FloatImage grey = {8, 8, {"R", "G", "B"}, std::vector<float>(8 * 8 * 3, 0.25F)};
  const auto whole = core::encode_image(grey, core::image_formats()[1], {});
  ASSERT_TRUE(whole);
  for (const int missing : {0, 2, 8}) {
    core::GlbWriter writer;
    const int view = writer.add_view(core::Bytes(whole->begin(), whole->end() - missing));
    writer.add("images", R"({"mimeType":"image/jpeg","bufferView":)" + number(view) + "}");
    writer.add("textures", R"({"source":0})");
    writer.add("materials", R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})");
    add_mapped_triangle(writer, "\"material\":0");
    const auto scene = load(writer);
    ASSERT_TRUE(scene) << scene.error().message;
    ASSERT_EQ(scene->warnings.size(), missing == 0 ? 0U : 1U);
    if (missing > 0) {
      EXPECT_EQ(scene->warnings[0].code, "image_cut");
      EXPECT_EQ(scene->warnings[0].pointer, "/images/0");
    }
  }
}

/// A triangle with TEXCOORD_0, twice, whose material has a texture or more.
core::Bytes mapped_triangles(const std::string& material) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 1, 1, 1));
  writer.add("textures", R"({"source":0})");
  writer.add("materials", "{\"name\":\"paint\"," + material + "}");
  add_mapped_triangle(writer, R"("material":0,"targets":[{"POSITION":0}])");
  writer.add("nodes", R"({"mesh":0,"weights":[1]})");
  return writer.finish();
}

TEST(GltfMaterial, TellsWhichTextureCoordinatesAreMissing) {
  struct Case {
    std::string material;
    std::string expected;  ///< the first missing attribute
  };
  const std::vector<Case> cases = {
      {R"("normalTexture":{"index":0,"texCoord":1})", "TEXCOORD_1"},
      {R"("normalTexture":{"index":0},"emissiveTexture":{"index":0,"texCoord":3})", "TEXCOORD_3"},
      {R"("normalTexture":{"index":0,"extensions":{"KHR_texture_transform":{"texCoord":1}}})",
       "TEXCOORD_1"},
      {R"("extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":1,)"
       R"("clearcoatTexture":{"index":0,"texCoord":1}}})",
       "TEXCOORD_1"},
      {R"("normalTexture":{"index":0})", ""},
      {R"("occlusionTexture":{"index":0,"texCoord":1})", ""},
      {R"("extensions":{"KHR_materials_volume":{"thicknessFactor":1,)"
       R"("thicknessTexture":{"index":0,"texCoord":1}}})",
       ""},
      {R"("extensions":{"KHR_materials_clearcoat":{"clearcoatTexture":{"index":0,"texCoord":1}}})",
       ""},
      {R"("normalTexture":{"index":0,"texCoord":1},"extensions":{"KHR_materials_unlit":{}})", ""}};
  for (const Case& c : cases) {
    const core::Bytes file = mapped_triangles(c.material);
    const auto scene = load(file);
    ASSERT_TRUE(scene) << scene.error().message;
    const auto strict = load(file, strictly());
    if (c.expected.empty()) {
      EXPECT_TRUE(scene->warnings.empty()) << c.material;
      EXPECT_TRUE(strict) << c.material;
      continue;
    }
    ASSERT_EQ(scene->warnings.size(), 1U) << c.material;
    const core::Warning& warning = scene->warnings[0];
    const std::string fault =
        "there is no " + c.expected + ", which textures of material 0 ('paint') need";
    EXPECT_EQ(warning.code, "missing");
    EXPECT_EQ(warning.pointer, "/meshes/0/primitives/0/attributes");
    EXPECT_EQ(warning.detail, fault +
                                  "; its coordinates are (0, 0), so that one texel of each counts "
                                  "everywhere");
    expect_error_at(strict, "/meshes/0/primitives/0/attributes");
  }
}

TEST(GltfMaterial, EmptyMaterialHasTheDefaultsOfTheSpecification) {
  const MaterialDescription m = material_of("");
  EXPECT_EQ(m.base_color, Rgb(1));
  EXPECT_EQ(m.metallic, 1);
  EXPECT_EQ(m.roughness, 1);
  EXPECT_EQ(m.emissive, Rgb(0));
  EXPECT_EQ(m.alpha_mode, core::AlphaMode::kOpaque);
  EXPECT_EQ(m.alpha_cutoff, 0.5F);
  EXPECT_FALSE(m.double_sided);
  EXPECT_EQ(m.ior, 1.5F);
  EXPECT_EQ(m.specular, 1);
}

TEST(GltfMaterial, ReadsCoreFactors) {
  const MaterialDescription m = material_of(
      R"("pbrMetallicRoughness":{"baseColorFactor":[0.1,0.2,0.3,0.4],"metallicFactor":0.5,)"
      R"("roughnessFactor":0.6},)"
      R"("emissiveFactor":[0.7,0.8,0.9],"alphaMode":"MASK","alphaCutoff":0.25,"doubleSided":true)");
  EXPECT_EQ(m.base_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(m.base_alpha, 0.4F);
  EXPECT_EQ(m.metallic, 0.5F);
  EXPECT_EQ(m.roughness, 0.6F);
  EXPECT_EQ(m.emissive, (Rgb{0.7F, 0.8F, 0.9F}));
  EXPECT_EQ(m.alpha_mode, core::AlphaMode::kMask);
  EXPECT_EQ(m.alpha_cutoff, 0.25F);
  EXPECT_TRUE(m.double_sided);
}

TEST(GltfMaterial, EmissiveStrengthMultiplies) {
  const auto scene =
      load_material(R"("emissiveFactor":[1,0.5,0],)"
                    R"("extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":8}})");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->materials[0].emissive, (Rgb{8, 4, 0}));
  EXPECT_TRUE(scene->has_emissive_strength);
}

TEST(GltfMaterial, EmissiveStrengthOf1CountsAsNone) {
  const auto scene =
      load_material(R"("emissiveFactor":[1,1,1],)"
                    R"("extensions":{"KHR_materials_emissive_strength":{"emissiveStrength":1}})");
  ASSERT_TRUE(scene);
  EXPECT_FALSE(scene->has_emissive_strength);
}

TEST(GltfMaterial, ReadsUnlit) { EXPECT_TRUE(extended("KHR_materials_unlit", "").unlit); }

TEST(GltfMaterial, IorOf0MeansInfinitelyReflective) {
  EXPECT_EQ(extended("KHR_materials_ior", R"("ior":0)").ior, 0);
}

TEST(GltfMaterial, ReadsSpecular) {
  const MaterialDescription m =
      extended("KHR_materials_specular", R"("specularFactor":0.5,"specularColorFactor":[1,2,3])");
  EXPECT_EQ(m.specular, 0.5F);
  EXPECT_EQ(m.specular_color, (Rgb{1, 2, 3}));
}

TEST(GltfMaterial, ReadsTransmissionAndVolume) {
  const MaterialDescription m =
      material_of(R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":0.75},)"
                  R"("KHR_materials_volume":{"thicknessFactor":2,)"
                  R"("attenuationDistance":0.5,"attenuationColor":[0.25,0.5,1]},)"
                  R"("KHR_materials_dispersion":{"dispersion":0.2}})");
  EXPECT_EQ(m.transmission, 0.75F);
  EXPECT_EQ(m.thickness, 2);
  EXPECT_EQ(m.attenuation_distance, 0.5F);
  EXPECT_EQ(m.attenuation_color, (Rgb{0.25F, 0.5F, 1}));
  EXPECT_EQ(m.dispersion, 0.2F);
}

TEST(GltfMaterial, ReadsScatteringMedia) {
  const char* volume = R"("KHR_materials_transmission":{"transmissionFactor":1},)"
                       R"("KHR_materials_volume":{"thicknessFactor":2,"attenuationDistance":0.5,)"
                       R"("attenuationColor":[0.25,0.5,1]})";
  const auto with = [volume](const std::string& extension) {
    std::string text = R"("extensions":{)";
    text.append(volume).append(",").append(extension).append("}");
    return material_of(text.c_str());
  };
  const MaterialDescription old = with(
      R"("KHR_materials_volume_scatter":{"multiscatterColor":[0.1,0.2,0.3],"scatterAnisotropy":0.5})");
  EXPECT_EQ(old.multiscatter_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(old.scatter_anisotropy, 0.5F);
  const MaterialDescription renamed =
      with(R"("KHR_materials_volume_scatter":{"multiscatterColorFactor":[0.1,0.2,0.3]})");
  EXPECT_EQ(renamed.multiscatter_color, (Rgb{0.1F, 0.2F, 0.3F}));
  const MaterialDescription newer =
      with(R"("KHR_materials_scatter":{"multiscatterColorFactor":[0.2,0.4,0.8],)"
           R"("scatterStrengthFactor":0.5,"scatterAnisotropy":-0.25})");
  EXPECT_EQ(newer.multiscatter_color, (Rgb{0.1F, 0.2F, 0.4F}));
  EXPECT_EQ(newer.scatter_anisotropy, -0.25F);
  EXPECT_EQ(newer.transmission, 1);
  EXPECT_EQ(newer.diffuse_transmission, 0);
}

// The scattered fraction of the transmitted light leaves diffusely.
TEST(GltfMaterial, WarnsAboutATextureOfAMedium) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 1, 1, 1));
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"extensions":{"KHR_materials_volume":{"thicknessFactor":2},)"
                          R"("KHR_materials_scatter":{"multiscatterColorTexture":{"index":0}}}})");
  add_triangle(writer, "\"material\":0");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->warnings.size(), 1U);
  EXPECT_NE(scene->warnings[0].detail.find("multiscatterColorTexture is ignored"),
            std::string::npos);
}

TEST(GltfMaterial, ScatteringOfThinWallsIsDiffuseTransmission) {
  const MaterialDescription m =
      material_of(R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":0.8},)"
                  R"("KHR_materials_scatter":{"multiscatterColorFactor":[0.2,0.4,0.8],)"
                  R"("scatterStrengthFactor":0.25}})");
  EXPECT_FLOAT_EQ(m.transmission, 0.6F);
  EXPECT_FLOAT_EQ(m.diffuse_transmission * (1 - m.transmission), 0.2F);
  EXPECT_EQ(m.diffuse_transmission_color, (Rgb{0.2F, 0.4F, 0.8F}));
  EXPECT_EQ(m.multiscatter_color, (Rgb{0, 0, 0}));
}

TEST(GltfMaterial, ReadsClearcoat) {
  const MaterialDescription m = extended(
      "KHR_materials_clearcoat", R"("clearcoatFactor":0.5,"clearcoatRoughnessFactor":0.25)");
  EXPECT_EQ(m.clearcoat, 0.5F);
  EXPECT_EQ(m.clearcoat_roughness, 0.25F);
}

TEST(GltfMaterial, ReadsSheen) {
  const MaterialDescription m = extended(
      "KHR_materials_sheen", R"("sheenColorFactor":[0.1,0.2,0.3],"sheenRoughnessFactor":0.4)");
  EXPECT_EQ(m.sheen_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(m.sheen_roughness, 0.4F);
}

TEST(GltfMaterial, ReadsIridescence) {
  const MaterialDescription m =
      extended("KHR_materials_iridescence",
               R"("iridescenceFactor":1,"iridescenceIor":1.8,"iridescenceThicknessMinimum":200,)"
               R"("iridescenceThicknessMaximum":800)");
  EXPECT_EQ(m.iridescence, 1);
  EXPECT_EQ(m.iridescence_ior, 1.8F);
  EXPECT_EQ(m.iridescence_thickness_min_nm, 200);
  EXPECT_EQ(m.iridescence_thickness_max_nm, 800);
}

TEST(GltfMaterial, IridescenceDefaultsAreThoseOfTheExtension) {
  const MaterialDescription m = extended("KHR_materials_iridescence", "");
  EXPECT_EQ(m.iridescence, 0);
  EXPECT_EQ(m.iridescence_ior, 1.3F);
  EXPECT_EQ(m.iridescence_thickness_min_nm, 100);
  EXPECT_EQ(m.iridescence_thickness_max_nm, 400);
}

TEST(GltfMaterial, ReadsAnisotropy) {
  const MaterialDescription m =
      extended("KHR_materials_anisotropy", R"("anisotropyStrength":0.6,"anisotropyRotation":1.5)");
  EXPECT_EQ(m.anisotropy, 0.6F);
  EXPECT_EQ(m.anisotropy_rotation_rad, 1.5F);
}

TEST(GltfMaterial, ReadsDiffuseTransmission) {
  const MaterialDescription m =
      extended("KHR_materials_diffuse_transmission",
               R"("diffuseTransmissionFactor":0.5,"diffuseTransmissionColorFactor":[1,0.5,0])");
  EXPECT_EQ(m.diffuse_transmission, 0.5F);
  EXPECT_EQ(m.diffuse_transmission_color, (Rgb{1, 0.5F, 0}));
}

TEST(GltfMaterial, SpecularGlossinessBecomesADielectricOfInfiniteIor) {
  // KHR_materials_specular, "Interaction with other extensions": ior 0, unchanged specular colour,
  // roughness 1 - glossiness.
  const MaterialDescription m =
      extended("KHR_materials_pbrSpecularGlossiness",
               R"("diffuseFactor":[0.1,0.2,0.3,0.4],"specularFactor":[0.5,0.6,0.7],)"
               R"("glossinessFactor":0.75)");
  EXPECT_EQ(m.base_color, (Rgb{0.1F, 0.2F, 0.3F}));
  EXPECT_EQ(m.base_alpha, 0.4F);
  EXPECT_EQ(m.metallic, 0);
  EXPECT_EQ(m.ior, 0);
  EXPECT_EQ(m.specular_color, (Rgb{0.5F, 0.6F, 0.7F}));
  EXPECT_EQ(m.roughness, 0.25F);
}

TEST(GltfMaterial, GlossinessTextureBecomesARoughnessTexture) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 0.5F, 0.25F, 0.8F));
  writer.add("textures", R"({"source":0})");
  writer.add("materials",
             R"({"extensions":{"KHR_materials_pbrSpecularGlossiness":{"glossinessFactor":0.5,)"
             R"("specularGlossinessTexture":{"index":0}}}})");
  add_triangle(writer, "\"material\":0");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  const MaterialDescription& m = scene->materials[0];
  ASSERT_GE(m.metallic_roughness_texture.image, 0);
  const core::Image& image =
      *scene->images[static_cast<std::size_t>(m.metallic_roughness_texture.image)];
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(1)), 153);  // 1 - 0.5 * 0.8 = 0.6 of 255
  EXPECT_EQ(std::to_integer<int>(image.bytes.at(2)), 0);
}

TEST(GltfMaterial, ReadsAllTexturesOfAMaterial) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 1, 1, 1));
  writer.add("textures", R"({"source":0})");
  writer.add("materials",
             R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0,"texCoord":1},)"
             R"("metallicRoughnessTexture":{"index":0}},)"
             R"("normalTexture":{"index":0,"scale":0.5},"occlusionTexture":{"index":0,)"
             R"("strength":0.25},"emissiveTexture":{"index":0}})");
  add_triangle(writer, "\"material\":0");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  const MaterialDescription& m = scene->materials[0];
  EXPECT_EQ(scene->images.size(), 1U);
  EXPECT_EQ(m.base_color_texture.image, 0);
  EXPECT_EQ(m.base_color_texture.uv_set, 1);
  EXPECT_EQ(m.metallic_roughness_texture.image, 0);
  EXPECT_EQ(m.normal_texture.image, 0);
  EXPECT_EQ(m.normal_scale, 0.5F);
  EXPECT_EQ(m.occlusion_strength, 0.25F);
  EXPECT_EQ(m.emissive_texture.image, 0);
}

/// A textured triangle with TEXCOORD_0 to _3, each shifted by its number, and textures on these
/// sets.
core::Result<core::SceneDescription> load_sets(int base, int emissive, int metal) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 1, 1, 1));
  writer.add("textures", R"({"source": 0})");
  const auto info = [](int set) {
    return R"({"index": 0, "texCoord": )" + std::to_string(set) + "}";
  };
  writer.add("materials", R"({"emissiveFactor": [1, 1, 1], "emissiveTexture": )" + info(emissive) +
                              R"(, "pbrMetallicRoughness": {"baseColorTexture": )" + info(base) +
                              R"(, "metallicRoughnessTexture": )" + info(metal) + "}}");
  std::string attributes =
      R"("POSITION": )" + number(accessor(writer, triangle_positions(), kF32, "VEC3", 3));
  for (int set = 0; set < 4; ++set) {
    const auto shift = static_cast<float>(set);
    attributes +=
        ", \"TEXCOORD_" + number(set) + "\": " +
        number(accessor(writer, std::vector<float>{shift, 0, shift, 1, shift, 2}, kF32, "VEC2", 2));
  }
  add_primitive(writer, "\"attributes\": {" + attributes + "}, \"material\": 0");
  return load(writer);
}

TEST(GltfMaterial, AcceptsAnyTwoTextureCoordinateSets) {
  const auto scene = load_sets(3, 2, 3);
  const core::PrimitiveDescription p = only_primitive(scene);
  const core::MaterialDescription& m = scene->materials[0];
  const auto first_u = [&p](const core::TextureDescription& t) {
    return p.uv[static_cast<std::size_t>(t.uv_set)][0].x;
  };
  EXPECT_EQ(first_u(m.base_color_texture), 3);
  EXPECT_EQ(first_u(m.metallic_roughness_texture), 3);
  EXPECT_EQ(first_u(m.emissive_texture), 2);
}

TEST(GltfMaterial, ReadsSamplers) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 1, 1, 1));
  writer.add("samplers", R"({"wrapS":33071,"wrapT":33648,"magFilter":9728})");
  writer.add("textures", R"({"source":0,"sampler":0})");
  writer.add("materials", R"({"emissiveTexture":{"index":0}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  const core::TextureDescription& t = scene->materials[0].emissive_texture;
  EXPECT_EQ(t.wrap_u, core::TextureWrap::kClampToEdge);
  EXPECT_EQ(t.wrap_v, core::TextureWrap::kMirroredRepeat);
  EXPECT_TRUE(t.nearest);
}

TEST(GltfMaterial, TextureTransformRotatesCounterClockwise) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 1, 1, 1));
  writer.add("textures", R"({"source":0})");
  writer.add(
      "materials",
      R"({"emissiveTexture":{"index":0,"extensions":{"KHR_texture_transform":)"
      R"({"offset":[0.125,0.25],"rotation":0.39269908169872414,"scale":[1,1],"texCoord":1}}}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  const core::TextureDescription& t = scene->materials[0].emissive_texture;
  // Khronos' TextureTransformTest: the arrow's tip, at uv (0.7778, 0.7778) of the image, appears at
  // uv (0.42095, 1.01627) of the surface, where the green marker is.
  const auto& m = t.uv_transform;
  EXPECT_NEAR(m[0] * 0.42095F + m[1] * 1.01627F + m[2], 0.7778F + 0.125F, 1e-4);
  EXPECT_NEAR(m[3] * 0.42095F + m[4] * 1.01627F + m[5], 0.7778F + 0.25F, 1e-4);
  EXPECT_EQ(t.uv_set, 1);
}

TEST(GltfMaterial, SharedImageIsDecodedOnce) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 0, 0, 1));
  writer.add("textures", R"({"source":0})");
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"emissiveTexture":{"index":0}})");
  writer.add("materials", R"({"emissiveTexture":{"index":1}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->images.size(), 1U);
}

TEST(GltfMaterial, PixelsKeepTheirBytes) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(0.2F, 0.4F, 0.6F, 0.8F));
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"emissiveTexture":{"index":0}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->images[0]->bytes.size(), 4U);
  EXPECT_EQ(std::to_integer<int>(scene->images[0]->bytes[0]), 51);
  EXPECT_EQ(std::to_integer<int>(scene->images[0]->bytes[2]), 153);
  EXPECT_EQ(std::to_integer<int>(scene->images[0]->bytes[3]), 204);
}

TEST(GltfMaterial, WebpReplacesTheFallback) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 0, 0, 1));
  add_image(writer, pixel_png(0, 1, 0, 1));
  writer.use_extension("EXT_texture_webp");
  writer.add("textures", R"({"source":0,"extensions":{"EXT_texture_webp":{"source":1}}})");
  writer.add("materials", R"({"emissiveTexture":{"index":0}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->images.size(), 1U);
  EXPECT_EQ(std::to_integer<int>(scene->images[0]->bytes[1]), 255);
}

TEST(GltfMaterial, BasisuReplacesTheFallback) {
  core::GlbWriter writer;
  add_image(writer, pixel_png(1, 0, 0, 1));
  add_image(writer, pixel_png(0, 1, 0, 1));
  writer.use_extension("KHR_texture_basisu");
  writer.add("textures", R"({"source":0,"extensions":{"KHR_texture_basisu":{"source":1}}})");
  writer.add("materials", R"({"emissiveTexture":{"index":0}})");
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_EQ(std::to_integer<int>(scene->images.at(0)->bytes[1]), 255);
}

core::Bytes with_variants() {
  core::GlbWriter writer;
  writer.use_extension("KHR_materials_variants");
  writer.set("extensions",
             R"({"KHR_materials_variants":{"variants":[{"name":"red"},{"name":"blue"}]}})");
  writer.add("materials", "{}");
  writer.add("materials", "{}");
  add_triangle(writer,
               R"("material":0,"extensions":{"KHR_materials_variants":{"mappings":[{"material":1,)"
               R"("variants":[1]}]}})");
  return writer.finish();
}

TEST(GltfVariants, ListsNames) {
  const auto scene = load(with_variants());
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->variants, (std::vector<std::string>{"red", "blue"}));
}

TEST(GltfVariants, SelectedVariantReplacesTheMaterial) {
  core::GltfOptions options;
  options.variant = "blue";
  EXPECT_EQ(only_primitive(load(with_variants(), options)).material, 1);
}

TEST(GltfVariants, VariantWithoutAMappingKeepsTheMaterial) {
  core::GltfOptions options;
  options.variant = "red";
  EXPECT_EQ(only_primitive(load(with_variants(), options)).material, 0);
}

TEST(GlbWriter, MaterialSurvivesWritingAndReading) {
  core::SceneDescription scene;
  MaterialDescription m;
  m.name = "all";
  m.base_color = {0.1F, 0.2F, 0.3F};
  m.emissive = {3, 6, 1.5F};
  m.ior = 1.25F;
  m.specular = 0.5F;
  m.transmission = 0.5F;
  m.thickness = 0.25F;
  m.attenuation_distance = 2;
  m.attenuation_color = {0.5F, 0.25F, 1};
  m.clearcoat = 0.5F;
  m.sheen_color = {0.25F, 0.5F, 0.75F};
  m.iridescence = 0.5F;
  m.anisotropy = 0.5F;
  m.dispersion = 0.5F;
  m.diffuse_transmission = 0.5F;
  scene.materials.push_back(m);
  const auto read = load(core::write_glb(scene));
  ASSERT_TRUE(read) << read.error().message;
  const MaterialDescription& r = read->materials.at(0);
  EXPECT_EQ(r.name, "all");
  EXPECT_EQ(r.base_color, m.base_color);
  EXPECT_EQ(r.emissive, m.emissive);
  EXPECT_EQ(r.ior, m.ior);
  EXPECT_EQ(r.specular, m.specular);
  EXPECT_EQ(r.transmission, m.transmission);
  EXPECT_EQ(r.thickness, m.thickness);
  EXPECT_EQ(r.attenuation_distance, m.attenuation_distance);
  EXPECT_EQ(r.attenuation_color, m.attenuation_color);
  EXPECT_EQ(r.clearcoat, m.clearcoat);
  EXPECT_EQ(r.sheen_color, m.sheen_color);
  EXPECT_EQ(r.iridescence, m.iridescence);
  EXPECT_EQ(r.anisotropy, m.anisotropy);
  EXPECT_EQ(r.dispersion, m.dispersion);
  EXPECT_EQ(r.diffuse_transmission, m.diffuse_transmission);
}

TEST(GltfMaterial, ReadsThePriorityOfSolids) {
  const auto with = [](const std::string& extras) {
    return load_material(R"("extensions":{"KHR_materials_transmission":{"transmissionFactor":1},)"
                         R"("KHR_materials_volume":{"thicknessFactor":1}},"extras":)" +
                         extras);
  };
  const auto scene = with(R"({"priority":-7})");
  ASSERT_TRUE(scene) << scene.error().message;
  EXPECT_EQ(scene->materials[0].priority, -7);
  EXPECT_TRUE(scene->warnings.empty());
  const auto again = load(core::write_glb(*scene));
  ASSERT_TRUE(again) << again.error().message;
  EXPECT_EQ(again->materials[0].priority, -7);
  for (const char* wrong :
       {R"({"priority":1.5})", R"({"priority":"high"})", R"({"priority":1e9})"}) {
    const auto ignored = with(wrong);
    ASSERT_TRUE(ignored) << wrong;
    EXPECT_EQ(ignored->materials[0].priority, 0) << wrong;
    ASSERT_EQ(ignored->warnings.size(), 1U) << wrong;
    EXPECT_NE(ignored->warnings[0].detail.find("extras.priority"), std::string::npos);
  }
  const auto thin = load_material(R"("extras":{"priority":3})");
  ASSERT_TRUE(thin);
  EXPECT_EQ(thin->warnings.size(), 1U) << "no volume";
}

}  // namespace
