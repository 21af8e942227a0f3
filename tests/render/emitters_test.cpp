// One emitter, seen alike by rays and by light samples: alpha, coats, unlit surfaces, textures,
// punctual lights, maps and presets light a room in the same way under every row of the integrator
// registry, and as their closed forms say.
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "core/light_samplers/light_sampler.h"
#include "core/lights/made_environment.h"
#include "core/settings/choices.h"
#include "tests/render/agreement.h"
#include "tests/render/gltf_stage.h"
#include "tests/support/statistics.h"

namespace {

using core::AlphaMode;
using core::MaterialDescription;
using core::Rgb;
using core::SceneDescription;
using core::Vec3;
using test_support::Blocks;

// Light samples that only MIS completes cannot be passed where samples of all light are needed.
static_assert(!std::is_convertible_v<const core::MisLightSampler&, const core::LightSampler&>);

constexpr float kAlbedo = 0.5F;

MaterialDescription lamp() {
  MaterialDescription m = test_support::emitter(Rgb(2));
  m.double_sided = true;
  return m;
}

MaterialDescription unlit(Rgb color) {
  MaterialDescription m = test_support::lambert(color);
  m.unlit = true;
  return m;
}

MaterialDescription with_alpha(MaterialDescription m, AlphaMode mode, float alpha) {
  m.alpha_mode = mode;
  m.base_alpha = alpha;
  return m;
}

/// A lamp of 1 m x 1 m, 1 m over the middle of a grey floor. Texture coordinates cover it once.
SceneDescription room(const MaterialDescription& material) {
  core::PrimitiveDescription panel = test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1);
  return test_support::scene_of(
      {test_support::lambert(Rgb(kAlbedo)), material},
      {test_support::quad({-3, 0, 3}, {6, 0, 0}, {0, 0, -6}, 0), std::move(panel)});
}

/// RGBA texels, of which the right half are holes.
int half_of_it(SceneDescription& scene) {
  return test_support::add_image(scene, 2, 1, 4, {255, 255, 255, 255, 255, 255, 255, 0});
}

SceneDescription half_masked(MaterialDescription material) {
  material.alpha_mode = AlphaMode::kMask;
  SceneDescription scene = room(material);
  scene.materials[1].base_color_texture.image = half_of_it(scene);
  scene.materials[1].base_color_texture.nearest = true;
  return scene;
}

/// Alpha of the vertices rises from 0 to 1 along z.
SceneDescription faded(MaterialDescription material) {
  material.alpha_mode = AlphaMode::kBlend;
  SceneDescription scene = room(material);
  for (const Vec3 p : scene.meshes[0].primitives[1].positions) {
    scene.meshes[0].primitives[1].colors.push_back({1, 1, 1, p.z > 0 ? 1.0F : 0.0F});
  }
  return scene;
}

// Closed forms: the radiance of the floor in the middle, by one scattering.

/// Integrates L cos^2 / d^2 over the lamp; radiance(x, z, cosine): what it emits downwards.
template <typename Radiance>
double floor_radiance(Radiance&& radiance) {
  constexpr int kCells = 400;
  constexpr double kCell = 1.0 / kCells;
  double sum = 0;
  for (int i = 0; i < kCells; ++i) {
    for (int k = 0; k < kCells; ++k) {
      const double x = (i + 0.5) * kCell - 0.5;
      const double z = (k + 0.5) * kCell - 0.5;
      const double d2 = x * x + z * z + 1;
      const double cosine = 1 / std::sqrt(d2);
      sum += radiance(x, z, cosine) * cosine * cosine / d2 * kCell * kCell;
    }
  }
  return static_cast<double>(kAlbedo) / std::numbers::pi * sum;
}

struct Emitter {
  const char* kind;
  const char* name;
  SceneDescription scene;
  double right;
};

std::vector<Emitter> emitters() {
  const auto plain = [](double, double, double) { return 2.0; };
  const double opaque = floor_radiance(plain);
  MaterialDescription coated = lamp();
  coated.clearcoat = 0.8F;
  const double below_coat = floor_radiance([](double, double, double cosine) {
    return 2 * (1 - 0.8 * (0.04 + 0.96 * std::pow(1 - cosine, 5)));
  });
  MaterialDescription unlit_blend = with_alpha(unlit(Rgb(0.6F)), AlphaMode::kBlend, 0.5F);
  std::vector<Emitter> out;
  out.push_back({"area", "opaque", room(lamp()), opaque});
  SceneDescription twice = room(lamp());
  twice.meshes[0].primitives.push_back(twice.meshes[0].primitives[1]);
  out.push_back({"twice", "two in one place", std::move(twice), opaque});
  out.push_back(
      {"alpha", "blend", room(with_alpha(lamp(), AlphaMode::kBlend, 0.3F)), 0.3 * opaque});
  out.push_back(
      {"alpha", "mask, visible", room(with_alpha(lamp(), AlphaMode::kMask, 0.7F)), opaque});
  out.push_back({"alpha", "mask, invisible", room(with_alpha(lamp(), AlphaMode::kMask, 0.3F)), 0});
  out.push_back({"alpha", "blend, invisible", room(with_alpha(lamp(), AlphaMode::kBlend, 0)), 0});
  out.push_back({"alpha", "mask by texture", half_masked(lamp()),
                 floor_radiance([](double x, double, double) { return x < 0 ? 2.0 : 0.0; })});
  out.push_back({"alpha", "fading vertices", faded(lamp()),
                 floor_radiance([](double, double z, double) { return 2 * (z + 0.5); })});
  out.push_back({"coated", "coated", room(coated), below_coat});
  out.push_back({"unlit", "unlit", room(unlit(Rgb(0.6F))), 0.3 * opaque});
  out.push_back({"unlit", "unlit, blend", room(unlit_blend), 0.15 * opaque});
  return out;
}

/// Looks at the middle of the floor only.
core::View middle(SceneDescription scene, std::string_view integrator) {
  core::View view = test_support::view_of(std::move(scene), 8, 8);
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(integrator);
  view.settings.film = film;
  view.settings.max_depth = 1;
  view.settings.photons.paths = 1000;
  test_support::look_at(view, {0, 0.8F, 0.01F}, {0, 0, 0}, 1);
  return view;
}

test_support::Moments measured(core::View view, int samples) {
  test_support::Moments out;
  for (int seed = 1; seed <= 16; ++seed) {
    view.settings.seed = static_cast<std::uint64_t>(seed);
    out.add(static_cast<double>(test_support::render(view, samples).mean().g));
  }
  return out;
}

/// Student's t of 16 images beyond 6.5 by chance: 1e-5 for each of about 100 comparisons. The view
/// covers 14 mm of the floor, over which its radiance changes by less than 1e-3.
bool is_right(const test_support::Moments& seen, double right) {
  return std::fabs(seen.mean - right) <= 6.5 * seen.standard_error() + 2e-3 * right;
}

TEST(Emitters, LightTheFloorAsTheirClosedFormsSayByEveryStrategy) {
  for (const Emitter& emitter : emitters()) {
    for (const core::Strategy strategy :
         {core::Strategy::kMis, core::Strategy::kLight, core::Strategy::kBsdf}) {
      core::View view = middle(emitter.scene, "path");
      view.settings.estimator.strategy = strategy;
      const auto seen = measured(view, strategy == core::Strategy::kBsdf ? 128 : 32);
      EXPECT_TRUE(is_right(seen, emitter.right))
          << emitter.name << ": " << seen.mean << " for " << emitter.right;
      EXPECT_FALSE(is_right(seen, emitter.right * 1.06 + 1e-3)) << "planted, " << emitter.name;
    }
  }
}

TEST(Emitters, LightTheFloorAsTheirClosedFormsSayUnderEveryIntegratorWithoutSplats) {
  for (const Emitter& emitter : emitters()) {
    for (const core::IntegratorEntry& row : core::integrators()) {
      // `auto` runs one of the others. Particles miss so narrow a view; rows that splat are
      // compared with path below.
      if (row.name == core::kAutomaticIntegrator || row.splats) {
        continue;
      }
      const auto seen = measured(middle(emitter.scene, row.name), 16);
      EXPECT_TRUE(is_right(seen, emitter.right))
          << emitter.name << ", " << row.name << ": " << seen.mean << " for " << emitter.right;
      EXPECT_FALSE(is_right(seen, emitter.right * 1.06 + 1e-3))
          << "planted, " << emitter.name << ", " << row.name;
    }
  }
}

TEST(Emitters, InvisibleTrianglesAreNotPicked) {
  const auto picks = [](SceneDescription scene) {
    const auto built = test_support::build(std::move(scene));
    const core::SceneData& data = built->data();
    int out = 0;
    for (std::uint32_t i = 0; i < data.triangle_lights.size(); ++i) {
      out += data.light_tree.prob_light({0, 0, 0}, {0, 1, 0}, i) > 0 ? 1 : 0;
    }
    return out;
  };
  EXPECT_EQ(picks(room(lamp())), 2);
  EXPECT_EQ(picks(room(with_alpha(lamp(), AlphaMode::kMask, 0.3F))), 0);
  EXPECT_EQ(picks(room(with_alpha(lamp(), AlphaMode::kBlend, 0))), 0);
  SceneDescription holes = half_masked(lamp());
  holes.materials[1].alpha_cutoff = 1.5F;
  EXPECT_EQ(picks(std::move(holes)), 0);
}

// KHR_materials_clearcoat, Emission: emission * (1 - clearcoat * fresnel).
TEST(Emitters, ACoatDarkensTheEmissionBelowItTowardsTheViewer) {
  for (const double degrees : {0.0, 60.0, 80.0}) {
    MaterialDescription m = test_support::emitter(Rgb(1));
    m.base_color = Rgb(0);
    m.clearcoat = 1;
    core::View view =
        test_support::view_of(test_support::scene_of({m}, {test_support::patch()}), 4, 4);
    const double angle = degrees * std::numbers::pi / 180;
    test_support::look_at(
        view, {3 * static_cast<float>(std::sin(angle)), 0, 3 * static_cast<float>(std::cos(angle))},
        {0, 0, 0}, 1);
    view.settings.max_depth = 0;
    const double fresnel = 0.04 + 0.96 * std::pow(1 - std::cos(angle), 5);
    EXPECT_NEAR(test_support::render(view, 16).mean().g, 1 - fresnel, 5e-3) << degrees;
  }
}

// A floor under a map of 3 in its upper 3 of 16 rows and .1 below: the light samples of MIS leave
// out the dark part, other ones must not.
TEST(Emitters, TheDarkPartOfAMapLightsTheFloorUnderEveryIntegrator) {
  const double bright = std::pow(std::sin(3 * std::numbers::pi / 16), 2);
  const double right = static_cast<double>(kAlbedo) * (3 * bright + 0.1 * (1 - bright));
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (row.name == core::kAutomaticIntegrator) {
      continue;
    }
    core::View view =
        middle(test_support::scene_of({test_support::lambert(Rgb(kAlbedo))},
                                      {test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0)}),
               row.name);
    test_support::look_at(view, {0, 1, 1}, {0, 0, 0}, 20);
    view.environment =
        test_support::sky_map(32, 16, [](int, int y) { return Rgb(y < 3 ? 3.0F : 0.1F); });
    const auto seen = measured(view, row.splats ? 128 : 32);
    EXPECT_TRUE(is_right(seen, right)) << row.name << ": " << seen.mean << " for " << right;
    EXPECT_FALSE(is_right(seen, 0.924 * right)) << "without the dark part, " << row.name;
  }
}

// The agreement matrix: every row of the registry under every kind of light, on different
// materials, after one or two scatterings. The lights of a kind count together.

struct Light {
  std::string kind;
  SceneDescription scene;
  std::shared_ptr<const core::Environment> sky = nullptr;
};

core::PunctualLightDescription punctual(core::PunctualType type) {
  core::PunctualLightDescription light;
  light.type = type;
  light.intensity = {1, 2, 3};
  light.outer_cone_rad = 0.9F;
  light.to_world =
      core::translation({0.2F, 1.5F, 0.3F}) *
      core::rotation({-std::sqrt(0.5F), 0, 0, std::sqrt(0.5F)});  // -z turned downwards
  return light;
}

/// Materials of the ball that the lights of the list illuminate in turn.
std::vector<MaterialDescription> flags() {
  MaterialDescription glossy;
  glossy.metallic = 0;
  glossy.roughness = 0.5F;
  MaterialDescription brushed;
  brushed.metallic = 1;
  brushed.roughness = 0.6F;
  brushed.anisotropy = 0.7F;
  MaterialDescription coated = glossy;
  coated.clearcoat = 1;
  coated.clearcoat_roughness = 0.5F;
  return {test_support::lambert({0.7F, 0.5F, 0.3F}), glossy, brushed, coated,
          with_alpha(glossy, AlphaMode::kBlend, 0.6F)};
}

/// The floor has base colours, roughness, metal and normals of textures.
void add_textures(SceneDescription& scene) {
  MaterialDescription& floor = scene.materials[0];
  floor = {};
  floor.base_color_texture.image = test_support::add_image(
      scene, 2, 2, 3, {250, 60, 60, 60, 250, 60, 60, 60, 250, 220, 220, 220});
  floor.metallic_roughness_texture.image =  // G roughness, B metallic
      test_support::add_image(scene, 2, 1, 3, {0, 255, 0, 0, 180, 60});
  floor.normal_texture.image = test_support::add_image(
      scene, 2, 2, 3, {150, 128, 250, 128, 150, 250, 106, 128, 250, 128, 106, 250});
  scene.meshes[0].primitives[0].tangents.assign(4, {1, 0, 0, 1});
}

/// With tangents along circles of latitude.
core::PrimitiveDescription ball(int material) {
  const Vec3 center = {-0.9F, 0.35F, 0.2F};
  core::PrimitiveDescription out = test_support::sphere(center, 0.35F, 24, false, material);
  for (const Vec3 n : out.normals) {
    const Vec3 t = normalize_or(cross(Vec3{0, 1, 0}, n), {1, 0, 0});
    out.tangents.push_back({t.x, t.y, t.z, 1});
  }
  return out;
}

/// The floor under 100 quads in three colours and all directions.
SceneDescription many_lamps() {
  SceneDescription scene = room(test_support::emitter({6, 3, 2}));
  scene.meshes[0].primitives.pop_back();
  scene.materials.push_back(test_support::emitter({1, 4, 1}));
  scene.materials.push_back(test_support::emitter({1, 2, 8}));
  test_support::Random random(1);
  const auto within = [&random](Vec3 low, float size) {
    const float x = random.uniform();
    const core::Vec2 yz = random.uniform_2d();
    return low + Vec3{x, yz.x, yz.y} * size;
  };
  for (int i = 0; i < 100; ++i) {
    const Vec3 corner = within({-1.5F, 0.4F, -1.5F}, 2);
    const Vec3 edge = within({-0.1F, -0.1F, -0.1F}, 0.2F);
    scene.meshes[0].primitives.push_back(
        test_support::quad(corner, edge, within({-0.1F, -0.1F, -0.1F}, 0.2F), 1 + i % 3));
  }
  return scene;
}

std::vector<Light> lights() {
  std::vector<Light> out;
  for (Emitter& emitter : emitters()) {
    if (emitter.right > 0 && emitter.kind != std::string_view("twice")) {  // as `opaque`
      out.push_back({emitter.kind, std::move(emitter.scene)});
    }
  }
  SceneDescription textured = room(lamp());
  textured.materials[1].emissive_texture.image =
      test_support::add_image(textured, 2, 2, 3, {255, 80, 40, 0, 0, 0, 60, 255, 90, 90, 60, 255});
  out.push_back({"area", std::move(textured)});
  out.push_back({"many", many_lamps()});
  const SceneDescription dark = room(test_support::lambert(Rgb(0.3F)));
  const auto profile = std::make_shared<const core::IesProfile>(core::IesProfile::Grid{
      core::Photometry::kC, {0, 0.5F, 1.2F}, {0, 6.2831853F}, {3, 2, 0, 3, 2, 0}});
  for (const auto type : {core::PunctualType::kDirectional, core::PunctualType::kPoint,
                          core::PunctualType::kSpot, core::PunctualType::kProfile}) {
    SceneDescription scene = dark;
    scene.meshes[0].primitives.pop_back();  // it would shade the floor
    scene.lights = {punctual(type)};
    if (type == core::PunctualType::kProfile) {
      scene.profiles = {profile};
      scene.lights[0].profile = 0;
    }
    out.push_back({"punctual " + std::to_string(static_cast<int>(type)), std::move(scene)});
  }
  out.push_back({"map", dark, test_support::sky_map(32, 16, [](int x, int y) {
                   return x == 9 && y == 3 ? Rgb(40) : (y < 8 ? Rgb{0.3F, 0.5F, 0.8F} : Rgb(0.1F));
                 })});
  core::EnvironmentSettings noon;
  noon.intensity = 1e-4F;
  noon.sun =
      core::SunSettings{.latitude_degrees = 30, .longitude_degrees = 0, .unix_seconds = 43200};
  out.push_back({"sun and sky", dark, std::move(core::make_environment(noon)).value()});
  for (const auto& preset : core::environment_presets()) {
    core::EnvironmentSettings settings;
    settings.preset = preset.value;
    out.push_back({"preset", dark, std::move(core::make_environment(settings)).value()});
  }
  const std::vector<MaterialDescription> materials = flags();
  for (std::size_t i = 0; i < out.size(); ++i) {
    SceneDescription& scene = out[i].scene;
    scene.materials.push_back(materials[i % materials.size()]);
    scene.meshes[0].primitives.push_back(ball(static_cast<int>(scene.materials.size()) - 1));
    if (i % 2 == 0) {
      add_textures(scene);
    }
  }
  return out;
}

core::View lit(const Light& light, std::string_view integrator, int depth) {
  core::View view = middle(light.scene, integrator);
  view.environment = light.sky;
  test_support::look_at(view, {-0.3F, 0.7F, 2.2F}, {-0.3F, 0.15F, 0}, 40);
  view.camera.aperture_radius_m = 0.02F;
  view.settings.max_depth = depth;
  view.settings.film.width = view.settings.film.height = 16;
  return view;
}

constexpr int kReplicates = 32;

bool is_noisy(const std::string& kind) {
  return kind == "many" || kind == "alpha" || kind == "area" || kind == "unlit" || kind == "preset";
}

/// Samples of each replicate: as few as find the planted faults below. Particles find few of the
/// pixels.
int samples_of(const core::IntegratorEntry& row, const std::string& kind) {
  if (kind == "many") {
    return row.name == "light-trace" ? 64 : 16;
  }
  if (row.name == "light-trace") {
    return kind == "punctual 2" || kind == "punctual 3" ? 16 : is_noisy(kind) ? 48 : 32;
  }
  const int effort = row.name == "mlt" || row.name == "sppm" ? 2 : 1;
  return effort * (is_noisy(kind) ? 8 : 2);
}

/// Sums over the lights of a kind, each relative to the light of its reference.
struct Pool {
  Blocks sums;
  void add(const Blocks& light, double brightness) {
    sums.resize(light.size());
    sums = test_support::plus(std::move(sums), 1 / brightness, light);
  }
};

double brightness_of(const Blocks& light) {
  test_support::Moments green;
  for (const test_support::BlockSums& sums : light) {
    green.add(sums[sums.size() - 2]);
  }
  return green.mean;
}

/// A kind of light under one row of the registry, and under path.
struct Cell {
  Pool seen;
  Pool reference;
};

/// Of rows that are not exact: blur at the ball's silhouette and its shadow.
constexpr double kBlur = 0.03;

/// Student's t of 32 replicates beyond 6 by chance: 1e-6.
bool is_within_blur(const Cell& cell, double gain) {
  test_support::Moments ratio;
  const double right = brightness_of(cell.reference.sums);
  for (const test_support::BlockSums& sums : cell.seen.sums) {
    ratio.add(gain * sums[sums.size() - 2] / right);
  }
  return std::fabs(ratio.mean - 1) <= kBlur + 6 * ratio.standard_error();
}

// The planted faults: 5 % more light, 8 % more from particles.
TEST(Emitters, EveryIntegratorAgreesWithPathUnderEveryLight) {
  std::map<std::string, int> lights_of;
  const std::vector<Light> all = lights();
  for (const Light& light : all) {
    ++lights_of[light.kind];
  }
  std::map<std::pair<std::string, std::string>, Cell> cells;
  for (const Light& light : all) {
    const int share = lights_of[light.kind];
    const auto blocks = [&](core::View view, int seed, int samples) {
      view.settings.seed = static_cast<std::uint64_t>(seed);
      return test_support::replicates_of(std::move(view), kReplicates,
                                         std::max(samples / share, 2));
    };
    for (const int depth : {1, 2}) {
      const Blocks reference =
          blocks(lit(light, "path", depth), 1000, depth * (is_noisy(light.kind) ? 16 : 8));
      const double brightness = brightness_of(reference);
      for (const core::IntegratorEntry& row : core::integrators()) {
        const bool is_for_depth = (row.name == "direct") == (depth == 1);
        if (row.name == core::kAutomaticIntegrator || !is_for_depth) {
          continue;
        }
        core::View view = lit(light, row.name, depth);
        if (row.name == "path") {  // or it would be compared with itself
          view.settings.estimator.strategy = core::Strategy::kLight;
        }
        Cell& cell = cells[{std::string(row.name), light.kind}];
        cell.seen.add(blocks(view, 1, samples_of(row, light.kind)), brightness);
        cell.reference.add(reference, brightness);
      }
    }
  }
  for (const auto& [key, cell] : cells) {
    const core::IntegratorEntry& row = *core::find_integrator(key.first);
    const std::string what = key.first + ", " + key.second;
    const auto& [seen, reference] = cell;
    if (row.bias != "none") {
      EXPECT_TRUE(is_within_blur(cell, 1)) << what;
      EXPECT_FALSE(is_within_blur(cell, 1.08)) << "planted, " << what;
      continue;
    }
    const auto comparisons = static_cast<int>(cells.size());
    const auto agreement = test_support::compare(seen.sums, reference.sums);
    std::printf("    %s: error %.2f%%, p %.2g\n", what.c_str(), 100 * agreement.error,
                agreement.p());
    EXPECT_TRUE(test_support::agrees(agreement, comparisons))
        << what << ": image " << agreement.image << ", block " << agreement.block << ", squares "
        << agreement.squares;
    const double excess = row.name == "light-trace" ? 0.08 : 0.05;
    EXPECT_FALSE(test_support::agrees(
        test_support::compare(test_support::plus(seen.sums, excess, seen.sums), reference.sums),
        comparisons))
        << "planted, " << what;
  }
}

}  // namespace
