// Waves against the equivalent scalar code: kernels number by number, images pixel by pixel. Both
// use the same random numbers, so results differ only by rounding.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/lane_math.h"
#include "core/render/picture/tile_fill.h"
#include "core/transport/path_state.h"
#include "core/wave/lane_bsdf.h"
#include "core/wave/wave_tracer.h"
#include "tests/support/bsdf_cases.h"
#include "tests/support/differing_pixels.h"
#include "tests/support/scenes.h"

namespace {

using core::Floats;
using core::Rgb;
using core::Vec3;

/// A surface with layers; all 0 if it has none.
struct Surface {
  core::BsdfParameters parameters;
  core::BsdfLayers layers;
  bool has_layers = false;

  bool is_solid() const {
    return !parameters.thin && (parameters.transmission > 0 || layers.diffuse_transmission > 0);
  }
  bool is_wall() const {
    return (parameters.transmission > 0 && parameters.thin) || layers.diffuse_transmission > 0;
  }
};

/// The surfaces of test_support::bsdf_cases(), and mixtures of their lobes.
std::vector<Surface> surfaces() {
  std::vector<Surface> out;
  for (const auto& c : test_support::bsdf_cases()) {
    out.push_back({c.parameters, c.layers.value_or(core::BsdfLayers{}), c.layers.has_value()});
  }
  core::BsdfParameters half;
  for (const float roughness : {0.1F, 0.5F, 0.9F}) {
    half.metallic = roughness;
    half.roughness = roughness;
    half.alpha_x = half.alpha_y = roughness * roughness;
    half.base_color = {0.9F, 0.5F, 0.1F};
    half.f0 = {0.02F, 0.04F, 0.08F};
    out.push_back({half, {}, false});
    half.transmission = 0.7F;
    out.push_back({half, {}, false});
    half.alpha_x = half.alpha_y = 1e-4F;  // smooth
    out.push_back({half, {}, false});
    half.transmission = 0;
  }
  // Coats under sheen, smooth and rough, over these and over a mirror and a diffuse surface.
  core::BsdfLayers both;
  both.clearcoat = 0.6F;
  both.sheen_color = {0.3F, 0.8F, 0.5F};
  both.sheen_roughness = 0.3F;
  both.clearcoat_normal = core::normalize(Vec3{-0.1F, 0.1F, 1});
  for (std::size_t i = 0, count = out.size(); i < count; ++i) {
    both.clearcoat_roughness = i % 2 == 0 ? 0.0F : 0.4F;
    both.diffuse_transmission = i % 3 == 0 ? 0.4F : 0.0F;
    both.diffuse_transmission_color = {0.2F, 0.9F, 0.4F};
    if (!out[i].has_layers) {
      out.push_back({out[i].parameters, both, true});
    }
  }
  return out;
}

/// Surface and layers of N points.
template <std::size_t N>
struct LanesOfSurfaces {
  core::SurfaceLanes<N> surface{};
  core::LayerLanes<N> layers{};
  core::SolidLanes<N> solids{};
  core::WallLanes<N> walls{};
  core::BrushLanes<N> brush{};
  core::FilmLanes<N> films{};

  core::ExtraLanes<N> all() const { return {&layers, &solids, &walls, &brush, &films}; }
  void set(std::size_t k, const Surface& s, float alpha_scale = 1) {
    const core::BsdfParameters& p = s.parameters;
    surface.base_color.set(k, {p.base_color.r, p.base_color.g, p.base_color.b});
    surface.metallic.v[k] = p.metallic;
    surface.roughness.v[k] = p.roughness;
    surface.alpha.v[k] = p.alpha_y * alpha_scale;
    brush.alpha_x.v[k] = p.alpha_x * alpha_scale;
    surface.f0.set(k, {p.f0.r, p.f0.g, p.f0.b});
    surface.f90.v[k] = p.f90;
    const core::BsdfLayers& l = s.layers;
    layers.clearcoat.v[k] = l.clearcoat;
    layers.clearcoat_roughness.v[k] = l.clearcoat_roughness;
    layers.clearcoat_normal.set(k, l.clearcoat_normal);
    layers.sheen_color.set(k, {l.sheen_color.r, l.sheen_color.g, l.sheen_color.b});
    layers.sheen_roughness.v[k] = l.sheen_roughness;
    solids.transmission.v[k] = p.thin ? 0 : p.transmission;
    solids.specular_color.set(k, {p.specular_color.r, p.specular_color.g, p.specular_color.b});
    solids.ior.v[k] = p.thin ? 1 : p.ior;
    solids.inside.v[k] = p.inside ? -1 : 0;
    walls.transmission.v[k] = p.thin ? p.transmission : 0;
    walls.diffuse.v[k] = l.diffuse_transmission;
    const core::Rgb below = l.diffuse_transmission_color;
    walls.diffuse_color.set(k, {below.r, below.g, below.b});
    if (l.iridescence > 0) {
      films.on |= 1U << k;
      films.weight.v[k] = l.iridescence;
      films.ior.v[k] = l.iridescence_ior;
      films.thickness_nm.v[k] = l.iridescence_thickness_nm;
    }
  }
};

/// Tests whether two values differ by more than rounding: 1e-4 of the larger, or of 1e-3.
bool differs(float a, float b) {
  return !(std::fabs(a - b) <= 1e-4F * std::max({std::fabs(a), std::fabs(b), 1e-3F}));
}

/// Number of values and samples of lanes that differ from the scalar Bsdf's, N surfaces at once.
/// alpha_scale: 1, or a fault in the lanes.
template <std::size_t N>
int differences(Vec3 ng, float alpha_scale) {
  const auto all = surfaces();
  test_support::Random random(5);
  int count = 0;
  for (int round = 0; round < 300; ++round) {
    std::array<Surface, N> chosen;
    std::array<Vec3, N> wo;
    std::array<Vec3, N> wi;
    std::array<Vec3, N> numbers;
    LanesOfSurfaces<N> lanes;
    core::Vec3s<N> wo_lanes;
    core::Vec3s<N> wi_lanes;
    core::Vec3s<N> u;
    for (std::size_t k = 0; k < N; ++k) {
      chosen[k] = all[random.bits() % all.size()];
      do {
        wo[k] = test_support::random_hemisphere(random);
      } while (!(wo[k].z > 0.05F && dot(wo[k], ng) > 0.05F));
      wi[k] = test_support::random_hemisphere(random) * (random.uniform() < 0.3F ? -1.0F : 1.0F);
      numbers[k] = {random.uniform(), random.uniform(), random.uniform()};
      lanes.set(k, chosen[k], alpha_scale);
      wo_lanes.set(k, wo[k]);
      wi_lanes.set(k, wi[k]);
      u.set(k, numbers[k]);
    }
    const core::BsdfLanes<N> bsdf(lanes.surface, wo_lanes, core::Vec3s<N>(ng), lanes.all());
    const auto value = bsdf.evaluate(wi_lanes);
    const auto sample = bsdf.sample(u.x, {u.y, u.z});
    for (std::size_t k = 0; k < N; ++k) {
      const core::Bsdf scalar(chosen[k].parameters, wo[k], ng,
                              chosen[k].has_layers ? &chosen[k].layers : nullptr);
      const core::BsdfEval f = scalar.evaluate(wi[k]);
      const core::BsdfSample s = scalar.sample(numbers[k].x, {numbers[k].y, numbers[k].z});
      bool wrong = differs(value.value_cos.lane(k).x, f.value_cos.r) ||
                   differs(value.value_cos.lane(k).z, f.value_cos.b) ||
                   differs(value.pdf_solid_angle.v[k], f.pdf_solid_angle) ||
                   differs(sample.weight.lane(k).y, s.weight.g) ||
                   differs(bsdf.albedo().lane(k).x, scalar.albedo().r) ||
                   (bsdf.has_spread().bits() >> k & 1U) != (scalar.has_spread() ? 1U : 0U) ||
                   (bsdf.transmits().bits() >> k & 1U) != (scalar.transmits() ? 1U : 0U);
      if (!is_black(s.weight)) {
        wrong = wrong || (sample.is_delta.bits() >> k & 1U) != (s.is_delta ? 1U : 0U) ||
                (sample.is_null.bits() >> k & 1U) != (s.is_null ? 1U : 0U) ||
                differs(sample.wi_local.lane(k).x, s.wi_local.x) ||
                differs(sample.wi_local.lane(k).z, s.wi_local.z) ||
                differs(sample.pdf_solid_angle.v[k], s.pdf_solid_angle);
      }
      count += wrong ? 1 : 0;
    }
  }
  return count;
}

// Rounding may select another lobe or side in a handful of 2,400.
TEST(WaveBsdf, LanesEqualTheScalarBsdf) {
  EXPECT_LE(differences<8>({0, 0, 1}, 1), 3);
  EXPECT_LE(differences<1>({0, 0, 1}, 1), 1);
}

TEST(WaveBsdf, LanesEqualTheScalarBsdfUnderATiltedHorizon) {
  EXPECT_LE(differences<8>(test_support::tilted_normal(), 1), 3);
  EXPECT_LE(differences<1>(test_support::tilted_normal(), 1), 1);
}

/// Tests whether a lane's results have the same bits.
template <typename T>
bool are_same(const T& a, const T& b) {
  return std::memcmp(&a, &b, sizeof(T)) == 0;
}

// One surface, among copies of itself and among others: its bits are the same.
TEST(WaveBsdf, LanesDoNotDependOnTheirNeighbours) {
  const auto all = surfaces();
  test_support::Random random(6);
  const auto is_black = [](Vec3 v) { return v == Vec3{}; };
  for (int round = 0; round < 300; ++round) {
    const Surface& surface = all[random.bits() % all.size()];
    LanesOfSurfaces<8> own;
    LanesOfSurfaces<8> mixed;
    core::Vec3s<8> wo;
    core::Vec3s<8> wi;
    core::Vec3s<8> u;
    for (std::size_t k = 0; k < 8; ++k) {
      own.set(k, surface);
      mixed.set(k, k == 2 ? surface : all[random.bits() % all.size()]);
      wo.set(k, test_support::random_hemisphere(random));
      wi.set(k, test_support::random_hemisphere(random) * (k < 4 ? 1.0F : -1.0F));
      u.set(k, {random.uniform(), random.uniform(), random.uniform()});
    }
    const core::Vec3s<8> up(Vec3{0, 0, 1});
    const bool is_brushed = surface.parameters.alpha_x != surface.parameters.alpha_y;
    const core::BsdfLanes<8> a(own.surface, wo, up,
                               {.layers = surface.has_layers ? &own.layers : nullptr,
                                .solids = surface.is_solid() ? &own.solids : nullptr,
                                .walls = surface.is_wall() ? &own.walls : nullptr,
                                .brush = is_brushed ? &own.brush : nullptr,
                                .films = own.films.on == 0 ? nullptr : &own.films});
    const core::BsdfLanes<8> b(mixed.surface, wo, up, mixed.all());
    const auto f = a.evaluate(wi);
    const auto g = b.evaluate(wi);
    EXPECT_TRUE(are_same(f.value_cos.lane(2), g.value_cos.lane(2)));
    EXPECT_TRUE(are_same(f.pdf_solid_angle.v[2], g.pdf_solid_angle.v[2]));
    const auto s = a.sample(u.x, {u.y, u.z});
    const auto t = b.sample(u.x, {u.y, u.z});
    EXPECT_TRUE(are_same(s.weight.lane(2), t.weight.lane(2)));
    if (!is_black(s.weight.lane(2))) {
      EXPECT_TRUE(are_same(s.wi_local.lane(2), t.wi_local.lane(2)));
      EXPECT_TRUE(are_same(s.pdf_solid_angle.v[2], t.pdf_solid_angle.v[2]));
    }
  }
}

// The planted fault.
TEST(WaveBsdf, DetectsOnePercentMoreWidth) { EXPECT_GT(differences<8>({0, 0, 1}, 1.01F), 300); }

TEST(WaveLights, EightPointsPickAsEachAlone) {
  test_support::Random random(9);
  for (const std::size_t count : {1U, 2U, 3U, 4U, 5U, 17U, 300U}) {
    std::vector<core::LightBounds> lights(count);
    for (core::LightBounds& light : lights) {
      const Vec3 at = {random.uniform(), 2 + random.uniform(), random.uniform()};
      light.box = {at, at + Vec3{0.3F, 0, 0.2F}};
      light.axis = {0, -1, 0};
      light.power = 0.5F + random.uniform();
      light.two_sided = random.uniform() < 0.3F;
    }
    const core::LightTree tree(lights);
    for (int round = 0; round < 200; ++round) {
      core::Vec3s<8> point;
      core::Vec3s<8> normal;
      Floats<8> u;
      for (std::size_t k = 0; k < 8; ++k) {
        point.set(k, {3 * random.uniform() - 1, 3.5F * random.uniform(), random.uniform()});
        normal.set(k, test_support::random_hemisphere(random));
        u.v[k] = random.uniform();
      }
      const auto picks = tree.pick(core::Mask<8>::of(0xb7), point, normal, u);
      for (const std::size_t k : {0U, 1U, 2U, 4U, 5U, 7U}) {
        const auto one = tree.pick(core::Mask<1>::of(1), core::Vec3s<1>(point.lane(k)),
                                   core::Vec3s<1>(normal.lane(k)), Floats<1>(u.v[k]));
        EXPECT_NEAR(picks.prob_light.v[k], one.prob_light.v[0], 1e-5F);
        EXPECT_EQ(picks.light.v[k], one.light.v[0]);
        if (one.prob_light.v[0] > 0) {
          const auto light = static_cast<std::uint32_t>(one.light.v[0]);
          EXPECT_NEAR(one.prob_light.v[0], tree.prob_light(point.lane(k), normal.lane(k), light),
                      1e-5F);
        }
      }
    }
  }
}

core::MaterialDescription glossy(Rgb color, float metallic, float roughness) {
  core::MaterialDescription m;
  m.base_color = color;
  m.metallic = metallic;
  m.roughness = roughness;
  return m;
}

/// The Cornell box with three balls, one of each material.
core::View balls(const std::vector<core::MaterialDescription>& materials) {
  core::SceneDescription scene = test_support::cornell();
  const auto first = static_cast<int>(scene.materials.size());
  for (std::size_t i = 0; i < materials.size(); ++i) {
    scene.materials.push_back(materials[i]);
    scene.meshes[0].primitives.push_back(
        test_support::sphere({0.2F + 0.3F * static_cast<float>(i), 0.2F, 0.5F}, 0.15F, 8, false,
                             first + static_cast<int>(i)));
  }
  core::View view = test_support::view_of(std::move(scene), 45, 40);
  test_support::look_at(view, {0.5F, 0.5F, 2.4F}, {0.5F, 0.5F, 0}, 30);
  view.environment = test_support::constant_sky({0.2F, 0.3F, 0.4F});
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  return view;
}

/// Fraction of the pixels that differ (tests/support/differing_pixels.h).
double differing(const core::View& view, int width, const core::View& scalar) {
  const core::FilmSettings& film = view.settings.film;
  return static_cast<double>(test_support::differing_pixels(view, width, scalar, 16)) /
         static_cast<double>(film.width * film.height);
}
double differing(const core::View& view, int width = 8) { return differing(view, width, view); }

std::vector<core::MaterialDescription> metals_and_plastics() {
  return {glossy({0.9F, 0.6F, 0.3F}, 1, 0.3F), glossy({0.2F, 0.5F, 0.8F}, 0, 0.2F),
          glossy({0.8F, 0.8F, 0.8F}, 0.5F, 0.01F)};
}

TEST(Waves, AgreeWithScalarPathsOnDiffuseSurfaces) {
  EXPECT_LT(differing(balls({test_support::lambert({0.7F, 0.2F, 0.2F})})), 0.01);
}

TEST(Waves, AgreeWithScalarPathsOnMetalsAndPlastics) {
  EXPECT_LT(differing(balls(metals_and_plastics())), 0.01);
  EXPECT_LT(differing(balls(metals_and_plastics()), 1), 0.01);
}

core::View split(core::View view, int count) {
  view.settings.estimator.splitting = core::SplittingType::kFixed;
  view.settings.estimator.split_count = count;
  return view;
}

TEST(Waves, SplitPathsLikeTheScalarCode) {
  core::MaterialDescription glass = glossy({1, 1, 1}, 0, 0);
  glass.transmission = 1;
  const core::View view = balls({metals_and_plastics()[0], metals_and_plastics()[1], glass});
  EXPECT_LT(differing(split(view, 3)), 0.01);
  EXPECT_LT(differing(split(view, 8), 1), 0.01);
  core::View other = split(view, 3);
  other.settings.sampler = core::SamplerType::kHalton;
  EXPECT_LT(differing(other), 0.01);
  // The planted fault: another count.
  EXPECT_GT(differing(split(view, 2), 8, split(view, 3)), 0.5);
}

// The planted fault: one scattering event less.
TEST(Waves, DetectShorterPaths) {
  const core::View view = balls(metals_and_plastics());
  core::View shorter = view;
  shorter.settings.max_depth = 2;
  EXPECT_GT(differing(shorter, 8, view), 0.5);
}

core::MaterialDescription coated() {
  core::MaterialDescription m = glossy({0.8F, 0.1F, 0.1F}, 0, 0.5F);
  m.clearcoat = 1;
  return m;
}

core::MaterialDescription cloth() {
  core::MaterialDescription m = glossy({0.1F, 0.1F, 0.8F}, 0, 0.9F);
  m.sheen_color = {0.9F, 0.8F, 0.5F};
  m.sheen_roughness = 0.4F;
  return m;
}

TEST(Waves, AgreeWithScalarPathsOnFilmsOfGlass) {
  core::MaterialDescription wall = glossy({1, 1, 1}, 0, 0);
  wall.transmission = 1;
  wall.iridescence = 1;
  core::MaterialDescription solid = wall;
  solid.thickness = 1;
  const auto both = balls({wall, solid, coated()});
  EXPECT_LT(differing(both), 0.02);
  // The planted fault: a thicker film.
  solid.iridescence_thickness_max_nm *= 1.2F;
  EXPECT_GT(differing(balls({wall, solid, coated()}), 8, both), 0.05);
}

TEST(Waves, HandOverPathsThatHitDispersion) {
  core::MaterialDescription solid = glossy({1, 1, 1}, 0, 0);
  solid.transmission = 1;
  solid.thickness = 1;
  solid.dispersion = 5;
  EXPECT_LT(differing(balls({solid, coated()})), 0.02);
}

TEST(Waves, AgreeWithScalarPathsOnCoatsAndSheen) {
  core::MaterialDescription both = cloth();
  both.clearcoat = 0.7F;
  both.clearcoat_roughness = 0.3F;
  both.emissive = {0.3F, 0.2F, 0.1F};
  const auto all = balls({coated(), cloth(), both});
  EXPECT_LT(differing(all), 0.01);
  EXPECT_LT(differing(all, 1), 0.01);
  // The planted fault: a thinner coat.
  both.clearcoat = 0.6F;
  EXPECT_GT(differing(balls({coated(), cloth(), both}), 8, all), 0.05);
}

TEST(Waves, TakePathsBackAfterDispersionThatSplitsThere) {
  core::MaterialDescription solid = glossy({1, 1, 1}, 0, 0);
  solid.transmission = 1;
  solid.thickness = 1;
  solid.dispersion = 5;
  EXPECT_LT(differing(split(balls({solid, glossy({0.9F, 0.6F, 0.3F}, 1, 0.3F)}), 4)), 0.02);
}

/// Balls of clear and of frosted walls, and of leaves.
core::View walls(float transmission) {
  core::MaterialDescription window = glossy({0.9F, 1, 0.9F}, 0, 0);
  window.transmission = transmission;
  core::MaterialDescription frosted = window;
  frosted.roughness = 0.4F;
  core::MaterialDescription leaf = glossy({0.5F, 0.5F, 0.5F}, 0, 0.5F);
  leaf.diffuse_transmission = 0.6F;
  leaf.diffuse_transmission_color = {0.2F, 0.8F, 0.3F};
  return balls({window, frosted, leaf});
}

TEST(Waves, AgreeWithScalarPathsOnWallsAndLeaves) {
  const core::View all = walls(0.9F);
  EXPECT_LT(differing(all), 0.01);
  EXPECT_LT(differing(all, 1), 0.01);
  EXPECT_LT(differing(split(all, 4)), 0.01);
  // At the maximum depth paths still pass clear walls.
  core::View shallow = all;
  for (const int depth : {0, 1, 2}) {
    shallow.settings.max_depth = depth;
    EXPECT_LT(differing(shallow), 0.01) << depth;
    EXPECT_LT(differing(split(shallow, 4)), 0.01) << depth;
  }
  // The planted fault.
  EXPECT_GT(differing(walls(0.8F), 8, all), 0.05);
}

/// Clear walls, in front of the Cornell box.
core::View behind_walls(int count) {
  core::SceneDescription scene = test_support::cornell();
  core::MaterialDescription window = glossy({1, 1, 1}, 0, 0);
  window.transmission = 1;
  window.specular = 0;
  const auto material = static_cast<int>(scene.materials.size());
  scene.materials.push_back(window);
  for (int i = 0; i < count; ++i) {
    const float z = 1.5F + 2e-4F * static_cast<float>(i);
    scene.meshes[0].primitives.push_back(
        test_support::quad({-1, -1, z}, {3, 0, 0}, {0, 3, 0}, material));
  }
  core::View view = test_support::view_of(std::move(scene), 3, 3);
  test_support::look_at(view, {0.5F, 0.5F, 4}, {0.5F, 0.5F, 0}, 10);
  view.settings.max_depth = 1;
  return view;
}

// Also where no neighbour is at such a wall: the last of so many is passed, and the surface behind
// it gets no light.
TEST(Waves, EndBehindAsManyClearWallsAsScalarPaths) {
  EXPECT_EQ(differing(behind_walls(core::kNullScatteringMax + 1)), 0);
  // The planted fault: one of them less.
  EXPECT_GT(differing(behind_walls(core::kNullScatteringMax), 8,
                      behind_walls(core::kNullScatteringMax + 1)),
            0.5);
}

TEST(Waves, PassHolesAndBlendedSurfaces) {
  core::MaterialDescription hole = glossy({0.5F, 0.5F, 0.5F}, 0, 0.5F);
  hole.alpha_mode = core::AlphaMode::kMask;
  hole.base_alpha = 0.2F;
  core::MaterialDescription there = hole;
  there.base_alpha = 0.8F;
  core::MaterialDescription half = hole;
  half.alpha_mode = core::AlphaMode::kBlend;
  half.base_alpha = 0.5F;
  EXPECT_LT(differing(balls({hole, there, half})), 0.01);
}

TEST(Waves, SupportEnvironmentMaps) {
  core::View view = balls(metals_and_plastics());
  view.environment = test_support::sky_map(16, 8, [](int x, int y) {
    return x == 5 && y == 2 ? Rgb{80, 70, 60} : Rgb{0.3F, 0.3F, 0.3F};
  });
  EXPECT_LT(differing(view), 0.01);
}

/// Balls whose textures are rotated and repeated, with bytes and with floats, in every wrap mode;
/// one has such high resolution that coarse levels are read.
core::View textured(float normal_scale = 0.7F) {
  core::SceneDescription scene = test_support::cornell();
  test_support::Random random(3);
  const auto image = [&](core::PixelType type) {
    core::Image out;
    out.width = 32;
    out.height = 8;
    out.channels = 4;
    out.type = type;
    const std::size_t size = type == core::PixelType::kU8 ? 1 : 4;
    out.bytes.resize(out.value_count() * size);
    for (std::size_t i = 0; i < out.value_count(); ++i) {
      const float value = random.uniform();
      if (size == 1) {
        out.bytes[i] = static_cast<std::byte>(255 * value);
      } else {
        std::memcpy(&out.bytes[4 * i], &value, 4);
      }
    }
    scene.images.push_back(std::make_shared<const core::Image>(std::move(out)));
    return static_cast<int>(scene.images.size()) - 1;
  };
  for (int ball = 0; ball < 3; ++ball) {
    const auto type = ball == 1 ? core::PixelType::kF32 : core::PixelType::kU8;
    core::TextureDescription slot;
    slot.wrap_u = static_cast<core::TextureWrap>(ball);
    slot.wrap_v = static_cast<core::TextureWrap>((ball + 1) % 3);
    slot.uv_set = ball % 2;
    slot.uv_transform = {0.8F, 0.3F, -0.4F, -0.3F, 0.8F, 2};
    core::MaterialDescription m = glossy({0.9F, 0.8F, 0.7F}, 0.9F, 0.8F);
    slot.image = image(type);
    m.base_color_texture = slot;
    slot.image = image(type);
    m.metallic_roughness_texture = slot;
    slot.image = image(type);
    m.normal_texture = slot;
    m.normal_scale = normal_scale;
    scene.materials.push_back(m);
    auto primitive =
        test_support::sphere({0.2F + 0.3F * static_cast<float>(ball), 0.2F, 0.5F}, 0.15F, 8, false,
                             static_cast<int>(scene.materials.size()) - 1);
    for (const Vec3 p : primitive.positions) {
      const float often = ball == 2 ? 40.0F : 3.0F;
      primitive.uv[static_cast<std::size_t>(slot.uv_set)].push_back({often * p.x, often * p.y});
      primitive.uv[static_cast<std::size_t>(1 - slot.uv_set)].push_back({0.5F, 0.5F});
      primitive.tangents.push_back({0.6F, 0, 0.8F, p.x < 0.5F ? 1.0F : -1.0F});
    }
    scene.meshes[0].primitives.push_back(std::move(primitive));
  }
  core::View view = test_support::view_of(std::move(scene), 45, 40);
  test_support::look_at(view, {0.5F, 0.5F, 2.4F}, {0.5F, 0.5F, 0}, 30);
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  return view;
}

TEST(Waves, ReadTexturesLikeTheScalarCode) {
  EXPECT_LT(differing(textured()), 0.02);
  EXPECT_LT(differing(textured(), 1), 0.02);
  // The planted fault: normals tilted a fifth more.
  EXPECT_GT(differing(textured(0.84F), 8, textured()), 0.2);
}

TEST(Waves, SupportEverySampler) {
  core::View view = balls(metals_and_plastics());
  for (const auto type :
       {core::SamplerType::kIndependent, core::SamplerType::kHalton, core::SamplerType::kZsobol}) {
    view.settings.sampler = type;
    EXPECT_LT(differing(view), 0.01);
  }
}

TEST(Waves, EndAtTheMaximumDepth) {
  core::View view = balls(metals_and_plastics());
  for (const int depth : {0, 1, 3}) {
    view.settings.max_depth = depth;
    EXPECT_LT(differing(view), 0.01) << depth;
  }
}

// The crop changes which paths share a wave, but not their results.
void expect_same_bits_in_other_waves(const core::View& full) {
  const auto whole = test_support::render(full, 8).snapshot;
  core::View part = full;
  part.settings.film.crop = core::PixelRect{7, 3, 31, 30};
  const auto piece = test_support::render(part, 8).snapshot;
  for (std::size_t y = 0; y < 30; ++y) {
    for (std::size_t x = 0; x < 31; ++x) {
      const auto& a = piece.pixels[(y * 31 + x) * 2];
      const auto& b = whole.pixels[((y + 3) * 45 + x + 7) * 2];
      ASSERT_TRUE(a.mean_r == b.mean_r && a.mean_g == b.mean_g && a.mean_b == b.mean_b &&
                  a.m2_luminance == b.m2_luminance)
          << x << ' ' << y;
    }
  }
}

TEST(Waves, BitsOfAPathAreIndependentOfItsWave) {
  core::MaterialDescription glass = glossy({1, 1, 1}, 0, 0);
  glass.transmission = 1;
  core::MaterialDescription solid = glass;
  solid.thickness = 1;
  expect_same_bits_in_other_waves(
      balls({glass, solid, glossy({0.9F, 0.6F, 0.3F}, 1, 0.3F), coated(), cloth()}));
}

TEST(Waves, BitsOfAPathBehindHolesAreIndependentOfItsWave) {
  core::MaterialDescription blended = coated();
  blended.alpha_mode = core::AlphaMode::kBlend;
  blended.base_alpha = 0.5F;
  expect_same_bits_in_other_waves(
      balls({blended, glossy({0.9F, 0.6F, 0.3F}, 1, 0.3F), coated(), cloth()}));
}

core::View in_fog(core::View view) {
  view.settings.fog.emplace().scattering = {0.5F, 0.4F, 0.3F};
  return view;
}

TEST(Waves, SplitPathsInFogLikeTheScalarCode) {
  const core::View view = in_fog(balls(metals_and_plastics()));
  EXPECT_LT(differing(split(view, 3)), 0.01);
  EXPECT_LT(differing(split(view, 8), 1), 0.01);
  EXPECT_GT(differing(split(view, 2), 8, split(view, 3)), 0.5);
}

TEST(Waves, BitsOfASplitPathInFogAreIndependentOfItsWave) {
  expect_same_bits_in_other_waves(split(in_fog(balls({coated(), cloth()})), 3));
}

TEST(Waves, SupportOnlyDefaultOptions) {
  core::View view = balls({});
  const auto serves = [&] {
    return core::make_wave_tracer({view.scene->data(), view.environment.get(), view.settings}) !=
           nullptr;
  };
  EXPECT_TRUE(serves());
  view = split(in_fog(view), 3);
  EXPECT_TRUE(serves());
  view.settings.fog.reset();
  view.settings.estimator.roulette = core::RouletteType::kNone;
  EXPECT_FALSE(serves());
  view.settings.estimator = {};
  view.settings.light_sampler = core::LightSamplerType::kRestir;
  EXPECT_FALSE(serves());
  view.settings.light_sampler = core::LightSamplerType::kTree;
  view.settings.integrator = "bdpt";
  EXPECT_FALSE(serves());
}

// Waves of three span pixels and samples; each pixel still gets its own in order.
TEST(WaveFill, TileContentEqualsThatOfPixelAfterPixel) {
  const auto sample_of = [](int x, int y, int s) {
    core::PathSample out;
    out.radiance = Rgb(static_cast<float>(
        core::mix_bits(static_cast<std::uint64_t>(x + 100 * y + 10'000 * s)) >> 40));
    out.hit = s % 3 != 0;
    out.depth_m = static_cast<float>(x * s);
    return out;
  };
  for (const bool is_planned : {false, true}) {
    core::TileState one;
    one.rect = {32, 0, 5, 3};
    one.pixels.resize(30);
    one.aux.resize(15);
    if (is_planned) {
      one.samples = 4;
      one.span = {4, 8};
      for (std::uint32_t p = 0; p < 15; ++p) {
        one.plan.push_back({4, 4 + p});
      }
    }
    core::TileState other = one;
    const core::FillRule rule = {2, 1, core::FitType::kNone, 1};
    ASSERT_TRUE(core::fill_tile(one, rule, 7, {}, sample_of));
    std::vector<core::DueSample> due;
    ASSERT_TRUE(core::fill_tile_in_waves(
        other, rule, 4, 7, {},
        [&](std::span<const core::DueSample> wave) { due.assign(wave.begin(), wave.end()); },
        [&](const core::DueSample& at, std::size_t i) {
          EXPECT_EQ(at.pixel, due[i].pixel);
          return sample_of(at.x, at.y, at.sample);
        }));
    EXPECT_EQ(one.samples, other.samples);
    for (std::size_t p = 0; p < 30; ++p) {
      EXPECT_EQ(one.pixels[p].count, other.pixels[p].count);
      EXPECT_EQ(one.pixels[p].mean_r, other.pixels[p].mean_r);
      EXPECT_EQ(one.pixels[p].m2_luminance, other.pixels[p].m2_luminance);
      EXPECT_EQ(one.aux[p / 2].depth_m, other.aux[p / 2].depth_m);
    }
  }
}

}  // namespace
