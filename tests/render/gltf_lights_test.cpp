// KHR_lights_punctual, cameras and alpha: incident light, and coverage. Nothing here is noisy
// except BLEND seen by the camera.
#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using test_support::Picture;
using test_support::pixel;

constexpr double kPi = 3.14159265358979323846;

TEST(GltfLights, DirectionalLightsPointLightsAndRangesFollowTheFormulas) {
  const double albedo = 0.6;
  core::SceneDescription scene = test_support::stage(test_support::lambert(Rgb(0.6F)));
  scene.lights.push_back(test_support::sun(test_support::towards(40, 70), {2, 1, 0.5F}));
  Rgb seen = pixel(test_support::shoot_glb(scene, {}), 4, 4);
  for (int c = 0; c < 3; ++c) {
    const double lux = std::array{2.0, 1.0, 0.5}[static_cast<std::size_t>(c)];
    EXPECT_NEAR(static_cast<double>(seen[c]), albedo / kPi * lux * std::cos(40 * kPi / 180), 2e-6);
  }
  for (const double range : {0.0, 2.5}) {
    core::PunctualLightDescription point;
    point.intensity = {3, 3, 3};
    point.range_m = static_cast<float>(range);
    point.to_world.t = {0, 0, 2};
    scene.lights = {point};
    // One pixel in the centre, so small that the distance is 2 m within 1e-5.
    scene.cameras = {test_support::front_camera(0.002F)};
    seen = pixel(test_support::shoot_glb(scene, {}), 4, 4);
    const double window = range > 0 ? std::clamp(1 - std::pow(2 / range, 4), 0.0, 1.0) : 1;
    EXPECT_NEAR(static_cast<double>(seen.g), albedo / kPi * 3 / 4 * window, 1e-6) << range;
  }
}

TEST(GltfLights, SpotFadesBetweenItsCones) {
  const double inner = 0.2;
  const double outer = 0.6;
  core::SceneDescription scene = test_support::stage(test_support::lambert({1, 1, 1}));
  core::PunctualLightDescription spot;
  spot.type = core::PunctualType::kSpot;
  spot.intensity = {5, 5, 5};
  spot.inner_cone_rad = static_cast<float>(inner);
  spot.outer_cone_rad = static_cast<float>(outer);
  spot.to_world.t = {0, 0, 1};
  scene.lights.push_back(spot);
  const int width = 101;
  const Picture picture =
      test_support::shoot_glb(scene, {.width = width, .height = width, .samples = 16});
  for (int x = 0; x < width; x += 5) {
    const double across = (x + 0.5) / width * 2 - 1;
    const double c = 1 / std::sqrt(1 + across * across);  // cosine of the angle, and 1 m / distance
    const double fade =
        std::clamp((c - std::cos(outer)) / (std::cos(inner) - std::cos(outer)), 0.0, 1.0);
    const double expected = 5 / kPi * c * c * c * fade * fade;
    EXPECT_NEAR(static_cast<double>(pixel(picture, x, width / 2).r), expected, 0.01) << x;
  }
}

TEST(GltfCameras, MagnificationIsHalfTheHeightAndYfovTheFullAngle) {
  core::MaterialDescription m;
  m.unlit = true;
  core::SceneDescription scene = test_support::stage(m);
  scene.cameras = {test_support::front_camera(2)};  // the patch covers half of the height
  Picture picture = test_support::shoot_glb(scene, {.width = 40, .height = 20, .samples = 4});
  const auto covered = [&picture] {
    float sum = 0;
    for (int y = 0; y < 20; ++y) {
      for (int x = 0; x < 40; ++x) {
        sum += pixel(picture, x, y).r;
      }
    }
    return sum;
  };
  EXPECT_NEAR(covered(), 10 * 10, 1e-3F);  // 20 px are 4 m, whatever the width
  core::CameraDescription eye;
  eye.name = "eye";
  eye.vertical_fov_rad = static_cast<float>(2 * std::atan(0.2));  // 10 m away, 4 m high
  eye.to_world.t = {0, 0, 10};
  scene.cameras = {eye};
  picture = test_support::shoot_glb(scene, {.width = 40, .height = 20, .samples = 4});
  EXPECT_NEAR(covered(), 10 * 10, 1e-3F);
}

/// A veil 0.5 m above the patch: unlit, alpha 0 to 1 from left to right.
core::SceneDescription veiled(core::AlphaMode mode, float cutoff) {
  core::SceneDescription scene = test_support::stage(test_support::lambert({1, 1, 1}));
  core::MaterialDescription veil;
  veil.alpha_mode = mode;
  veil.alpha_cutoff = cutoff;
  veil.base_color_texture.image = 0;
  veil.unlit = true;
  scene.materials.push_back(veil);
  std::vector<int> texels;
  for (int x = 0; x < 8; ++x) {
    texels.insert(texels.end(), {255, 255, 255, 32 * x + 16});
  }
  test_support::add_image(scene, 8, 1, 4, texels);
  return scene;
}

TEST(GltfAlpha, HolesTransmitOneMinusAlpha) {
  // The camera views the floor from below the veil; the sun shines through it. A blended veil
  // attenuates the light by its transmittance, so the floor shows 1 - alpha without noise.
  for (const bool blend : {false, true}) {
    core::SceneDescription scene =
        veiled(blend ? core::AlphaMode::kBlend : core::AlphaMode::kMask, 0.5F);
    scene.materials[1].base_color_texture.nearest = true;
    scene.materials[1].unlit = false;  // an unlit veil would illuminate the floor
    scene.meshes[0].primitives.push_back(test_support::patch(0.5F, 1));
    scene.cameras[0].to_world.t = {0, 0, 0.25F};
    scene.lights.push_back(test_support::sun({0, 0, 1}, {1, 1, 1}));
    const Picture picture = test_support::shoot_glb(scene, {});
    for (int x = 0; x < 8; ++x) {
      const double alpha = (32 * x + 16) / 255.0;
      const double open = blend ? 1 - alpha : (alpha < 0.5 ? 1 : 0);
      EXPECT_NEAR(static_cast<double>(pixel(picture, x, 4).r), open / kPi, 1e-5) << x << blend;
    }
  }
}

TEST(GltfAlpha, CoverageIsAlphaForBlendAndAStepForMask) {
  for (const float cutoff : {0.0F, 0.3F, 1.1F, -1.0F}) {  // the last one: BLEND
    const bool blend = cutoff < 0;
    core::SceneDescription scene =
        veiled(blend ? core::AlphaMode::kBlend : core::AlphaMode::kMask, cutoff);
    scene.materials[1].base_color_texture.nearest = true;
    scene.meshes[0].primitives = {test_support::patch(0.5F, 1)};
    const Picture picture = test_support::shoot_glb(scene, {.samples = 256});
    for (int x = 0; x < 8; ++x) {
      double mean = 0;
      for (int y = 0; y < 8; ++y) {
        mean += static_cast<double>(pixel(picture, x, y).r) / 8;
      }
      const double alpha = (32 * x + 16) / 255.0;
      const double expected = blend ? alpha : (alpha >= static_cast<double>(cutoff) ? 1 : 0);
      // 2048 Bernoulli trials: at most 5 standard deviations, one false alarm in 10^5 runs of the
      // test.
      EXPECT_NEAR(mean, expected, 5 * std::sqrt(expected * (1 - expected) / 2048) + 1e-6)
          << x << " " << cutoff;
    }
  }
}

TEST(GltfAlpha, BlendedLayersCompositeByDepthNotByFileOrder) {
  const auto layer = [](Rgb color, float alpha) {
    core::MaterialDescription m;
    m.unlit = true;
    m.alpha_mode = core::AlphaMode::kBlend;
    m.base_color = color;
    m.base_alpha = alpha;
    return m;
  };
  const double expected[3] = {0.7 * 1, 0.3 * 0.4 * 1, 0.3 * 0.6 * 1};  // red over green over blue
  for (const bool swapped : {false, true}) {
    core::SceneDescription scene = test_support::stage(layer({1, 0, 0}, 0.7F));
    scene.materials.push_back(layer({0, 1, 0}, 0.4F));
    scene.materials.push_back(layer({0, 0, 1}, 1));
    auto& p = scene.meshes[0].primitives;
    p = {test_support::patch(0.2F, 0), test_support::patch(0.1F, 1), test_support::patch(0, 2)};
    if (swapped) {
      std::reverse(p.begin(), p.end());
    }
    const Picture picture = test_support::shoot_glb(scene, {.samples = 256});
    const Rgb mean = picture.mean();
    for (int c = 0; c < 3; ++c) {
      // 16384 trials: 5 standard deviations.
      EXPECT_NEAR(static_cast<double>(mean[c]), expected[c],
                  5 * std::sqrt(expected[c] * (1 - expected[c]) / 16384));
    }
  }
}

TEST(GltfAlpha, ColorBehindHolesDoesNotBleedInMinifiedTextures) {
  // Green where alpha is 1, black where it is 0, in stripes of one texel; the whole texture
  // projects to one pixel. Covered samples must all be green.
  core::MaterialDescription m;
  m.unlit = true;
  m.alpha_mode = core::AlphaMode::kMask;
  m.base_color_texture.image = 0;
  m.base_color_texture.nearest = true;
  core::SceneDescription scene = test_support::stage(m);
  std::vector<int> texels;
  for (int i = 0; i < 64 * 64; ++i) {
    texels.insert(texels.end(), {0, i % 2 * 255, 0, i % 2 * 255});
  }
  test_support::add_image(scene, 64, 64, 4, texels);
  // The GLB writer would lose the colour where alpha is 0, so this scene goes straight to the
  // renderer.
  const Picture picture = test_support::shoot(scene, {.width = 1, .height = 1, .samples = 1024});
  EXPECT_NEAR(pixel(picture, 0, 0).g, 0.5F, 5 * 0.5F / 32);
}

}  // namespace
