#include "core/scene_io/builtin_scenes.h"

#include <map>
#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "core/scene_io/builtin_shapes.h"

namespace {

using core::Vec3;

core::SceneDescription load_builtin(std::string_view name) {
  const core::BuiltinScene* scene = core::find_builtin_scene(name);
  if (scene == nullptr) {
    ADD_FAILURE() << "missing scene " << name;
    return {};
  }
  auto loaded = core::load_gltf(scene->make_glb(), nullptr, {});
  if (!loaded) {
    ADD_FAILURE() << loaded.error().where << ": " << loaded.error().message;
    return {};
  }
  return *std::move(loaded);
}

class EachBuiltin : public testing::TestWithParam<std::string> {};

TEST_P(EachBuiltin, LoadsWithoutWarnings) {
  EXPECT_TRUE(load_builtin(GetParam()).warnings.empty());
}

TEST_P(EachBuiltin, HasACameraNamedCamera) {
  const core::SceneDescription scene = load_builtin(GetParam());
  ASSERT_EQ(scene.cameras.size(), 1U);
  EXPECT_EQ(scene.cameras[0].name, "camera");
}

TEST_P(EachBuiltin, IsReproducible) {
  const core::BuiltinScene* scene = core::find_builtin_scene(GetParam());
  ASSERT_NE(scene, nullptr);
  EXPECT_EQ(scene->make_glb(), scene->make_glb());
}

TEST_P(EachBuiltin, NormalsAgreeWithTheFrontSides) {
  // Vertex normals and front sides of the triangles agree.
  const core::SceneDescription scene = load_builtin(GetParam());
  for (const core::MeshDescription& mesh : scene.meshes) {
    for (const core::PrimitiveDescription& p : mesh.primitives) {
      ASSERT_EQ(p.normals.size(), p.positions.size()) << mesh.name;
      for (std::size_t t = 0; t < p.indices.size(); t += 3) {
        const Vec3 a = p.positions[p.indices[t]];
        const Vec3 face =
            core::cross(p.positions[p.indices[t + 1]] - a, p.positions[p.indices[t + 2]] - a);
        const Vec3 mean =
            p.normals[p.indices[t]] + p.normals[p.indices[t + 1]] + p.normals[p.indices[t + 2]];
        ASSERT_GT(core::dot(face, mean), 0) << mesh.name << " triangle " << t / 3;
      }
    }
  }
}

TEST_P(EachBuiltin, OnlyTheFurnaceHasTheWhiteSky) {
  EXPECT_EQ(load_builtin(GetParam()).has_emissive_strength, GetParam() != "furnace");
}

INSTANTIATE_TEST_SUITE_P(BuiltinScenes, EachBuiltin,
                         testing::Values("cornell-box", "furnace", "veach-mis", "many-lights",
                                         "glass", "interior", "keyhole", "caustic-pool",
                                         "still-life"),
                         [](const auto& test) {
                           std::string name = test.param;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

TEST(BuiltinScenes, UnknownNameIsNotFound) {
  EXPECT_EQ(core::find_builtin_scene("nowhere"), nullptr);
}

TEST(CornellBox, HasTheMeasuredSize) {
  core::Bounds bounds;
  const core::SceneDescription scene = load_builtin("cornell-box");
  for (const core::MeshDescription& mesh : scene.meshes) {
    for (const Vec3 p : mesh.primitives[0].positions) {
      bounds.add(p);
    }
  }
  EXPECT_EQ(bounds.min, (Vec3{0, 0, 0}));
  EXPECT_FLOAT_EQ(bounds.max.x, 0.556F);
  EXPECT_FLOAT_EQ(bounds.max.y, 0.5488F);
  EXPECT_FLOAT_EQ(bounds.max.z, 0.5592F);
}

TEST(CornellBox, CameraSeesTheRedWallOnTheLeft) {
  const core::SceneDescription scene = load_builtin("cornell-box");
  const core::Transform camera = scene.cameras[0].to_world;
  EXPECT_NEAR(scene.cameras[0].vertical_fov_rad, 39.3077 * 3.14159265 / 180, 1e-5);
  for (const core::MeshDescription& mesh : scene.meshes) {
    const Vec3 p = mesh.primitives[0].positions[0];
    const float right = core::dot(camera.x, p - camera.t);
    if (mesh.name == "red wall") {
      EXPECT_LT(right, 0);
    }
    if (mesh.name == "green wall") {
      EXPECT_GT(right, 0);
    }
  }
}

TEST(CornellBox, EmitterHasTheMeasuredRadianceAndArea) {
  const core::SceneDescription scene = load_builtin("cornell-box");
  const core::MeshDescription& lamp = scene.meshes.back();
  ASSERT_EQ(lamp.name, "lamp");
  const core::PrimitiveDescription& p = lamp.primitives[0];
  const core::Rgb radiance = scene.materials[static_cast<std::size_t>(p.material)].emissive;
  EXPECT_NEAR(radiance.r, 18.387F, 1e-4);
  EXPECT_NEAR(radiance.g, 13.9873F, 1e-4);
  EXPECT_NEAR(radiance.b, 6.75357F, 1e-4);
  const float area =
      core::length(core::cross(p.positions[1] - p.positions[0], p.positions[3] - p.positions[0]));
  EXPECT_NEAR(area, 0.13F * 0.105F, 1e-7);
}

TEST(ManyLights, HasAThousandEmitters) {
  const core::SceneDescription scene = load_builtin("many-lights");
  int emitters = 0;
  for (const core::InstanceDescription& instance : scene.instances) {
    const int material =
        scene.meshes[static_cast<std::size_t>(instance.mesh)].primitives[0].material;
    emitters +=
        core::is_black(scene.materials[static_cast<std::size_t>(material)].emissive) ? 0 : 1;
  }
  EXPECT_EQ(emitters, 1000);
}

TEST(VeachMis, EmittersBelowTheWallHaveEqualPower) {
  const core::SceneDescription scene = load_builtin("veach-mis");
  int lamps = 0;
  for (const core::MeshDescription& mesh : scene.meshes) {
    if (mesh.name != "lamp") {
      continue;
    }
    const core::PrimitiveDescription& p = mesh.primitives[0];
    const float radius = core::length(p.positions[0]);
    const core::Rgb radiance = scene.materials[static_cast<std::size_t>(p.material)].emissive;
    EXPECT_NEAR(core::luminance(radiance) * radius * radius, 1, 0.03);
    ++lamps;
  }
  EXPECT_EQ(lamps, 4);
}

// Every edge of a closed surface occurs twice, once in each direction, after merging vertices at
// equal positions.
void expect_closed(const core::PrimitiveDescription& p) {
  std::map<std::tuple<float, float, float>, int> places;
  const auto place = [&places](Vec3 v) {
    return places.try_emplace({v.x, v.y, v.z}, static_cast<int>(places.size())).first->second;
  };
  std::map<std::pair<int, int>, int> edges;
  for (std::size_t t = 0; t < p.indices.size(); t += 3) {
    for (std::size_t i = 0; i < 3; ++i) {
      const int a = place(p.positions[p.indices[t + i]]);
      const int b = place(p.positions[p.indices[t + (i + 1) % 3]]);
      ++edges[{a, b}];
    }
  }
  for (const auto& [edge, count] : edges) {
    ASSERT_EQ(count, 1);
    ASSERT_TRUE(edges.contains({edge.second, edge.first}));
  }
}

TEST(Glass, BodiesAreClosed) {
  const core::SceneDescription scene = load_builtin("glass");
  for (const core::MeshDescription& mesh : scene.meshes) {
    if (scene.materials[static_cast<std::size_t>(mesh.primitives[0].material)].transmission > 0) {
      SCOPED_TRACE(mesh.name);
      expect_closed(mesh.primitives[0]);
    }
  }
}

TEST(Furnace, NothingAbsorbs) {
  for (const core::MaterialDescription& m : load_builtin("furnace").materials) {
    EXPECT_EQ(m.base_color, core::Rgb(1)) << m.name;
    EXPECT_EQ(m.attenuation_color, core::Rgb(1)) << m.name;
  }
}

TEST(Shapes, SphereHasTheAreaOfASphere) {
  const core::PrimitiveDescription p = core::sphere(1, 96);
  double area = 0;
  for (std::size_t t = 0; t < p.indices.size(); t += 3) {
    const Vec3 a = p.positions[p.indices[t]];
    area += static_cast<double>(core::length(core::cross(p.positions[p.indices[t + 1]] - a,
                                                         p.positions[p.indices[t + 2]] - a))) /
            2;
  }
  // 96 by 48 flat facets lose about (pi / 96)^2 of 4 pi.
  EXPECT_NEAR(area / (4 * 3.14159265358979), 1, 2e-3);
  expect_closed(p);
}

}  // namespace
