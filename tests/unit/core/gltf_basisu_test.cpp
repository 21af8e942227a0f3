// KHR_texture_basisu: the image that a texture reads, and errors of broken ones.
#include "tests/support/read_bytes.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

core::Bytes ktx2_file(const char* name) {
  return test_support::read_bytes(std::string(TESSERA_SOURCE_DIR "/tests/ktx2/") + name);
}

/// A triangle with this texture as base colour.
void add_textured(core::GlbWriter& writer, const std::string& texture) {
  writer.add("textures", texture);
  writer.add("materials", R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})");
  add_mapped_triangle(writer, "\"material\":0");
}

TEST(GltfBasisu, ReadsTheTexture) {
  core::GlbWriter writer;
  const int view = writer.add_view(ktx2_file("etc1s.ktx2"));
  writer.add("images", R"({"mimeType":"image/ktx2","bufferView":)" + number(view) + "}");
  add_textured(writer, R"({"extensions":{"KHR_texture_basisu":{"source":0}}})");
  writer.set("extensionsRequired", R"(["KHR_texture_basisu"])");
  const auto scene = load(writer);
  ASSERT_TRUE(scene) << scene.error().where << ": " << scene.error().message;
  EXPECT_TRUE(scene->warnings.empty());
  ASSERT_EQ(scene->images.size(), 1U);
  EXPECT_EQ(scene->images[0]->width, 36);
  EXPECT_EQ(scene->materials[0].base_color_texture.image, 0);
}

// The image of the extension takes precedence; the plain one is read if that file is missing.
TEST(GltfBasisu, FallsBackToThePlainImage) {
  const core::Bytes ktx2 = ktx2_file("uastc_zstd.ktx2");
  const auto resolve = [&](bool has_both) {
    return [&ktx2, has_both](std::string_view uri) {
      return uri == "b.ktx2" && !has_both ? core::SharedBytes()
                                          : std::make_shared<const core::Bytes>(ktx2);
    };
  };
  core::GlbWriter writer;
  writer.add("images", R"({"uri":"a.png"})");
  writer.add("images", R"({"uri":"b.ktx2"})");
  add_textured(writer, R"({"source":0,"extensions":{"KHR_texture_basisu":{"source":1}}})");
  const core::Bytes file = writer.finish();
  std::vector<std::string> asked;
  for (const bool has_both : {true, false}) {
    const auto scene = core::load_gltf(file,
                                       [&](std::string_view uri) {
                                         asked.emplace_back(uri);
                                         return resolve(has_both)(uri);
                                       },
                                       {});
    ASSERT_TRUE(scene) << scene.error().message;
    EXPECT_EQ(scene->images.size(), 1U);
    EXPECT_EQ(asked.back(), has_both ? "b.ktx2" : "a.png");
  }
}

TEST(GltfBasisu, RefusesABrokenImageWithItsPath) {
  core::GlbWriter writer;
  core::Bytes file = ktx2_file("etc1s.ktx2");
  file.resize(file.size() / 2);
  writer.add("images",
             R"({"mimeType":"image/ktx2","bufferView":)" + number(writer.add_view(file)) + "}");
  add_textured(writer, R"({"extensions":{"KHR_texture_basisu":{"source":0}}})");
  expect_error_at(load(writer), "/images/0");
}

TEST(GltfBasisu, RefusesAMissingImage) {
  core::GlbWriter writer;
  add_textured(writer, R"({"extensions":{"KHR_texture_basisu":{"source":0}}})");
  expect_error_at(load(writer), "/textures/0/extensions/KHR_texture_basisu/source");
}

}  // namespace
