// Exports of mirrored meshes: their normals point to the back of their triangles, and their normal
// maps show the same bumps as those of the file without the fault.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/scene_io/builtin_shapes.h"
#include "core/scene_io/tangent_space.h"
#include "tests/render/gltf_stage.h"

namespace {

enum class Tangents { kNone, kRight, kMirrored };

struct Fault {
  std::string name;
  bool turns_winding = false;
  bool turns_normals = false;
};

/// A sphere that fills the picture; its map tilts normals towards +u and +v, a coat's alike.
core::SceneDescription bumpy(const Fault& fault, Tangents tangents, bool has_coat) {
  core::PrimitiveDescription sphere = core::sphere(1.2F, 24);
  if (tangents != Tangents::kNone) {
    core::make_tangents(sphere, 0);
    for (core::Vec4& t : sphere.tangents) {
      t.w = tangents == Tangents::kMirrored ? -t.w : t.w;
    }
  }
  if (fault.turns_winding) {
    for (std::size_t i = 0; i < sphere.indices.size(); i += 3) {
      std::swap(sphere.indices[i + 1], sphere.indices[i + 2]);
    }
  }
  for (core::Vec3& n : sphere.normals) {
    n = fault.turns_normals ? -n : n;
  }
  sphere.material = 0;
  core::MaterialDescription m = test_support::lambert({0.8F, 0.8F, 0.8F});
  m.double_sided = true;
  (has_coat ? m.clearcoat_normal_texture : m.normal_texture).image = 0;
  m.clearcoat = has_coat ? 1.0F : 0.0F;
  m.clearcoat_roughness = 0.5F;
  core::SceneDescription scene = test_support::scene_of({m}, {sphere});
  test_support::add_image(scene, 1, 1, 3, {191, 166, 229});
  scene.cameras.push_back(test_support::front_camera());
  scene.lights.push_back(test_support::sun(test_support::towards(30, 20), {1, 1, 1}));
  return scene;
}

TEST(GltfMirrored, NormalMapsShowTheSameBumpsFromOutside) {
  for (const bool has_coat : {false, true}) {
    const auto right = test_support::shoot_glb(bumpy({}, Tangents::kRight, has_coat), {});
    for (const Fault& fault : {Fault{"winding", true, false}, Fault{"normals", false, true}}) {
      for (const Tangents tangents : {Tangents::kNone, Tangents::kRight, Tangents::kMirrored}) {
        const auto scene = test_support::load(core::write_glb(bumpy(fault, tangents, has_coat)));
        ASSERT_EQ(scene.warnings.size(), 1U);
        EXPECT_EQ(scene.warnings[0].code, "turned");
        const auto mended = test_support::shoot(scene, {});
        double error = 0;
        for (int i = 0; i < 64; ++i) {
          const double a = static_cast<double>(test_support::pixel(right, i % 8, i / 8).g);
          const double b = static_cast<double>(test_support::pixel(mended, i % 8, i / 8).g);
          error = std::max(error, std::abs(a - b));
        }
        // The sun is the only light, so that what differs is rounding.
        EXPECT_LT(error, 1e-4) << fault.name << " " << static_cast<int>(tangents) << has_coat;
      }
    }
  }
}

// A map on one side, and its light on the other, as the winding says.
TEST(GltfMirrored, TheFrontStillEmits) {
  for (const bool turns_normals : {false, true}) {
    core::SceneDescription scene = bumpy({"", false, turns_normals}, Tangents::kNone, false);
    scene.materials[0].double_sided = false;
    scene.materials[0].emissive = {1, 1, 1};
    scene.materials[0].base_color = {0, 0, 0};
    EXPECT_NEAR(test_support::pixel(test_support::shoot_glb(scene, {}), 4, 4).r, 1, 1e-3);
    scene = bumpy({"", true, turns_normals}, Tangents::kNone, false);
    scene.materials[0].double_sided = false;
    scene.materials[0].emissive = {1, 1, 1};
    scene.materials[0].base_color = {0, 0, 0};
    EXPECT_NEAR(test_support::pixel(test_support::shoot_glb(scene, {}), 4, 4).r, 0, 1e-3);
  }
}

}  // namespace
