// Documents with data URIs as documents with files, and scenes turned from z up to y up.
#include "core/scene_io/split_gltf.h"

#include <string>

#include <gtest/gtest.h>

namespace {

// Positions (0,0,0), (1,0,0), (0,0,1).
constexpr const char* kData = "AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAAAAAAIA/";

std::string document(const std::string& move, const std::string& uri) {
  return R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],)"
         R"("nodes":[{"mesh":0,"translation":)" +
         move +
         R"(}],"meshes":[{"name":"a \"data:\" name\\",)"
         R"("primitives":[{"attributes":{"POSITION":0}}]}],)"
         R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",)"
         R"("min":[0,0,0],"max":[1,0,1]}],"bufferViews":[{"buffer":0,"byteLength":36}],)"
         R"("buffers":[{"byteLength":36,"uri":")" +
         uri + R"("}]})";
}

std::string data_uri() { return std::string("data:application/octet-stream;base64,") + kData; }

core::Result<core::SceneDescription> load(const core::SplitGltf& split) {
  return core::load_gltf(split.document,
                         [&split](std::string_view name) {
                           const auto found = split.files.find(std::string(name));
                           return found == split.files.end() ? nullptr : found->second;
                         },
                         {});
}

TEST(SplitGltf, MovedNodeHasTheSameFiles) {
  const auto here = core::split_gltf(document("[0,0,0]", data_uri()), false);
  const auto there = core::split_gltf(document("[5,6,7]", data_uri()), false);
  ASSERT_TRUE(here && there);
  ASSERT_EQ(here->files.size(), 1U);
  EXPECT_EQ(here->files.begin()->first, there->files.begin()->first);
  EXPECT_EQ(here->files.begin()->second->size(), 36U);
  EXPECT_NE(here->document, there->document);
  EXPECT_LT(here->document.size(), document("[0,0,0]", data_uri()).size());
}

TEST(SplitGltf, ZBecomesYAndYBecomesMinusZ) {
  const auto split = core::split_gltf(document("[2,3,4]", data_uri()), true);
  ASSERT_TRUE(split);
  const auto scene = load(*split);
  ASSERT_TRUE(scene) << scene.error().message;
  ASSERT_EQ(scene->instances.size(), 1U);
  const core::Vec3 origin = scene->instances[0].to_world.point({0, 0, 0});
  const core::Vec3 above = scene->instances[0].to_world.point({0, 0, 1});
  EXPECT_NEAR(origin.x, 2, 1e-6);
  EXPECT_NEAR(origin.y, 4, 1e-6);
  EXPECT_NEAR(origin.z, -3, 1e-6);
  EXPECT_NEAR(above.y, 5, 1e-6);
}

TEST(SplitGltf, JoinedBuffersAreTheSameScene) {
  std::string text = document("[0,0,0]", data_uri());
  const auto put = [&text](const std::string& before, const std::string& more) {
    text.insert(text.find(before) + before.size() - 1, more);
  };
  // A second mesh, whose buffer begins after one byte of another.
  put(R"("uri":")" + data_uri() + "\"}]",
      R"(,{"byteLength":1,"uri":"data:;base64,AQ=="},{"byteLength":36,"uri":")" +
          std::string("data:a/b;base64,AACAPwAAAAAAAAAAAAAAAAAAAAAAAIA/AAAAAAAAgD8AAAAA") + "\"}");
  put(R"("byteLength":36}])", R"(,{"buffer":2,"byteLength":36})");
  put(R"("max":[1,0,1]}])", R"(,{"bufferView":1,"componentType":5126,"count":3,"type":"VEC3",)"
                            R"("min":[0,0,0],"max":[1,1,1]})");
  put(R"({"attributes":{"POSITION":0}}])", R"(,{"attributes":{"POSITION":1}})");
  const auto split = core::split_gltf(text, false);
  ASSERT_TRUE(split);
  ASSERT_EQ(split->files.size(), 3U);
  const core::SplitGltf joined = core::join_buffers(*split);
  EXPECT_EQ(joined.files.size(), 1U);
  const auto apart = load(*split);
  const auto together = load(joined);
  ASSERT_TRUE(apart && together);
  ASSERT_EQ(apart->meshes[0].primitives.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(apart->meshes[0].primitives[i].positions,
              together->meshes[0].primitives[i].positions);
  }
}

TEST(SplitGltf, EscapedUrisAndNamesStay) {
  const std::string escaped = R"(data:application\/octet-stream;base64,)" + std::string(kData);
  const std::string text = document("[0,0,0]", escaped);
  const auto split = core::split_gltf(text, false);
  ASSERT_TRUE(split);
  EXPECT_TRUE(split->files.empty());
  EXPECT_EQ(split->document.size(), text.size());
  EXPECT_TRUE(load(*split));
}

TEST(SplitGltf, BrokenTextIsLeftToTheLoader) {
  for (const char* text : {"", "{", "\"", "{\"uri\":\"data:", "{\"uri\":\"\\", "[]", "\\\"\\"}) {
    const auto split = core::split_gltf(text, false);
    ASSERT_TRUE(split) << text;
    EXPECT_EQ(split->document.size(), std::string(text).size());
    EXPECT_FALSE(load(*split)) << text;
    EXPECT_EQ(core::join_buffers(*split).document, split->document);
  }
  EXPECT_FALSE(core::split_gltf(document("[0,0,0]", "data:;base64,*"), false));
  const std::string deep(200, '[');
  EXPECT_FALSE(core::split_gltf("{\"a\":" + deep, true));
}

}  // namespace
