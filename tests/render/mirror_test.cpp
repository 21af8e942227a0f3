// A scene under a node of scale -1 gives the mirrored picture, in every integrator: fronts of
// emitters, insides of solids, tangents and lights turn with it.
#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/render/agreement.h"
#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using core::Transform;
using test_support::Blocks;
using test_support::kBlocksAcross;

struct Mirror {
  bool is_on = true;
  /// Planted faults.
  bool spot_stays = false;
  bool bumps_stay = false;
};

/// A bumpy floor and wall, brushed metal, a glass ball, an emitter that shines forwards only, and a
/// spot; nothing is symmetric.
core::SceneDescription scene_of(const Mirror& mirror) {
  core::MaterialDescription bumpy = test_support::lambert({0.7F, 0.6F, 0.5F});
  bumpy.normal_texture.image = 0;
  core::MaterialDescription brushed;
  brushed.metallic = 1;
  brushed.roughness = 0.5F;
  brushed.anisotropy = 0.8F;
  brushed.anisotropy_rotation_rad = 0.6F;
  core::MaterialDescription glass = test_support::lambert(Rgb(1));
  glass.specular = 1;
  glass.roughness = 0.4F;
  glass.transmission = 1;
  glass.thickness = 1;
  glass.attenuation_distance = 0.5F;
  glass.attenuation_color = {0.3F, 0.6F, 0.9F};
  core::SceneDescription scene = test_support::scene_of(
      {bumpy, brushed, glass, test_support::emitter(Rgb(8))},
      {test_support::quad({-1.5F, 0, 1.5F}, {3, 0, 0}, {0, 0, -3}, 0),
       test_support::quad({-1.5F, 0, -1}, {3, 0, 0}, {0, 2, 0}, 0),
       test_support::quad({0.2F, 0, -0.6F}, {0.9F, 0, 0.5F}, {0, 0.8F, -0.2F}, 1),
       test_support::sphere({-0.6F, 0.4F, 0.3F}, 0.35F, 8, false, 2),
       test_support::quad({-1.4F, 1, -0.5F}, {0, 0.6F, 0}, {0, 0, 0.6F}, 3)});
  // Tilted along the tangent and, on the right side, along the bitangent.
  test_support::add_image(scene, 1, 1, 3, {170, mirror.bumps_stay ? 86 : 170, 225});
  core::PunctualLightDescription spot;
  spot.type = core::PunctualType::kSpot;
  spot.intensity = {1, 2, 3};
  spot.to_world = core::translation({0.7F, 1.6F, 0.6F}) *
                  core::rotation({-std::sqrt(0.5F), 0, 0, std::sqrt(0.5F)});  // -z turned downwards
  const Transform map = core::scaling({mirror.is_on ? -1.0F : 1.0F, 1, 1});
  scene.instances[0].to_world = map;
  if (!mirror.spot_stays) {
    spot.to_world = map * spot.to_world;
  }
  scene.lights.push_back(spot);
  return scene;
}

Blocks blocks_of(std::string_view integrator, const Mirror& mirror, int first_seed) {
  const core::SceneDescription scene = test_support::load(core::write_glb(scene_of(mirror)));
  core::View view = test_support::view_of(scene, 16, 16);
  const float x = mirror.is_on ? -1.0F : 1.0F;
  test_support::look_at(view, {0.3F * x, 1, 3.2F}, {0.1F * x, 0.5F, 0}, 36);
  view.environment = test_support::constant_sky(Rgb(0.1F));
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(integrator);
  view.settings.film = film;
  view.settings.max_depth = integrator == "direct" ? 1 : 4;
  view.settings.photons.paths = 1000;
  view.settings.cache.rays = 64;
  const bool is_light = integrator == "light-trace";
  Blocks out = test_support::blocks_of(std::move(view), first_seed, is_light ? 64 : 16);
  if (mirror.is_on) {
    for (test_support::BlockSums& sums : out) {
      for (std::size_t row = 0; row < kBlocksAcross; ++row) {
        for (std::size_t column = 0; column < kBlocksAcross / 2; ++column) {
          const auto at = [&](std::size_t c) {
            return sums.begin() + static_cast<std::ptrdiff_t>(3 * (row * kBlocksAcross + c));
          };
          std::swap_ranges(at(column), at(column) + 3, at(kBlocksAcross - 1 - column));
        }
      }
    }
  }
  return out;
}

class Mirrored : public testing::TestWithParam<std::string> {};

TEST_P(Mirrored, SceneGivesTheMirroredPicture) {
  const auto comparisons = static_cast<int>(core::integrators().size());
  const Blocks plain = blocks_of(GetParam(), {.is_on = false}, 1000);
  const auto agreement = test_support::compare(blocks_of(GetParam(), {}, 1), plain);
  EXPECT_TRUE(test_support::agrees(agreement, comparisons))
      << "image " << agreement.image << ", block " << agreement.block << ", squares "
      << agreement.squares;
  const auto is_seen = [&](const Mirror& fault) {
    return !test_support::agrees(test_support::compare(blocks_of(GetParam(), fault, 1), plain),
                                 comparisons);
  };
  if (GetParam() != "ao") {  // knows no lights
    EXPECT_TRUE(is_seen({.spot_stays = true}));
  }
  EXPECT_TRUE(is_seen({.bumps_stay = true}));
}

std::vector<std::string> rows() {
  std::vector<std::string> names;
  for (const core::IntegratorEntry& row : core::integrators()) {
    // The order in which a cache is filled, row by row, has no mirror image.
    if (row.name != core::kAutomaticIntegrator && !row.keeps_prepass) {
      names.emplace_back(row.name);
    }
  }
  return names;
}
INSTANTIATE_TEST_SUITE_P(AllRows, Mirrored, testing::ValuesIn(rows()), [](const auto& row) {
  std::string name = row.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
});

}  // namespace
