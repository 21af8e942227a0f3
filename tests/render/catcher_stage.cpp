#include "tests/render/catcher_stage.h"

#include <cmath>
#include <utility>

#include "core/scene/ground.h"

namespace catcher_stage {

using core::BackgroundType;
using core::GroundType;
using core::Rgb;
using core::Vec3;
using test_support::emitter;
using test_support::lambert;
using test_support::quad;
using test_support::scene_of;
using test_support::sphere;

core::SceneDescription model() {
  auto scene = scene_of(
      {lambert({0.8F, 0.3F, 0.2F}), emitter({2, 2, 3})},
      {sphere({0, 1, 0}, 1, 12, false, 0), quad({1.6F, 1, -0.4F}, {0, 0, 0.8F}, {0, 0.8F, 0}, 1)});
  core::PunctualLightDescription sun;
  sun.type = core::PunctualType::kDirectional;
  sun.intensity = {1.5F, 1.4F, 1};
  // Emits along -z of its frame: from the left, at an elevation of 45 degrees.
  sun.to_world.z = normalize(Vec3{-1, 1, 0.2F});
  sun.to_world.x = normalize(cross(Vec3{0, 1, 0}, sun.to_world.z));
  sun.to_world.y = cross(sun.to_world.z, sun.to_world.x);
  scene.lights = {sun};
  return scene;
}

std::shared_ptr<const core::Environment> sky() {
  return test_support::sky_map(16, 8, [](int x, int y) {
    return y < 4 ? Rgb{0.3F, 0.4F, 0.6F} * static_cast<float>(1 + (x == 3 && y == 2 ? 20 : 0))
                 : Rgb{0.2F, 0.2F, 0.1F};
  });
}

namespace {

core::PunctualLightDescription spot_from_above() {
  core::PunctualLightDescription spot;
  spot.type = core::PunctualType::kSpot;
  spot.intensity = {40, 44, 50};
  spot.inner_cone_rad = 0.6F;
  spot.outer_cone_rad = 0.9F;
  spot.to_world.z = normalize(Vec3{-1, 3, 1});
  spot.to_world.x = normalize(cross(Vec3{0, 1, 0}, spot.to_world.z));
  spot.to_world.y = cross(spot.to_world.z, spot.to_world.x);
  spot.to_world.t = {-1.5F, 5, 1.5F};
  return spot;
}

}  // namespace

std::vector<Subject> subjects() {
  core::MaterialDescription gold = lambert({1, 0.8F, 0.4F});
  gold.metallic = 1;
  gold.roughness = 0.3F;
  core::MaterialDescription coated = lambert({0.8F, 0.1F, 0.1F});
  coated.specular = 1;
  coated.roughness = 0.8F;
  coated.clearcoat = 1;
  core::MaterialDescription glass;
  glass.base_color = {0.9F, 1, 0.9F};
  glass.metallic = 0;
  glass.roughness = 0.2F;
  glass.transmission = 1;
  glass.thickness = 1;
  std::vector<Subject> out = {
      {"glossy",
       scene_of({gold, coated}, {sphere({0.8F, 0.7F, 0}, 0.7F, 12, false, 0),
                                 sphere({-0.8F, 0.6F, 0.3F}, 0.6F, 12, false, 1)}),
       sky()},
      {"glass", scene_of({glass}, {sphere({0, 1, 0}, 1, 12, false, 0)}), sky()},
      {"lamp",
       scene_of({emitter({3, 2, 1}), test_support::mirror()},
                {sphere({0.3F, 0.5F, 0.6F}, 0.25F, 8, false, 0),
                 quad({-1.2F, 0.1F, -0.8F}, {2.4F, 0, 0}, {0, 1.8F, 0}, 1)}),
       nullptr}};
  out[1].scene.lights = model().lights;
  out[2].scene.lights = {spot_from_above()};
  return out;
}

core::View view_of(core::SceneDescription scene, GroundType kind, float reflection) {
  core::GroundSettings ground = {GroundType::kCatcher, 0.0F, kGroundColor, reflection, {}};
  core::add_ground(scene, ground);
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  test_support::look_at(view, {0.5F, 7, 5}, {0, 0.5F, 0}, 50);
  view.environment = sky();
  ground.type = kind;
  ground.shadow.color = core::ShadowColor::kPhysical;
  view.settings.ground = ground;
  view.settings.max_depth = 6;
  return view;
}

core::View bare_view(core::SceneDescription scene, float reflection) {
  scene.instances.clear();
  scene.meshes.clear();
  return view_of(std::move(scene), GroundType::kNone, reflection);
}

core::View transparent_catcher(core::SceneDescription scene, float reflection) {
  core::View view = view_of(std::move(scene), GroundType::kCatcher, reflection);
  view.settings.background.type = BackgroundType::kTransparent;
  view.settings.film.errors_over_white = true;
  return view;
}

Picture render(core::View view, std::uint64_t seed, int samples) {
  view.settings.seed = seed;
  return test_support::render(view, samples);
}

HalvesOfPixel halves(const Picture& picture) {
  return [&picture](std::size_t i) {
    return Halves{core::half_value(picture.snapshot, i, 0).mean,
                  core::half_value(picture.snapshot, i, 1).mean};
  };
}

double largest_z(const HalvesOfPixel& first, const HalvesOfPixel& second) {
  double most = 0;
  for (int by = 0; by < kSide; by += 4) {
    for (int bx = 0; bx < kSide; bx += 4) {
      std::array<double, 3> difference{};
      std::array<double, 3> variance{};
      for (int k = 0; k < 16; ++k) {
        const auto i = static_cast<std::size_t>((by + k / 4) * kSide + bx + k % 4);
        const Halves a = first(i);
        const Halves b = second(i);
        for (int c = 0; c < 3; ++c) {
          const auto n = static_cast<std::size_t>(c);
          const auto at = [c](Rgb v) { return static_cast<double>(v[c]); };
          difference[n] += 0.5 * (at(a[0]) + at(a[1]) - at(b[0]) - at(b[1]));
          variance[n] += 0.25 * std::pow(at(a[0]) - at(a[1]), 2);
          variance[n] += 0.25 * std::pow(at(b[0]) - at(b[1]), 2);
        }
      }
      for (std::size_t n = 0; n < 3; ++n) {
        if (variance[n] > 0) {
          most = std::max(most, std::fabs(difference[n]) / std::sqrt(variance[n]));
        }
      }
    }
  }
  return most;
}

HalvesOfPixel over(const Picture& caught, const Picture& bare, float alpha_scale,
                   float light_scale) {
  return [&, alpha_scale, light_scale](std::size_t i) {
    Halves out;
    for (int half = 0; half < 2; ++half) {
      const core::HalfValue c = core::half_value(caught.snapshot, i, half);
      const float light = c.alpha < 1 ? light_scale : 1.0F;
      out[static_cast<std::size_t>(half)] =
          c.mean * light +
          core::half_value(bare.snapshot, i, half).mean * (1 - alpha_scale * c.alpha);
    }
    return out;
  };
}

}  // namespace catcher_stage
