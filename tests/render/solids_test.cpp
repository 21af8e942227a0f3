// Solids: the medium that a path starts in, shared space, surfaces with holes. Closed forms: Beer's
// law, Fresnel at normal incidence.
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "core/integrators/registry.h"
#include "core/math/numbers.h"
#include "core/render/picture/meter.h"
#include "tests/render/truth.h"

namespace {

using core::MaterialDescription;
using core::PrimitiveDescription;
using core::Rgb;
using core::Vec3;

/// Absorbs sigma per metre.
MaterialDescription solid(float ior, float sigma) {
  MaterialDescription m = test_support::glass(ior);
  m.attenuation_distance = 1;
  m.attenuation_color = Rgb(std::exp(-sigma));
  return m;
}

PrimitiveDescription box(Vec3 low, Vec3 high, int material, bool inward = false) {
  const Vec3 d = high - low;
  const Vec3 x = {d.x, 0, 0};
  const Vec3 y = {0, d.y, 0};
  const Vec3 z = {0, 0, d.z};
  PrimitiveDescription out;
  out.material = material;
  for (PrimitiveDescription side :
       {test_support::quad(low, y, x, material), test_support::quad(low, z, y, material),
        test_support::quad(low, x, z, material), test_support::quad(high, -x, -y, material),
        test_support::quad(high, -y, -z, material), test_support::quad(high, -z, -x, material)}) {
    const auto first = static_cast<std::uint32_t>(out.positions.size());
    out.positions.insert(out.positions.end(), side.positions.begin(), side.positions.end());
    for (std::size_t i = 0; i < side.indices.size(); i += 3) {
      out.indices.push_back(first + side.indices[i]);
      out.indices.push_back(first + side.indices[i + (inward ? 2 : 1)]);
      out.indices.push_back(first + side.indices[i + (inward ? 1 : 2)]);
    }
  }
  return out;
}

/// False alarm 6e-5 by noise. scene: relative error of the closed form and of a biased estimator.
bool is_truth(const test_support::Picture& picture, double truth, double scene) {
  const auto mean = static_cast<double>(picture.mean().g);
  const auto error = static_cast<double>(picture.standard_error().g);
  return std::fabs(mean - truth) < 4 * error + scene * truth && error < 0.03 * truth;
}

void expect_only(const test_support::Picture& picture, double truth, double fault,
                 const std::string& what, double scene = 2e-3) {
  EXPECT_TRUE(is_truth(picture, truth, scene)) << what << ": " << picture.mean().g << " +- "
                                               << picture.standard_error().g << " for " << truth;
  EXPECT_FALSE(is_truth(picture, fault, scene)) << what << ": the planted fault passes";
}

/// Looks at a wall of radiance 1 from z = 0 along -z.
core::View view_of_wall(std::vector<MaterialDescription> materials,
                        std::vector<PrimitiveDescription> parts, float wall_z) {
  materials.push_back(test_support::emitter(Rgb(1)));
  parts.push_back(test_support::quad({-2, -2, wall_z}, {4, 0, 0}, {0, 4, 0},
                                     static_cast<int>(materials.size() - 1)));
  core::View view = test_support::view_of(test_support::scene_of(materials, parts), 4, 4);
  test_support::look_at(view, {0, 0, 0}, {0, 0, -1}, 1);
  view.settings.max_depth = 1;
  view.settings.photons.paths = 1000;
  return view;
}

template <typename Visit>
void each_integrator(Visit&& visit) {
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (row.name != core::kAutomaticIntegrator) {
      SCOPED_TRACE(row.name);
      visit(row);
    }
  }
}

TEST(StartStates, ACameraInASolidSeesThroughIt) {
  for (const float ior : {1.0F, 1.5F}) {
    core::View view = view_of_wall({solid(ior, 0.6F)}, {box({-3, -3, -3}, {3, 3, 3}, 0)}, -2);
    each_integrator([&](const core::IntegratorEntry& row) {
      view.settings.integrator = std::string(row.name);
      expect_only(test_support::render(view, 64), std::exp(-1.2), 1, "ior " + std::to_string(ior));
    });
  }
}

TEST(StartStates, ACameraDeepUnderAnOpenSurfaceBetweenWallsSeesThroughTheSolid) {
  PrimitiveDescription walls = box({-0.5F, -0.5F, -2.1F}, {0.5F, 0.5F, 1.5F}, 1, true);
  walls.indices.erase(walls.indices.begin() + 18, walls.indices.begin() + 24);  // at +z
  core::View view =
      view_of_wall({solid(1, 0.6F), test_support::lambert(Rgb(0))},
                   {walls, test_support::quad({-0.5F, -0.5F, 1.3F}, {1, 0, 0}, {0, 1, 0}, 0)}, -2);
  each_integrator([&](const core::IntegratorEntry& row) {
    view.settings.integrator = std::string(row.name);
    expect_only(test_support::render(view, 64), std::exp(-1.2), 1, "under water");
  });
}

TEST(StartStates, EveryKindOfCameraStartsInTheSolidsAroundIt) {
  core::View view = view_of_wall({solid(1, 0.6F)}, {box({-3, -3, -3}, {3, 3, 3}, 0)}, -2);
  const double truth = std::exp(-1.2);
  view.camera.aperture_radius_m = 0.01F;
  view.camera.focus_distance_m = 2;
  expect_only(test_support::render(view, 16), truth, 1, "lens");
  view.camera.aperture_radius_m = 0;
  view.camera.type = core::CameraType::kOrthographic;
  view.camera.vertical_fov_degrees.reset();
  view.camera.orthographic_height_m = 0.5F;
  expect_only(test_support::render(view, 16), truth, 1, "orthographic");
  view.settings.shutter_seconds = 0.1F;
  expect_only(test_support::render(view, 16), truth, 1, "open shutter");
}

// Half of the lens is in the solid.
TEST(StartStates, ALensMayCrossASurface) {
  core::View view = view_of_wall({solid(1, 0.6F)}, {box({0, -3, -3}, {6, 3, 3}, 0)}, -2);
  view.camera.aperture_radius_m = 0.01F;
  view.camera.focus_distance_m = 1e4F;
  // Rays are parallel to the solid's side; those to the left of it stay outside.
  test_support::look_at(view, {0, 0, 0}, {0, 0, -1}, 1e-3F);
  view.camera.aperture_radius_m = 0.01F;
  view.camera.focus_distance_m = 1e4F;
  expect_only(test_support::render(view, 256), 0.5 * (1 + std::exp(-1.2)), 1, "lens");
}

TEST(StartStates, ACameraInAScatteringSolidLosesWhatIsScattered) {
  MaterialDescription m = solid(1, 0.6F);
  m.multiscatter_color = Rgb(0.7F);
  core::View view = view_of_wall({m}, {box({-3, -3, -3}, {3, 3, 3}, 0)}, -2);
  view.settings.max_depth = 0;  // nothing is scattered back in
  each_integrator([&](const core::IntegratorEntry& row) {
    if (core::accepts(row, "/medium")) {
      view.settings.integrator = std::string(row.name);
      expect_only(test_support::render(view, 256), std::exp(-1.2), 1, "scattering");
    }
  });
}

enum class Lamp { kPoint, kSpot, kArea };
constexpr float kBallRadius = 0.5F;
constexpr double kSigma = 1.4;
constexpr double kAlbedo = 0.5;
constexpr float kHeight = 1;
constexpr float kFovDegrees = 20;

/// A lamp of intensity 1 (down) in the middle of a ball, above a floor that the camera sees.
core::View lamp_in_ball(Lamp lamp, const MaterialDescription& ball) {
  const float side = 0.02F;
  std::vector<PrimitiveDescription> parts = {
      test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0),
      test_support::sphere({0, kHeight, 0}, kBallRadius, 32, false, 1)};
  if (lamp == Lamp::kArea) {
    parts.push_back(
        test_support::quad({-side / 2, kHeight, -side / 2}, {side, 0, 0}, {0, 0, side}, 2));
  }
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert(Rgb(static_cast<float>(kAlbedo))), ball,
                              test_support::emitter(Rgb(1 / (side * side)))},
                             parts);
  if (lamp != Lamp::kArea) {
    core::PunctualLightDescription light;
    light.type = lamp == Lamp::kPoint ? core::PunctualType::kPoint : core::PunctualType::kSpot;
    light.to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0, kHeight, 0}};  // shines down
    light.intensity = Rgb(1);
    light.inner_cone_rad = 1.2F;
    light.outer_cone_rad = 1.3F;
    scene.lights.push_back(light);
  }
  core::View view = test_support::view_of(std::move(scene), 4, 4);
  test_support::look_at(view, {1.5F, 0.8F, 0}, {0, 0, 0}, kFovDegrees);
  view.settings.max_depth = 1;
  view.settings.photons = {.paths = 4000, .radius_m = 0.05F, .final_gather = 0};
  return view;
}

/// Mean radiance of the film without the ball: albedo / pi cos^3 / height^2, once more the cosine
/// for an area, over the film plane.
double bare_floor(Lamp lamp) {
  const Vec3 eye = {1.5F, 0.8F, 0};
  const Vec3 forward = normalize(-eye);
  const Vec3 right = {0, 0, -1};
  const Vec3 up = cross(right, forward);
  const float half = std::tan(kFovDegrees / 2 * core::kPi / 180);
  constexpr int kSide = 64;
  double sum = 0;
  for (int i = 0; i < kSide * kSide; ++i) {
    const float x = (2 * (static_cast<float>(i % kSide) + 0.5F) / kSide - 1) * half;
    const float y = (2 * (static_cast<float>(i / kSide) + 0.5F) / kSide - 1) * half;
    const Vec3 d = forward + right * x + up * y;
    const Vec3 at = eye + d * (-eye.y / d.y);
    const double cosine = 1 / std::sqrt(1 + static_cast<double>(dot(at, at)));
    sum += std::pow(cosine, lamp == Lamp::kArea ? 4 : 3);
  }
  return kAlbedo * std::numbers::inv_pi * sum / (kSide * kSide);
}

/// Only some of the particles of light-trace reach the part of the floor that the camera sees.
int samples_of(const core::IntegratorEntry& row) {
  return row.name == "light-trace" ? 8192 : (row.splats ? 512 : 128);
}

/// The facets of the ball lie up to 0.0006 m within it; the lamp has 0.02 m.
constexpr double kRounded = 4e-3;

TEST(StartStates, ALampInASolidShinesThroughIt) {
  for (const Lamp lamp : {Lamp::kPoint, Lamp::kSpot, Lamp::kArea}) {
    const double bare = bare_floor(lamp);
    const double truth = bare * std::exp(-kSigma * double{kBallRadius});
    core::View view = lamp_in_ball(lamp, solid(1, static_cast<float>(kSigma)));
    each_integrator([&](const core::IntegratorEntry& row) {
      view.settings.integrator = std::string(row.name);
      const double bias = row.bias == "none" ? 0 : 0.06;
      expect_only(test_support::render(view, samples_of(row)), truth, bare,
                  "lamp " + std::to_string(static_cast<int>(lamp)), kRounded + bias);
    });
  }
}

// A hole in a solid does not let a path into its medium: half of the light is never absorbed.
TEST(Solids, HalfCoverageLetsHalfOfTheLightPassUnabsorbed) {
  MaterialDescription half = solid(1, static_cast<float>(kSigma));
  half.alpha_mode = core::AlphaMode::kBlend;
  half.base_alpha = 0.5F;
  const double bare = bare_floor(Lamp::kArea);
  const double whole = bare * std::exp(-kSigma * double{kBallRadius});
  core::View view = lamp_in_ball(Lamp::kArea, half);
  each_integrator([&](const core::IntegratorEntry& row) {
    view.settings.integrator = std::string(row.name);
    const double bias = row.bias == "none" ? 0 : 0.06;
    expect_only(test_support::render(view, 2 * samples_of(row)), (bare + whole) / 2, whole, "half",
                kRounded + bias);
  });
}

TEST(StartStates, AMeterPointInASolidReadsAbsorbedLight) {
  core::SceneDescription scene =
      test_support::scene_of({solid(1, 0.6F)}, {box({-3, -3, -3}, {3, 3, 3}, 0)});
  core::PunctualLightDescription light;
  light.type = core::PunctualType::kPoint;
  light.to_world.t = {0, 2, 0};
  light.intensity = Rgb(1);
  scene.lights.push_back(light);
  core::View view = test_support::view_of(std::move(scene), 4, 4);
  view.settings.max_depth = 1;
  view.settings.meter.points = {{{0, 0, 0}, {0, 1, 0}}};
  const core::Meter meter({view.scene->data(), nullptr, view.settings});
  core::MeterChunk chunk;
  ASSERT_TRUE(meter.render(0, chunk, 4, {}));
  const auto readings = core::meter_readings(core::meter_points(view.settings.meter), {chunk});
  EXPECT_NEAR(static_cast<double>(readings.at(0).illuminance), std::exp(-1.2) / 4, 1e-5);
}

/// Normal reflectance of a boundary.
double reflectance(double ratio) {
  const double r = (ratio - 1) / (ratio + 1);
  return r * r;
}

/// What a stack of boundaries without absorption transmits, with all reflections between them:
/// (1 - T) / T is the sum of R / (1 - R).
double transmitted(const std::vector<double>& ratios) {
  double sum = 0;
  for (const double ratio : ratios) {
    sum += reflectance(ratio) / (1 - reflectance(ratio));
  }
  return 1 / (1 + sum);
}

TEST(SharedSpace, AGlassOnALiquidIsOneBoundaryOrTwo) {
  const double gap = transmitted({1.5, 1.5, 1.33, 1.33});
  const double touching = transmitted({1.5, 1.5 / 1.33, 1.33});
  struct Case {
    const char* name;
    float top;
    double truth;
    double fault;
  };
  for (const Case& c : {Case{"gap", -1.05F, gap, touching}, Case{"flush", -1, touching, gap},
                        Case{"overlap", -0.95F, touching, gap}}) {
    core::View view = view_of_wall(
        {solid(1.5F, 0), solid(1.33F, 0)},
        {box({-3, -3, -1}, {3, 3, -0.5F}, 0), box({-3, -3, -1.5F}, {3, 3, c.top}, 1)}, -1.9F);
    view.settings.max_depth = 24;
    expect_only(test_support::render(view, 1024), c.truth, c.fault, c.name);
  }
}

// The solids overlap by half a metre; only the second absorbs.
TEST(SharedSpace, BelongsToTheHigherPriorityElseToTheSmallerSolid) {
  struct Case {
    int first;
    int second;
    double metres;
  };
  for (const Case& c : {Case{0, 0, 1}, Case{1, 0, 1}, Case{0, 1, 1.5}, Case{-1, 0, 1.5}}) {
    MaterialDescription first = solid(1, 0);
    MaterialDescription second = solid(1, 1);
    first.priority = c.first;
    second.priority = c.second;
    for (const bool turned : {false, true}) {  // seen from both sides
      const float side = turned ? -1.0F : 1.0F;
      const auto slab = [&](float from, float to, int material) {
        const float low = std::min(side * from, side * to) - 2;
        const float high = std::max(side * from, side * to) - 2;
        return box({-3, -3, low}, {3, 3, high}, material);
      };
      core::View view = view_of_wall({first, second}, {slab(0, 1, 0), slab(-1, 0.5F, 1)}, -3.8F);
      for (const char* name : {"path", "bdpt"}) {
        view.settings.integrator = name;
        expect_only(test_support::render(view, 16), std::exp(-c.metres), std::exp(c.metres - 2.5),
                    name + std::to_string(c.first) + std::to_string(c.second));
      }
    }
  }
}

TEST(Solids, TwelveMayNest) {
  std::vector<MaterialDescription> materials;
  std::vector<PrimitiveDescription> parts;
  for (int i = 0; i < 12; ++i) {
    materials.push_back(solid(1, i == 0 ? 1.0F : 0.0F));
    const float half = 0.5F + 0.02F * static_cast<float>(i);
    parts.push_back(box({-half, -half, -1 - half}, {half, half, -1 + half}, i));
  }
  core::View view = view_of_wall(materials, parts, -3);
  expect_only(test_support::render(view, 128), std::exp(-1.0), 1, "nested");
}

TEST(Solids, EndWhereTheirSurfaceEnds) {
  const auto sides = [](const PrimitiveDescription& whole, std::size_t first, std::size_t count) {
    PrimitiveDescription out = whole;
    out.indices.assign(whole.indices.begin() + static_cast<std::ptrdiff_t>(6 * first),
                       whole.indices.begin() + static_cast<std::ptrdiff_t>(6 * (first + count)));
    return out;
  };
  const PrimitiveDescription first = box({-1, -1, -2}, {1, 1, -1}, 0);
  const PrimitiveDescription second = box({-1, -1, -2}, {1, 1, -1}, 1);
  const double truth = std::exp(-1.0);
  const double without_end = std::exp(-3.0);
  // The sides at -z, and all others, of another material.
  expect_only(test_support::render(view_of_wall({solid(1, 1), solid(1, 1)},
                                                {sides(first, 0, 1), sides(second, 1, 5)}, -4),
                                   16),
              truth, without_end, "two materials");
  // Only two opposite sides, which share no border.
  expect_only(test_support::render(view_of_wall({solid(1, 1), solid(1, 1)},
                                                {sides(first, 0, 1), sides(second, 3, 1)}, -4),
                                   16),
              truth, without_end, "two sheets");
  // An inner surface that faces inwards, of another material.
  expect_only(
      test_support::render(view_of_wall({solid(1, 1), solid(1, 1)},
                                        {box({-1, -1, -3}, {1, 1, -1}, 0),
                                         box({-0.5F, -0.5F, -2.5F}, {0.5F, 0.5F, -1.5F}, 1, true)},
                                        -4),
                           16),
      truth, std::exp(-2.0), "hollow");
}

/// The faces of two parts, some of which may coincide.
PrimitiveDescription both(const PrimitiveDescription& first, const PrimitiveDescription& second) {
  PrimitiveDescription out;
  for (const PrimitiveDescription* part : {&first, &second}) {
    const auto before = static_cast<std::uint32_t>(out.positions.size());
    out.positions.insert(out.positions.end(), part->positions.begin(), part->positions.end());
    for (const std::uint32_t i : part->indices) {
      out.indices.push_back(before + i);
    }
  }
  out.material = first.material;
  return out;
}

TEST(Solids, FacesModelledTwiceAreOneForACameraInsideAndOutside) {
  for (const float camera_depth : {0.0F, 1.0F}) {
    const PrimitiveDescription once = box({-3, -3, -1.5F}, {3, 3, camera_depth - 0.5F}, 0);
    const double metres = camera_depth > 0 ? 1.5 : 1;
    core::View view = view_of_wall({solid(1, 0.6F)}, {both(once, once)}, -2);
    for (const char* name : {"path", "bdpt"}) {
      view.settings.integrator = name;
      expect_only(test_support::render(view, 16), std::exp(-0.6 * metres), std::exp(-1.2 * metres),
                  name);
    }
  }
}

// A film that rounding cannot tell from a surface absorbs almost nothing, and one whose faces are
// at one place nothing; the fault is a path that stays in it.
TEST(Solids, AFilmThinnerThanTheErrorsEndsWhereItBegins) {
  for (const float thick : {0.0F, 2e-7F, 1e-6F}) {
    const PrimitiveDescription film =
        both(test_support::quad({-3, -3, -1}, {6, 0, 0}, {0, 6, 0}, 0),
             test_support::quad({-3, -3, -1 - thick}, {0, 6, 0}, {6, 0, 0}, 0));
    core::View view = view_of_wall({solid(1, 0.6F)}, {film}, -2);
    each_integrator([&](const core::IntegratorEntry& row) {
      view.settings.integrator = std::string(row.name);
      expect_only(test_support::render(view, 64), 1, std::exp(-0.6), std::to_string(thick));
    });
  }
}

// The path leaves by the hole.
TEST(Solids, EndAtACutOutHole) {
  MaterialDescription mask = solid(1, 1);
  mask.alpha_mode = core::AlphaMode::kMask;
  mask.base_alpha = 0;
  PrimitiveDescription whole = box({-1, -1, -2}, {1, 1, -1}, 0);
  PrimitiveDescription back = whole;
  back.material = 1;
  back.indices.assign(whole.indices.begin(), whole.indices.begin() + 6);
  whole.indices.erase(whole.indices.begin(), whole.indices.begin() + 6);
  expect_only(test_support::render(view_of_wall({solid(1, 1), mask}, {whole, back}, -4), 16),
              std::exp(-1.0), std::exp(-3.0), "hole");
}

TEST(Solids, AnOpaqueFloorHidesWhatStandsOnItExactly) {
  // The wall is the bottom of the solid, too. It emits into the glass: outside, radiance is less by
  // the square of the index.
  core::View view = view_of_wall({solid(1.5F, 0)}, {box({-1, -1, -2}, {1, 1, -1}, 0)}, -2);
  expect_only(test_support::render(view, 256), (1 - reflectance(1.5)) / 2.25,
              transmitted({1.5, 1.5}), "flush");
}

}  // namespace
