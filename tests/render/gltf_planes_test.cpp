// The clipping planes of the file's cameras (glTF 2.0, 3.10.3): camera rays see what lies between
// them, in every integrator.
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using test_support::Picture;

/// A red, a green and a blue wall 2, 4 and 8 m in front of a camera, each with its own emission.
core::SceneDescription walls(bool is_orthographic, float near_m, float far_m) {
  core::SceneDescription scene;
  for (int i = 0; i < 3; ++i) {
    core::MaterialDescription material;
    material.base_color = {0, 0, 0};
    material.emissive = {i == 0 ? 1.0F : 0.0F, i == 1 ? 1.0F : 0.0F, i == 2 ? 1.0F : 0.0F};
    material.double_sided = true;
    scene.materials.push_back(material);
    core::MeshDescription mesh;
    mesh.primitives.push_back(test_support::patch(0, i));
    scene.meshes.push_back(mesh);
    core::InstanceDescription wall;
    wall.mesh = i;
    wall.to_world = {
        {20, 0, 0}, {0, 20, 0}, {0, 0, 20}, {0, 0, -2.0F * static_cast<float>(1 << i)}};
    scene.instances.push_back(wall);
  }
  core::CameraDescription camera;
  camera.orthographic = is_orthographic;
  camera.vertical_fov_rad = 0.8F;
  camera.near_m = near_m;
  camera.far_m = far_m;
  scene.cameras.push_back(camera);
  return scene;
}

Picture picture_of(const core::SceneDescription& scene, const std::string& integrator,
                   int samples = 16) {
  core::View view = test_support::view_of(test_support::load(core::write_glb(scene)), 8, 8);
  view.settings = core::default_settings(integrator);
  view.settings.film.width = 8;
  view.settings.film.height = 8;
  view.settings.film.depth = integrator == "path";
  view.settings.max_depth = 2;
  return test_support::render(view, samples);
}

class ClippingPlanes : public testing::TestWithParam<int> {};

TEST_P(ClippingPlanes, BoundWhatTheCameraSees) {
  const core::IntegratorEntry& row = core::integrators()[static_cast<std::size_t>(GetParam())];
  if (row.name == "ao") {
    return;  // sees no emission
  }
  for (const bool is_orthographic : {false, true}) {
    const auto at = [&](float near_m, float far_m) {
      return test_support::pixel(
          picture_of(walls(is_orthographic, near_m, far_m), std::string(row.name)), 4, 4);
    };
    const Rgb all = at(0, 1e30F);
    const Rgb second = at(3, 100);
    const Rgb third = at(5, 100);
    const Rgb none = at(0, 1.5F);
    EXPECT_NEAR(all.r, 1, 1e-4) << row.name;
    // The walls reflect at most 4 % of each other's light (Fresnel, index 1.5).
    EXPECT_LT(all.g + all.b, 0.04) << row.name;
    EXPECT_NEAR(second.g, 1, 1e-4) << row.name;
    EXPECT_LT(second.r + second.b, 0.04) << row.name;
    EXPECT_NEAR(third.b, 1, 1e-4) << row.name;
    EXPECT_LT(third.r + third.g, 0.04) << row.name;
    EXPECT_EQ(none.r + none.g + none.b, 0) << row.name;
  }
}

INSTANTIATE_TEST_SUITE_P(AllIntegrators, ClippingPlanes,
                         testing::Range(0, static_cast<int>(core::integrators().size())));

TEST(ClippingPlane, DepthIsMeasuredFromTheCamera) {
  for (const bool is_orthographic : {false, true}) {
    const Picture picture = picture_of(walls(is_orthographic, 3, 100), "path");
    // The pixel right and below of the centre lies at most a pixel off the axis.
    const double off = is_orthographic ? 0 : 2 * std::tan(0.4) / 8;
    const double depth = static_cast<double>(test_support::depth_at(picture, 4, 4));
    EXPECT_GE(depth, 4 - 1e-4);
    EXPECT_LE(depth, 4 * std::sqrt(1 + 2 * off * off) + 1e-4);
  }
}

/// A grey wall 4 m away, lit by a lamp beside the view; a black one 2 m away hides it.
core::SceneDescription hidden_wall(float near_m) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert({0.5F, 0.5F, 0.5F}), test_support::lambert({0, 0, 0}),
       test_support::emitter({10, 10, 10})},
      {test_support::quad({-8, -8, -4}, {16, 0, 0}, {0, 16, 0}, 0),
       test_support::quad({-8, -8, -2}, {16, 0, 0}, {0, 16, 0}, 1),
       test_support::quad({3, -0.5F, -3.5F}, {0, 0, 1}, {0, 1, 0}, 2)});
  core::CameraDescription camera;
  camera.vertical_fov_rad = 0.5F;
  camera.near_m = near_m;
  scene.cameras.push_back(camera);
  return scene;
}

// Connections of light paths to the camera end at the near plane.
TEST(ClippingPlane, LightPathsReachTheCameraThroughWhatItClips) {
  const Rgb path = picture_of(hidden_wall(3), "path", 1024).mean();
  EXPECT_GT(path.g, 0.01F);
  for (const char* integrator : {"light-trace", "bdpt", "mlt", "sppm"}) {
    // Particles find few of the pixels: a standard error of 0.7%; of the others 0.4% at most.
    const bool is_particles = std::string_view(integrator) == "light-trace";
    const Picture picture = picture_of(hidden_wall(3), integrator, is_particles ? 4096 : 512);
    EXPECT_NEAR(picture.mean().g, path.g, 0.03F * path.g) << integrator;
    EXPECT_EQ(picture_of(hidden_wall(0), integrator, 16).mean().g, 0) << integrator;
  }
}

}  // namespace
