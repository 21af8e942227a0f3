#include "core/scene_io/gltf_uri.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

const std::string kAsset = R"("asset":{"version":"2.0"})";

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

TEST(GltfBadInput, NamesOtherEncodings) {
  using std::string_view_literals::operator""sv;
  const auto said = [](std::string_view file) {
    return load_json(std::string(file)).error().message;
  };
  for (const std::string_view file : {"\xFF\xFE{\0"sv, "\xFE\xFF\0{"sv, "{\0\"\0"sv, "\0{\0\""sv}) {
    EXPECT_EQ(said(file), "the glTF JSON is encoded in UTF-16; it must be UTF-8");
  }
  for (const std::string_view file : {"\xFF\xFE\0\0{\0\0\0"sv, "\0\0\0{\0\0\0\""sv}) {
    EXPECT_EQ(said(file), "the glTF JSON is encoded in UTF-32; it must be UTF-8");
  }
}

TEST(GltfBadInput, SkipsAByteOrderMark) { EXPECT_TRUE(load_json("\xEF\xBB\xBF{" + kAsset + "}")); }

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

TEST(GltfBadInput, TruncatedExternalFileIsRefused) {
  const auto resolve = [](std::string_view) {
    return std::make_shared<const core::Bytes>(core::Bytes(3));
  };
  expect_error_at(
      load_json_strictly("{" + kAsset + R"(,"buffers":[{"uri":"a.bin","byteLength":4}]})", resolve),
      "/buffers/0/byteLength");
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

}  // namespace
