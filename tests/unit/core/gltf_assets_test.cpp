// The third-party assets, if available: every file loads, and counts agree with the file's JSON,
// its README or the description of the Khronos model.
#include <filesystem>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/image_io/image_io.h"
#include "core/scene_io/gltf_load.h"
#include "tests/support/asset_files.h"
#include "tests/support/read_bytes.h"

namespace {

namespace fs = std::filesystem;

using test_support::load_asset;

// Skips with a message if the folder is missing.
class Assets : public testing::Test {
 protected:
  void SetUp() override {
    const auto found = test_support::assets_folder();
    if (!found) {
      GTEST_SKIP() << test_support::missing_assets();
    }
    folder_ = *found;
  }

  fs::path folder_;
};

std::size_t drawn_triangles(const core::SceneDescription& scene) {
  std::size_t triangles = 0;
  for (const core::InstanceDescription& instance : scene.instances) {
    for (const core::PrimitiveDescription& p :
         scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
      triangles += p.indices.size() / 3;
    }
  }
  return triangles;
}

TEST_F(Assets, EveryFileLoads) {
  const std::vector<std::string> names = test_support::asset_names(folder_);
  for (const std::string& name : names) {
    const auto scene = load_asset(folder_ / name);
    EXPECT_TRUE(scene.has_value())
        << name << ": " << (scene ? "" : scene.error().where + ": " + scene.error().message);
  }
  EXPECT_FALSE(names.empty());
}

TEST_F(Assets, EveryFileLoadsAtAnotherTime) {
  core::GltfOptions options;
  options.time_seconds = 0.4;
  for (const char* name :
       {"Fox.glb", "RiggedSimple.glb", "AnimatedMorphCube.glb", "InterpolationTest.glb"}) {
    EXPECT_TRUE(load_asset(folder_ / name, options).has_value()) << name;
  }
}

struct Count {
  const char* file;
  std::size_t meshes;
  std::size_t instances;
  std::size_t triangles;  // with instances
  std::size_t lights;
  std::size_t cameras;
};
// Triangles: index counts of the files' accessors times their uses; instances: nodes with a mesh,
// or the count of the instancing accessors.
constexpr Count kCounts[] = {
    {"TriangleWithoutIndices_embedded.gltf", 1, 1, 1, 0, 0},
    {"BoxTextured/BoxTextured.gltf", 1, 1, 12, 0, 0},
    {"BoxTextured_embedded.gltf", 1, 1, 12, 0, 0},
    {"BoxTextured_meshopt.glb", 1, 1, 12, 0, 0},
    {"Box_draco.glb", 1, 1, 12, 0, 0},
    {"MeshPrimitiveModes.glb", 3, 3, 16, 0, 0},
    {"SimpleInstancing.glb", 1, 125, 1500, 0, 0},
    {"gen_instanced_10k.glb", 1, 10000, 5280000, 0, 1},
    {"gen_big_terrain.glb", 1, 1, 288800, 0, 1},
    {"gen_lights.glb", 2, 5, 8834, 4, 1},
    {"Cameras/Cameras.gltf", 1, 1, 2, 0, 2},
    {"Fox.glb", 1, 1, 576, 0, 0},
    {"WaterBottle.glb", 1, 1, 4510, 0, 0},
};

TEST_F(Assets, CountsMatchTheFiles) {
  for (const Count& count : kCounts) {
    const auto scene = load_asset(folder_ / count.file);
    ASSERT_TRUE(scene) << count.file;
    EXPECT_EQ(scene->meshes.size(), count.meshes) << count.file;
    EXPECT_EQ(scene->instances.size(), count.instances) << count.file;
    EXPECT_EQ(drawn_triangles(*scene), count.triangles) << count.file;
    EXPECT_EQ(scene->lights.size(), count.lights) << count.file;
    EXPECT_EQ(scene->cameras.size(), count.cameras) << count.file;
  }
}

TEST_F(Assets, EncodingsOfTheTexturedBoxAgree) {
  const auto bounds_of = [](const core::SceneDescription& scene) {
    core::Bounds bounds;
    for (const core::InstanceDescription& instance : scene.instances) {
      for (const auto& p : scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives) {
        for (const core::Vec3 v : p.positions) {
          bounds.add(instance.to_world.point(v));
        }
      }
    }
    return bounds;
  };
  for (const char* name :
       {"BoxTextured/BoxTextured.gltf", "BoxTextured_embedded.gltf", "BoxTextured_meshopt.glb",
        "BoxTextured_webp_embedded.gltf", "BoxTextured_webp/box-textured-with-fallback.gltf",
        "BoxTextured_specgloss.glb"}) {
    const auto scene = load_asset(folder_ / name);
    ASSERT_TRUE(scene) << name;
    const core::Bounds bounds = bounds_of(*scene);
    // A cube of side 1 around the origin; quantisation may shift it by 2^-14.
    EXPECT_NEAR(bounds.min.x, -0.5F, 1e-4) << name;
    EXPECT_NEAR(bounds.max.z, 0.5F, 1e-4) << name;
    ASSERT_GE(scene->images.size(), 1U) << name;
    EXPECT_GT(scene->images[0]->width, 0) << name;
  }
}

TEST_F(Assets, ListsTheVariantsOfTheFile) {
  const auto scene = load_asset(folder_ / "blenderio_18_variants.glb");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->variants.size(), 2U);
}

TEST_F(Assets, EnvironmentsDecode) {
  const auto image =
      core::decode_image(test_support::read_bytes(folder_ / "env" / "venice_sunset_256.hdr"), {});
  ASSERT_TRUE(image);
  EXPECT_EQ(image->width, 256);
  EXPECT_EQ(image->height, 128);
  EXPECT_EQ(image->type, core::PixelType::kF32);
}

TEST_F(Assets, TruncatedFilesNeverCrash) {
  for (const char* name : {"Box_draco.glb", "pirate_meshopt.glb", "AnimatedMorphCube.glb"}) {
    const core::Bytes whole = test_support::read_bytes(folder_ / name);
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 500) {
      const auto scene = core::load_gltf(std::span(whole).first(size), nullptr, {});
      EXPECT_FALSE(scene.has_value()) << name << " " << size;
    }
  }
}

}  // namespace
