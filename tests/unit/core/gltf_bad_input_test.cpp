#include "core/scene_io/gltf_uri.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

const std::string kAsset = R"("asset":{"version":"2.0"})";

TEST(GltfBadInput, AssetIsRequired) { expect_error_at(load_json("{}"), ""); }

TEST(GltfBadInput, InputThatIsNeitherGlbNorJsonIsReportedWithoutItsBytes) {
  const auto said = [](std::string_view file) {
    const auto loaded = load_json(std::string(file));
    return loaded ? std::string("nothing") : loaded.error().message;
  };
  for (const std::string_view file :
       {std::string_view("\x93\xfe\x01 a [ { \" of noise"), std::string_view(""),
        std::string_view("  \n"), std::string_view("[]"), std::string_view("<html>")}) {
    EXPECT_EQ(
        said(file),
        "this is neither a GLB nor glTF JSON: the one begins with \"glTF\", the other with \"{\"");
  }
  EXPECT_EQ(said("\n {\"asset\": \xff\xfe"),
            "the glTF JSON cannot be read: it is not JSON from byte 12 (line 2, column 12) on");
  EXPECT_EQ(said("{"),
            "the glTF JSON cannot be read: it is not JSON from byte 1 (line 1, column 2) on");
  EXPECT_EQ(said("{\"a\": 1e999}"), "the glTF JSON cannot be read: a number is out of range");
}

TEST(GltfBadInput, SkipsAByteOrderMark) { EXPECT_TRUE(load_json("\xEF\xBB\xBF{" + kAsset + "}")); }

TEST(GltfBadInput, Version1IsRefused) {
  expect_error_at(load_json(R"({"asset":{"version":"1.0"}})"), "/asset/version");
}

TEST(GltfBadInput, HigherMinimumVersionIsRefused) {
  expect_error_at(load_json(R"({"asset":{"version":"2.1","minVersion":"2.1"}})"),
                  "/asset/minVersion");
}

TEST(GltfBadInput, UnknownRequiredExtensionIsReportedWithItsPath) {
  const auto scene =
      load_json("{" + kAsset + R"(,"extensionsRequired":["KHR_materials_ior","FOO_bar"]})");
  expect_error_at(scene, "/extensionsRequired/1");
  EXPECT_EQ(scene.error().message,
            "the file requires the extension \"FOO_bar\", which is not supported");
}

TEST(GltfBadInput, UnknownUsedExtensionIsAWarning) {
  const auto scene = load_json("{" + kAsset + R"(,"extensionsUsed":["FOO_bar"]})");
  ASSERT_TRUE(scene);
  ASSERT_EQ(scene->warnings.size(), 1U);
  EXPECT_EQ(scene->warnings[0].text(),
            "/extensionsUsed/0: extension \"FOO_bar\" is used by the file and was ignored");
}

// A hint for graphics cards; gltf-validator warns about values outside its list.
TEST(GltfBadInput, IgnoresTargetOfAView) {
  core::GlbWriter writer;
  const std::vector<float> data(16, 0.0F);
  writer.add_view(bytes(data), R"({"target":-1})");
  add_triangle(writer);
  const auto scene = load(writer);
  EXPECT_TRUE(scene) << scene.error().message;
}

TEST(GltfBadInput, ViewBeyondItsBufferIsRefused) {
  core::GlbWriter writer;
  const std::vector<float> data(16, 0.0F);
  writer.add_view(bytes(data), R"({"byteLength":9999})");
  expect_error_at(load_strictly(writer), "/bufferViews/0");
}

TEST(GltfBadInput, ViewWhoseEndOverflowsIsRefused) {
  core::GlbWriter writer;
  const std::vector<float> data(16, 0.0F);
  writer.add_view(bytes(data), R"({"byteOffset":9007199254740991})");
  expect_error_at(load_strictly(writer), "/bufferViews/0");
}

TEST(GltfBadInput, NegativeOffsetIsRefused) {
  core::GlbWriter writer;
  const std::vector<float> data(16, 0.0F);
  writer.add_view(bytes(data), R"({"byteOffset":-4})");
  expect_error_at(load_strictly(writer), "/bufferViews/0/byteOffset");
}

TEST(GltfBadInput, AccessorBeyondItsViewIsRefused) {
  core::GlbWriter writer;
  writer.add_accessor(bytes(triangle_positions()), kF32, "VEC3", 4);
  expect_error_at(load_strictly(writer), "/accessors/0");
}

TEST(GltfBadInput, HugeCountIsRefused) {
  core::GlbWriter writer;
  writer.add_accessor(bytes(triangle_positions()), kF32, "VEC3", 1'000'000'000'000'000);
  expect_error_at(load_strictly(writer), "/accessors/0");
}

TEST(GltfBadInput, HugeAccessorOfZerosIsTooLarge) {
  const auto scene = load_json_strictly(
      "{" + kAsset +
      R"(,"accessors":[{"componentType":5126,"type":"VEC3","count":4503599627370496}],)"
      R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"nodes":[{"mesh":0}]})");
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, core::ErrorCode::kTooLarge);
}

TEST(GltfBadInput, IndexBeyondTheVerticesIsRefused) {
  core::GlbWriter writer;
  const int indices = accessor(writer, std::vector<std::uint16_t>{0, 1, 3}, kU16, "SCALAR", 1);
  add_triangle(writer, "\"indices\":" + number(indices));
  const auto scene = load_strictly(writer);
  expect_error_at(scene, "/meshes/0/primitives/0/indices");
  EXPECT_EQ(scene.error().message, "index 3 at place 2 is not below the 3 vertices");
}

TEST(GltfBadInput, SignedIndicesAreRefused) {
  core::GlbWriter writer;
  const int indices = accessor(writer, std::vector<std::int16_t>{0, 1, 2}, kI16, "SCALAR", 1);
  add_triangle(writer, "\"indices\":" + number(indices));
  expect_error_at(load_strictly(writer), "/meshes/0/primitives/0/indices");
}

TEST(GltfBadInput, AttributeWithOtherCountIsRefused) {
  core::GlbWriter writer;
  const int normals = accessor(writer, std::vector<float>{0, 0, 1, 0, 0, 1}, kF32, "VEC3", 3);
  const int positions = accessor(writer, triangle_positions(), kF32, "VEC3", 3);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(positions) +
                            ",\"NORMAL\":" + number(normals) + "}");
  expect_error_at(load_strictly(writer), "/meshes/0/primitives/0/attributes/NORMAL");
}

TEST(GltfBadInput, NotANumberInPositionsIsRefused) {
  core::GlbWriter writer;
  std::vector<float> positions = triangle_positions();
  positions[4] = std::numeric_limits<float>::quiet_NaN();
  const int a = accessor(writer, positions, kF32, "VEC3", 3);
  add_primitive(writer, "\"attributes\":{\"POSITION\":" + number(a) + "}");
  expect_error_at(load_strictly(writer), "/meshes/0/primitives/0/attributes/POSITION");
}

TEST(GltfBadInput, MissingMaterialIsReported) {
  core::GlbWriter writer;
  add_triangle(writer, "\"material\":7");
  const auto scene = load_strictly(writer);
  expect_error_at(scene, "/meshes/0/primitives/0/material");
  EXPECT_EQ(scene.error().message, "7 names none of the 0 materials");
}

TEST(GltfBadInput, FactorOutsideItsRangeIsRefused) {
  const auto scene = load_material_strictly(R"("pbrMetallicRoughness":{"metallicFactor":1.5})");
  expect_error_at(scene, "/materials/0/pbrMetallicRoughness/metallicFactor");
  EXPECT_EQ(scene.error().message, "1.5 is outside [0, 1]");
}

TEST(GltfBadInput, WrongTypeIsRefused) {
  expect_error_at(load_material_strictly(R"("alphaMode":3)"), "/materials/0/alphaMode");
}

TEST(GltfBadInput, UnknownEnumeratorIsRefused) {
  expect_error_at(load_material_strictly(R"("alphaMode":"GLOW")"), "/materials/0/alphaMode");
}

TEST(GltfBadInput, ShortColorIsRefused) {
  expect_error_at(load_material_strictly(R"("pbrMetallicRoughness":{"baseColorFactor":[1,1,1]})"),
                  "/materials/0/pbrMetallicRoughness/baseColorFactor");
}

TEST(GltfBadInput, ExtensionMembersAreChecked) {
  expect_error_at(
      load_material_strictly(R"("extensions":{"KHR_materials_clearcoat":{"clearcoatFactor":2}})"),
      "/materials/0/extensions/KHR_materials_clearcoat/clearcoatFactor");
}

TEST(GltfBadInput, IorBetween0And1IsRefused) {
  expect_error_at(load_material_strictly(R"("extensions":{"KHR_materials_ior":{"ior":0.5}})"),
                  "/materials/0/extensions/KHR_materials_ior/ior");
}

TEST(GltfBadInput, CycleOfNodesIsRefused) {
  expect_error_at(
      load_json_strictly("{" + kAsset + R"(,"nodes":[{"children":[1]},{"children":[0]}]})"),
      "/nodes/0");
}

TEST(GltfBadInput, NodeAsItsOwnChildIsRefused) {
  expect_error_at(load_json_strictly("{" + kAsset + R"(,"nodes":[{"children":[0]}]})"), "/nodes/0");
}

TEST(GltfBadInput, TwoParentsAreRefused) {
  expect_error_at(
      load_json_strictly("{" + kAsset + R"(,"nodes":[{"children":[2]},{"children":[2]},{}]})"),
      "/nodes/1/children/0");
}

TEST(GltfBadInput, MatrixWithTranslationRotationOrScaleIsRefused) {
  expect_error_at(
      load_json_strictly(
          "{" + kAsset +
          R"(,"nodes":[{"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1],"scale":[1,1,1]}]})"),
      "/nodes/0");
}

TEST(GltfBadInput, TransformThatOverflowsIsRefused) {
  expect_error_at(
      load_json_strictly("{" + kAsset +
                         R"(,"nodes":[{"scale":[1e30,1,1],"children":[1]},{"scale":[1e30,1,1]}]})"),
      "/nodes/1");
}

TEST(GltfBadInput, ReadsAnyDepthOfNodes) {
  core::GlbWriter writer;
  constexpr int kDepth = 100'000;
  for (int i = 0; i < kDepth; ++i) {
    writer.add("nodes", "{\"children\":[" + number(i + 1) + "]}");
  }
  add_triangle(writer);
  const auto scene = load(writer);
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->instances.size(), 1U);
}

TEST(GltfBadInput, ListsAllMissingFiles) {
  const auto scene = load_json_strictly(
      "{" + kAsset +
      R"(,"buffers":[{"uri":"a%20b.bin","byteLength":4},{"uri":"c.bin","byteLength":4}]})");
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, core::ErrorCode::kMissingFiles);
  EXPECT_EQ(scene.error().message, "files that the scene refers to are missing: a b.bin, c.bin");
}

TEST(GltfBadInput, AbsoluteUriIsRefused) {
  expect_error_at(
      load_json_strictly("{" + kAsset +
                         R"(,"buffers":[{"uri":"file:///etc/passwd","byteLength":4}]})"),
      "/buffers/0/uri");
}

TEST(GltfBadInput, TruncatedExternalFileIsRefused) {
  const auto resolve = [](std::string_view) {
    return std::make_shared<const core::Bytes>(core::Bytes(3));
  };
  expect_error_at(
      load_json_strictly("{" + kAsset + R"(,"buffers":[{"uri":"a.bin","byteLength":4}]})", resolve),
      "/buffers/0/byteLength");
}

TEST(GltfBadInput, BrokenBase64IsRefused) {
  expect_error_at(
      load_json_strictly(
          "{" + kAsset +
          R"(,"buffers":[{"uri":"data:application/octet-stream;base64,AB!=","byteLength":1}]})"),
      "/buffers/0/uri");
}

TEST(GltfBadInput, BrokenImageIsRefusedAtTheImage) {
  core::GlbWriter writer;
  const std::vector<float> rubbish(8, 1.0F);
  const int view = writer.add_view(bytes(rubbish));
  writer.add("images", "{\"mimeType\":\"image/png\",\"bufferView\":" + number(view) + "}");
  writer.add("textures", R"({"source":0})");
  writer.add("materials", R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})");
  add_triangle(writer, "\"material\":0");
  expect_error_at(load_strictly(writer), "/images/0");
}

TEST(GltfBadInput, TooManyTrianglesAreTooLarge) {
  core::GlbWriter writer;
  add_triangle(writer);
  core::GltfOptions options;
  options.limits.triangles_max = 0;
  const auto scene = load(writer, options);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, core::ErrorCode::kTooLarge);
}

TEST(GltfBadInput, TooManyInstancesAreTooLarge) {
  core::GlbWriter writer;
  add_triangle(writer);
  writer.add("nodes", R"({"mesh":0})");
  core::GltfOptions options;
  options.limits.instances_max = 1;
  const auto scene = load(writer, options);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, core::ErrorCode::kTooLarge);
}

TEST(GltfBadInput, UnknownVariantIsRefused) {
  core::GlbWriter writer;
  add_triangle(writer);
  core::GltfOptions options;
  options.variant = "red";
  expect_error_at(load(writer, options), "/variant");
}

TEST(GltfBadInput, AcceptsIntegersWrittenAsFloats) {
  const auto scene =
      load_json("{" + kAsset + R"(,"scene":0.0,"scenes":[{"nodes":[0.0]}],"nodes":[{}]})");
  EXPECT_TRUE(scene.has_value());
}

std::vector<std::string> files_of(const std::string& json, const std::string& there = "") {
  const auto files = core::gltf_files(std::as_bytes(std::span(json)),
                                      [&](std::string_view name) { return name == there; });
  EXPECT_TRUE(files.has_value()) << (files ? "" : files.error().message);
  return files ? *files : std::vector<std::string>();
}

/// Members by which a triangle's material uses all textures of a document, and buffer 0.
const std::string kUse =
    R"(,"bufferViews":[{"buffer":0,"byteLength":4}],"nodes":[{"mesh":0}],)"
    R"("accessors":[{"bufferView":0,"componentType":5121,"count":1,"type":"SCALAR"}],)"
    R"("meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0}]}],"materials":[)"
    R"({"normalTexture":{"index":0},"emissiveTexture":{"index":1},)"
    R"("pbrMetallicRoughness":{"baseColorTexture":{"index":2}}}])";

TEST(GltfFiles, AreListedOnceInOrderWithNamesDecodedOnce) {
  EXPECT_EQ(files_of("{" + kAsset + kUse +
                     R"(,"buffers":[{"uri":"b.bin","byteLength":4},)"
                     R"({"uri":"DATA:,abcd","byteLength":4}],)"
                     R"("textures":[{"source":0},{"source":1},{"source":2}],)"
                     R"("images":[{"uri":"a%20b.png"},{"uri":"b.bin"},{"uri":"a%2520b.png"}]})"),
            (std::vector<std::string>{"b.bin", "a b.png", "a%20b.png"}));
}

TEST(GltfFiles, AreOnlyThoseThatATextureUses) {
  EXPECT_EQ(files_of("{" + kAsset + R"(,"images":[{"uri":"gone.png"}]})"),
            std::vector<std::string>());
}

TEST(GltfFiles, PreferTheCompressedFormIfItIsThere) {
  const std::string json =
      "{" + kAsset +
      R"(,"extensionsUsed":["EXT_texture_webp"],"images":[{"uri":"a.png"},{"uri":"a.webp"}],)"
      R"("textures":[{"source":0,"extensions":{"EXT_texture_webp":{"source":1}}}],)"
      R"("materials":[{"normalTexture":{"index":0}}],"nodes":[{"mesh":0}],"accessors":[{)"
      R"("componentType":5126,"count":3,"type":"VEC3"}],"meshes":[{"primitives":[{)"
      R"("attributes":{"POSITION":0},"material":0}]}]})";
  EXPECT_EQ(files_of(json), std::vector<std::string>{"a.png"});
  EXPECT_EQ(files_of(json, "a.webp"), std::vector<std::string>{"a.webp"});
}

std::string text_of(const std::string& uri) {
  const auto bytes = core::decode_data_uri(uri);
  if (!bytes) {
    return "refused";
  }
  return {reinterpret_cast<const char*>(bytes->data()), bytes->size()};
}

// "Man" and ">>>?" are the examples of RFC 4648 and of its letters + and /.
TEST(DataUri, IsReadInEveryFormThatRfc2397Allows) {
  for (const char* uri :
       {"data:;base64,TWFu", "DATA:application/octet-stream;BASE64,TWFu",
        "data:application/gltf-buffer;charset=utf-8;base64,TWFu", "data:;base64;charset=utf-8,TWFu",
        "data:;base64,TW\r\nFu\n", "data:;base64,TWF%75", "data:,Man",
        "data:text/plain;charset=utf-8,M%61n"}) {
    EXPECT_EQ(text_of(uri), "Man") << uri;
  }
  for (const char* uri :
       {"data:;base64,Pj4+Pw==", "data:;base64,Pj4%2BPw%3D%3D", "data:;base64,Pj4-Pw"}) {
    EXPECT_EQ(text_of(uri), ">>>?") << uri;
  }
  EXPECT_EQ(text_of("data:;base64,Pz8/"), "???");
  EXPECT_EQ(text_of("data:;base64,Pz8%2F"), "???");
  EXPECT_EQ(text_of("data:;base64x,TWFu"), "TWFu");  // another parameter
}

TEST(DataUri, RefusesOtherText) {
  for (const char* uri :
       {"data:;base64,TW=u", "data:;base64,TWFuA", "data:;base64,TW!u", "data:;base64", "dat:,x"}) {
    EXPECT_EQ(text_of(uri), "refused") << uri;
  }
}

core::Bytes document_of(const std::string& text) {
  const auto* first = reinterpret_cast<const std::byte*>(text.data());
  return core::Bytes(first, first + text.size());
}

TEST(GltfMemory, IsLimitedBeforeItIsAllocated) {
  core::GltfOptions options;
  options.limits.decoded_bytes_max = 1 << 20;
  const auto zeros = [](const std::string& count) {
    return document_of(R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
                       R"("nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":)"
                       R"({"POSITION":0}}]}],"accessors":[{"componentType":5126,"type":"VEC3",)"
                       R"("count":)" +
                       count + "}]}");
  };
  EXPECT_TRUE(core::load_gltf(zeros("3000"), nullptr, options));
  // The values, and the vectors made of them, of 12 bytes each.
  EXPECT_EQ(core::load_gltf(zeros("60000"), nullptr, options).error().code,
            core::ErrorCode::kTooLarge);
  std::string nodes;
  for (int i = 0; i < 2000; ++i) {
    nodes += ",{}";
  }
  EXPECT_EQ(core::load_gltf(document_of(R"({"asset":{"version":"2.0"},"nodes":[{})" + nodes + "]}"),
                            nullptr, options)
                .error()
                .code,
            core::ErrorCode::kTooLarge);
}

TEST(GltfPrimitive, WithoutAttributesIsRefused) {
  const auto loaded = core::load_gltf(
      document_of(R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{}}]}]})"),
      nullptr, strictly());
  ASSERT_FALSE(loaded);
  EXPECT_EQ(loaded.error().where, "/meshes/0/primitives/0/attributes");
}

}  // namespace
