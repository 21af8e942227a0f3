// The third-party assets, if available: every file loads, and counts agree with the file's JSON,
// its README or the description of the Khronos model.
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/image_io/image_io.h"
#include "core/scene_io/gltf_load.h"

namespace {

namespace fs = std::filesystem;

fs::path assets() {
  const char* named = std::getenv("TESSERA_ASSETS");
  return named != nullptr ? fs::path(named)
                          : fs::path(TESSERA_SOURCE_DIR) / ".." / "shared" / "assets";
}

core::Bytes read_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::vector<char> chars((std::istreambuf_iterator<char>(in)),
                                std::istreambuf_iterator<char>());
  const auto* first = reinterpret_cast<const std::byte*>(chars.data());
  return {first, first + chars.size()};
}

core::Result<core::SceneDescription> load_asset(const fs::path& path,
                                                const core::GltfOptions& options = {}) {
  const auto resolve = [&path](std::string_view uri) -> core::SharedBytes {
    const fs::path file = path.parent_path() / uri;
    return fs::exists(file) ? std::make_shared<const core::Bytes>(read_file(file)) : nullptr;
  };
  return core::load_gltf(read_file(path), resolve, options);
}

// Skips with a message if the folder is missing.
class Assets : public testing::Test {
 protected:
  void SetUp() override {
    if (!fs::exists(assets())) {
      GTEST_SKIP() << "DID NOT RUN: no assets at " << assets()
                   << "; TESSERA_ASSETS can name another folder";
    }
  }
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
  int files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(assets())) {
    const std::string extension = entry.path().extension();
    if (extension != ".glb" && extension != ".gltf") {
      continue;
    }
    ++files;
    const auto scene = load_asset(entry.path());
    EXPECT_TRUE(scene.has_value())
        << entry.path() << ": "
        << (scene ? "" : scene.error().where + ": " + scene.error().message);
  }
  EXPECT_GT(files, 0);
}

TEST_F(Assets, EveryFileLoadsAtAnotherTime) {
  core::GltfOptions options;
  options.time_seconds = 0.4;
  for (const char* name :
       {"Fox.glb", "RiggedSimple.glb", "AnimatedMorphCube.glb", "InterpolationTest.glb"}) {
    EXPECT_TRUE(load_asset(assets() / name, options).has_value()) << name;
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
    const auto scene = load_asset(assets() / count.file);
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
    const auto scene = load_asset(assets() / name);
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
  const auto scene = load_asset(assets() / "blenderio_18_variants.glb");
  ASSERT_TRUE(scene);
  EXPECT_EQ(scene->variants.size(), 2U);
}

TEST_F(Assets, EnvironmentsDecode) {
  const auto image = core::decode_image(read_file(assets() / "env" / "venice_sunset_256.hdr"), {});
  ASSERT_TRUE(image);
  EXPECT_EQ(image->width, 256);
  EXPECT_EQ(image->height, 128);
  EXPECT_EQ(image->type, core::PixelType::kF32);
}

TEST_F(Assets, TruncatedFilesNeverCrash) {
  for (const char* name : {"Box_draco.glb", "pirate_meshopt.glb", "AnimatedMorphCube.glb"}) {
    const core::Bytes whole = read_file(assets() / name);
    for (std::size_t size = 0; size < whole.size(); size += 1 + whole.size() / 500) {
      const auto scene = core::load_gltf(std::span(whole).first(size), nullptr, {});
      EXPECT_FALSE(scene.has_value()) << name << " " << size;
    }
  }
}

}  // namespace
