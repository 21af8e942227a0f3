#include "core/scene_io/gltf_container.h"

#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;

core::Bytes small_glb() {
  core::GlbWriter writer;
  const int indices = accessor(writer, std::vector<std::uint16_t>{0, 1, 2}, kU16, "SCALAR", 1);
  writer.add("materials",
             R"({"name":"m","pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1]}})");
  writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1,"znear":0.1}})");
  writer.add("nodes", R"({"camera":0})");
  add_triangle(writer, "\"material\":0,\"indices\":" + number(indices));
  return writer.finish();
}

TEST(GltfContainer, LoadsASmallFile) { EXPECT_TRUE(load(small_glb()).has_value()); }

TEST(GltfContainer, RefusesEveryTruncation) {
  const core::Bytes whole = small_glb();
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const core::Bytes cut(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(size));
    EXPECT_FALSE(load(cut).has_value()) << size << " of " << whole.size();
  }
}

TEST(GltfContainer, EveryFlippedBitGivesAResult) {
  const core::Bytes whole = small_glb();
  int refused = 0;
  for (std::size_t bit = 0; bit < whole.size() * 8; ++bit) {
    core::Bytes flipped = whole;
    flipped[bit / 8] ^= static_cast<std::byte>(1U << bit % 8);
    core::GltfOptions options;
    options.limits.decoded_bytes_max = 1 << 20;
    refused += load(flipped, options).has_value() ? 0 : 1;
  }
  EXPECT_GT(refused, 0);
}

TEST(GltfContainer, RefusesAnEmptyFile) { EXPECT_FALSE(load(core::Bytes{}).has_value()); }

TEST(GltfContainer, ReportsAnotherVersion) {
  core::Bytes file = small_glb();
  file[4] = std::byte{1};
  const auto scene = load(file);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().message, "GLB container version 1; only 2 is read");
}

TEST(GltfContainer, AllowsNestingOf64ButNot65) {
  const auto nested = [](int depth) {
    // The document is one level, "extras" the other ones.
    return R"({"asset":{"version":"2.0"},"extras":)" +
           std::string(static_cast<std::size_t>(depth - 1), '[') +
           std::string(static_cast<std::size_t>(depth - 1), ']') + "}";
  };
  EXPECT_TRUE(load_json(nested(64)).has_value());
  const auto deep = load_json(nested(65));
  ASSERT_FALSE(deep);
  EXPECT_EQ(deep.error().message, "JSON is nested deeper than 64 levels");
}

TEST(GltfContainer, RefusesAMillionBrackets) {
  EXPECT_FALSE(load_json(std::string(1'000'000, '[')).has_value());
}

TEST(GltfContainer, IgnoresBracketsInStrings) {
  EXPECT_TRUE(
      load_json(R"({"asset":{"version":"2.0"},"extras":")" + std::string(200, '[') + "\\\"\"}")
          .has_value());
}

TEST(GltfContainer, RefusesTooMuchJson) {
  core::GltfOptions options;
  options.limits.json_bytes_max = 64;
  const auto scene = load(small_glb(), options);
  ASSERT_FALSE(scene);
  EXPECT_EQ(scene.error().code, core::ErrorCode::kTooLarge);
}

TEST(GltfContainer, RefusesBrokenJsonWithThePosition) {
  const auto scene = load_json(R"({"asset":{"version":"2.0"},})");
  ASSERT_FALSE(scene);
  EXPECT_NE(scene.error().message.find("column"), std::string::npos) << scene.error().message;
}

}  // namespace
