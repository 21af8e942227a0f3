// Shading normals: coarse smooth-shaded meshes lit from the side stay lossless, and all strategies
// agree. The false alarm rate of each z-test is that of 4.5 standard deviations, 7e-6.
#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Picture;
using test_support::pixel;

constexpr double kPi = 3.14159265358979323846;
constexpr double kSigmas = 4.5;

/// A white ball of few facets with smooth normals, seen from +z.
core::SceneDescription ball(int stacks, const core::MaterialDescription& material) {
  core::SceneDescription scene =
      test_support::scene_of({material}, {test_support::sphere({0, 0, 0}, 1, stacks, false, 0)});
  scene.cameras.push_back(test_support::front_camera());
  return scene;
}

struct Terminator {
  double error = 0;  ///< mean absolute difference from a perfect ball
  double darkest =
      1;  ///< minimum ratio to the radiance of the perfect ball, where its cosine is above 0.25
  double leak = 0;  ///< maximum radiance where the perfect ball's cosine is below -0.05
};

/// flat: without the smooth normals.
Terminator lit_from_the_side(int stacks, bool flat) {
  constexpr int kSide = 48;
  core::SceneDescription scene = ball(stacks, test_support::lambert({1, 1, 1}));
  if (flat) {
    scene.meshes[0].primitives[0].normals.clear();
  }
  const Vec3 wi = test_support::towards(80, 25);
  scene.lights.push_back(test_support::sun(wi, Rgb(static_cast<float>(kPi))));
  const Picture picture =
      test_support::shoot_glb(scene, {.width = kSide, .height = kSide, .samples = 64});
  Terminator out;
  int count = 0;
  for (int y = 0; y < kSide; ++y) {
    for (int x = 0; x < kSide; ++x) {
      const double px = (x + 0.5) / kSide * 2 - 1;
      const double py = 1 - (y + 0.5) / kSide * 2;
      if (px * px + py * py > 0.85 * 0.85) {
        continue;  // the silhouette is that of the facets
      }
      const double pz = std::sqrt(1 - px * px - py * py);
      const double cosine = px * static_cast<double>(wi.x) + py * static_cast<double>(wi.y) +
                            pz * static_cast<double>(wi.z);
      const auto seen = static_cast<double>(pixel(picture, x, y).g);
      out.error += std::fabs(seen - std::max(cosine, 0.0));
      ++count;
      if (cosine > 0.25) {
        out.darkest = std::min(out.darkest, seen / cosine);
      }
      if (cosine < -0.05) {
        out.leak = std::max(out.leak, seen);
      }
    }
  }
  out.error /= count;
  return out;
}

TEST(GltfTerminator, CoarseBallIsShadedLikeASphere) {
  // 8 stacks: facets of 22.5 degrees. Their horizons would cut off the light where the cosine is
  // below sin(11 degrees) at a corner, 0.2 and more along a diagonal; interpolated normals of a
  // chord are right within 1%.
  const Terminator round = lit_from_the_side(8, false);
  EXPECT_LT(round.error, 0.012);
  EXPECT_GT(round.darkest, 0.9);
  EXPECT_LT(round.leak, 0.02);
  const Terminator facets = lit_from_the_side(8, true);  // the planted fault, which must fail
  EXPECT_GT(facets.error, 0.03);
  EXPECT_LT(facets.darkest, 0.8);
}

/// A box with eight vertices and averaged normals.
core::PrimitiveDescription smooth_box(Vec3 at, Vec3 size, int material) {
  core::PrimitiveDescription p;
  p.material = material;
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner = {static_cast<float>(i & 1), static_cast<float>(i >> 1 & 1),
                         static_cast<float>(i >> 2)};
    p.positions.push_back(at + corner * size);
    p.normals.push_back(core::normalize(corner * 2 - Vec3{1, 1, 1}));
  }
  p.indices = {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
               2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5};
  return p;
}

/// Mean radiance in a closed room in a white sky, seen from inside.
double light_in_a_closed_room(core::PrimitiveDescription body) {
  using test_support::quad;
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert({0.8F, 0.8F, 0.8F})},
      {quad({-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, 0), quad({-2, 2.1F, -2}, {4, 0, 0}, {0, 0, 4}, 0),
       quad({-2, 0, -2}, {4, 0, 0}, {0, 2.1F, 0}, 0), quad({-2, 0, 2}, {0, 2.1F, 0}, {4, 0, 0}, 0),
       quad({-2, 0, -2}, {0, 2.1F, 0}, {0, 0, 4}, 0), quad({2, 0, -2}, {0, 0, 4}, {0, 2.1F, 0}, 0),
       std::move(body)});
  core::View view = test_support::view_of(std::move(scene), 32, 32);
  test_support::look_at(view, {0.3F, 0.8F, 1.9F}, {0, 0.4F, 0}, 70);
  view.environment = test_support::constant_sky({1, 1, 1});
  return static_cast<double>(test_support::render(view, 64).mean().g);
}

TEST(GltfTerminator, NoLightEntersAClosedRoomThroughWhatStandsInIt) {
  // A cabinet whose top is 0.1 below the ceiling, and a ball sunk into the floor: rays that left
  // from a smooth surface above their facets would start outside.
  EXPECT_EQ(light_in_a_closed_room(smooth_box({-1, 0, -1}, {2, 2, 2}, 0)), 0);
  for (const int stacks : {5, 8, 12}) {
    EXPECT_EQ(light_in_a_closed_room(test_support::sphere({0, 0.25F, 0}, 0.5F, stacks, false, 0)),
              0)
        << stacks;
  }
}

TEST(GltfTerminator, WhatStandsOnASmoothBoxCastsItsContactShadow) {
  // A black wall of height h across a white slab, under a white sky: at a distance d the wall hides
  // (1 - d / sqrt(d^2 + h^2)) / 2 of the light. In the middle of the slab the normal is upright.
  constexpr double kDistance = 0.05;
  constexpr double kHeight = 1;
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert({1, 1, 1}), test_support::lambert({0, 0, 0})},
                             {smooth_box({-1, -0.1F, -1}, {2, 0.1F, 2}, 0),
                              test_support::quad({-40, 0, -0.05F}, {80, 0, 0}, {0, 1, 0}, 1)});
  core::View view = test_support::view_of(std::move(scene), 4, 4);
  test_support::look_at(view, {0, 0.5F, 0.001F}, {0, 0, 0}, 1);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.max_depth = 1;
  const Picture picture = test_support::render(view, 1024);
  const double expected = (1 + kDistance / std::hypot(kDistance, kHeight)) / 2;
  EXPECT_NEAR(picture.mean().g, expected,
              0.01 + kSigmas * static_cast<double>(picture.standard_error().g));
  EXPECT_LT(picture.standard_error().g, 0.01F);
}

TEST(GltfTerminator, LosslessBallsWithShadingNormalsAreInvisible) {
  // Coarse normals, and also with a normal map that tilts by 40 degrees.
  for (const bool mapped : {false, true}) {
    for (const float metallic : {0.0F, 1.0F}) {
      core::MaterialDescription m =
          metallic > 0 ? core::MaterialDescription{} : test_support::lambert({1, 1, 1});
      m.metallic = metallic;
      m.roughness = 0.4F;
      core::SceneDescription scene = ball(5, m);
      if (mapped) {
        scene.materials[0].normal_texture.image = 0;
        test_support::add_image(scene, 1, 1, 3, {210, 128, 226});
        auto& p = scene.meshes[0].primitives[0];
        p.tangents.clear();
        for (const Vec3 n : p.normals) {
          const Vec3 t = core::normalize_or(core::cross({0, 1, 0}, n), {1, 0, 0});
          p.tangents.push_back({t.x, t.y, t.z, 1});
        }
        if (p.uv[0].empty()) {
          p.uv[0].assign(p.positions.size(), {0, 0});
        }
      }
      const Picture picture =
          test_support::shoot_glb(scene, {.width = 16,
                                          .height = 16,
                                          .samples = 256,
                                          .depth = 128,
                                          .sky = test_support::constant_sky({1, 1, 1})});
      const auto mean = static_cast<double>(picture.mean().g);
      const auto error = static_cast<double>(picture.standard_error().g);
      EXPECT_NEAR(mean, 1, 5e-3 + kSigmas * error) << mapped << " " << metallic;
      EXPECT_LT(error, 2e-3) << mapped << " " << metallic;
    }
  }
}

TEST(GltfTerminator, StrategiesAgreeOnShadingNormals) {
  // A small coarse ball next to an emitter of its size: light sampling, BSDF sampling and both
  // render one image.
  core::SceneDescription scene = ball(6, test_support::lambert({0.8F, 0.8F, 0.8F}));
  scene.materials.push_back(test_support::emitter({5, 5, 5}));
  scene.meshes[0].primitives.push_back(
      test_support::quad({1.5F, -0.5F, 0.5F}, {0, 1, 0}, {0, 0, -1}, 1));
  Picture reference;
  for (const core::Strategy strategy :
       {core::Strategy::kMis, core::Strategy::kBsdf, core::Strategy::kLight}) {
    core::View view = test_support::view_of(scene, 24, 24);
    view.settings.max_depth = 3;
    view.settings.estimator.strategy = strategy;
    view.settings.seed = static_cast<std::uint64_t>(strategy);
    const Picture picture = test_support::render(view, 1024);
    if (strategy == core::Strategy::kMis) {
      reference = picture;
      continue;
    }
    const double error = std::hypot(static_cast<double>(picture.standard_error().g),
                                    static_cast<double>(reference.standard_error().g));
    EXPECT_NEAR(picture.mean().g, reference.mean().g, kSigmas * error)
        << static_cast<int>(strategy);
    EXPECT_LT(error, 0.01 * static_cast<double>(reference.mean().g));
  }
}

TEST(GltfSides, SingleSidedSurfacesAreVisibleFromBehindButEmitOnlyToTheFront) {
  // Back faces are not culled, for camera and shadow rays: as in path tracers. A sun behind a
  // single-sided patch lights the side that the camera sees, its back.
  core::SceneDescription scene = test_support::stage(test_support::lambert({0.5F, 0.5F, 0.5F}));
  auto& p = scene.meshes[0].primitives[0];
  p.indices = {0, 2, 1, 0, 3, 2};  // faces away
  p.normals.assign(4, {0, 0, -1});
  scene.materials[0].emissive = {3, 3, 3};
  const auto seen = [&scene](double degrees, bool double_sided) {
    core::SceneDescription with = scene;
    with.materials[0].double_sided = double_sided;
    with.lights.push_back(test_support::sun(test_support::towards(degrees), {1, 1, 1}));
    return static_cast<double>(pixel(test_support::shoot_glb(with, {}), 4, 4).g);
  };
  EXPECT_NEAR(seen(0, false), 0.5 / kPi, 1e-5);
  EXPECT_NEAR(seen(180, false), 0, 1e-6);  // the surface shadows itself
  EXPECT_NEAR(seen(0, true), 0.5 / kPi + 3, 1e-4);
  // The emission, found by light sampling, by BSDF sampling and by both, reaches a floor in front
  // but none behind.
  for (const bool in_front : {false, true}) {
    for (const core::Strategy strategy :
         {core::Strategy::kMis, core::Strategy::kBsdf, core::Strategy::kLight}) {
      core::SceneDescription room = test_support::scene_of(
          {test_support::lambert({1, 1, 1}), test_support::emitter({1, 1, 1})},
          {test_support::patch(),
           test_support::quad({-0.5F, -0.5F, 1}, in_front ? Vec3{0, 1, 0} : Vec3{1, 0, 0},
                              in_front ? Vec3{1, 0, 0} : Vec3{0, 1, 0}, 1)});
      room.cameras.push_back(test_support::front_camera(0.01F));
      room.cameras[0].to_world.t.z = 0.5F;
      core::View view = test_support::view_of(room, 4, 4);
      view.settings.max_depth = 1;
      view.settings.estimator.strategy = strategy;
      const Picture picture = test_support::render(view, 4096);
      // Truth 4: a unit square of radiance 1 at distance 1 gives 0.7522747.
      const double expected = in_front ? 0.7522747 / kPi : 0;
      EXPECT_NEAR(static_cast<double>(picture.mean().g), expected,
                  kSigmas * static_cast<double>(picture.standard_error().g) + 1e-4 * expected)
          << in_front << " " << static_cast<int>(strategy);
    }
  }
}

TEST(GltfUnlit, MirrorsReflectItAndItLightsDiffuseSurfacesByEveryStrategy) {
  core::MaterialDescription wall;
  wall.unlit = true;
  wall.base_color = {0.2F, 0.4F, 0.6F};
  // The wall is a unit square 1 m in front of the patch; the camera is between them.
  for (const bool shiny : {true, false}) {
    for (const core::Strategy strategy :
         {core::Strategy::kMis, core::Strategy::kBsdf, core::Strategy::kLight}) {
      core::SceneDescription scene = test_support::scene_of(
          {shiny ? test_support::mirror() : test_support::lambert({1, 1, 1}), wall},
          {test_support::patch(), test_support::quad({-0.5F, -0.5F, 1}, {0, 1, 0}, {1, 0, 0}, 1)});
      scene.cameras.push_back(test_support::front_camera(0.01F));
      scene.cameras[0].to_world.t.z = 0.5F;
      core::View view = test_support::view_of(scene, 4, 4);
      view.settings.max_depth = 1;
      view.settings.estimator.strategy = strategy;
      const Picture picture = test_support::render(view, 4096);
      for (int c = 0; c < 3; ++c) {
        const double expected =
            static_cast<double>(wall.base_color[c]) * (shiny ? 1 : 0.7522747 / kPi);
        EXPECT_NEAR(static_cast<double>(picture.mean()[c]), expected,
                    kSigmas * static_cast<double>(picture.standard_error()[c]) + 1e-4 * expected)
            << shiny << " " << static_cast<int>(strategy);
      }
    }
  }
}

}  // namespace
