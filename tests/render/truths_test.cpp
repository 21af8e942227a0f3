// Closed forms (truths 1, 2, 5, 9 and 10) for every row of the integrators' registry. The mean of
// an image is taken over kSeeds seeds; Student's t over them must not reject the closed form, and
// the standard error must be at most a quarter of the truth's cap. The same rule must reject an
// image that is too bright by three caps.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Moments;

constexpr int kSeeds = 14;
constexpr int kSide = 8;  // pixels
/// At most 100 tests (9 truths, 9 rows, repeated renders) with a false alarm probability of 0.1%
/// over all of them.
const double kLevel = test_support::sidak(1e-3, 100);

/// An integrator; photon-map also without final gathering, so that the image shows the map itself.
struct Row {
  std::string name;
  const core::IntegratorEntry* entry;
  int samples;
  double caps = 1;  ///< relative cap over that of the truth; noisy particles cost more than paths
  double bias = 0;  ///< allowed relative bias
  int final_gather = 1;
};

/// Blur of the map changes the mean by the flux of the irradiance's gradient through the edge of
/// the visible part, times the radius squared over 8: less than this in these scenes. Records are
/// interpolated within the tolerance of the cache only where irradiance changes.
constexpr double kBlur = 6e-3;
constexpr double kInterpolation = 2e-3;

/// Every row but `auto`, which runs path or bdpt.
std::vector<Row> rows() {
  std::vector<Row> all;
  for (const core::IntegratorEntry& entry : core::integrators()) {
    const std::string name(entry.name);
    if (name == core::kAutomaticIntegrator) {
      continue;
    }
    if (entry.keeps_prepass) {
      all.push_back({name, &entry, 64, 1, kInterpolation});
    } else if (entry.prepass_bytes != nullptr) {
      all.push_back({name, &entry, 12, 4, kBlur});
    } else if (entry.error == core::ErrorValidity::kFromChains) {
      all.push_back({name, &entry, 32, 4});
    } else {
      const bool is_by_particles = name == "light-trace";
      all.push_back({name, &entry, is_by_particles ? 256 : 64, is_by_particles ? 4.0 : 1.0});
    }
    if (name == "photon-map") {
      all.push_back({name + " without final gathering", &entry, 24, 4, kBlur, 0});
    }
  }
  return all;
}

struct Truth {
  const char* name;
  core::View (*view)(float gain);  ///< gain: factor of the emission
  int max_depth;
  double value;
  double cap = 4e-3;     ///< relative; four standard errors must be within it
  double effort = 1;     ///< factor of the samples
  double scene = 0;      ///< allowed relative error of every row
  double particles = 1;  ///< further factor, of light-trace
};

core::View view_of(core::SceneDescription scene) {
  return test_support::view_of(std::move(scene), kSide, kSide);
}

/// A sphere of flat facets: the closed forms used here are exact in it.
core::PrimitiveDescription facets(Vec3 center, bool inward, int material) {
  core::PrimitiveDescription p = test_support::sphere(center, 1, 24, inward, material);
  p.normals.clear();
  return p;
}

core::View closed_sphere(float gain) {
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(0.5F * gain);
  core::View view = view_of(test_support::scene_of({lamp}, {facets({}, true, 0)}));
  test_support::look_at(view, {0.1F, 0.2F, 0.3F}, {1, 0.1F, -0.4F}, 70);
  return view;
}

/// Two white balls, which light each other.
core::View white_balls(float gain) {
  core::View view = view_of(test_support::scene_of(
      {test_support::lambert(Rgb(1))},
      {facets({-0.8F, -0.8F, 0}, false, 0), facets({0.8F, 0.8F, 0}, false, 0)}));
  test_support::look_at(view, {0, 0, 8}, {0, 0, 0}, 26);
  view.environment = test_support::constant_sky(Rgb(gain));
  return view;
}

core::MaterialDescription glass(float roughness) {
  core::MaterialDescription m;
  m.metallic = 0;
  m.roughness = roughness;
  m.transmission = 1;
  m.thickness = 1;
  return m;
}

core::View rough_glass_ball(float gain) {
  core::View view = view_of(test_support::scene_of({glass(0.5F)}, {facets({}, false, 0)}));
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 30);  // the ball fills the image
  view.environment = test_support::constant_sky(Rgb(gain));
  return view;
}

/// Looks down from `height_m` at the unit square around the origin of the floor.
void look_down(core::SceneDescription& scene, float height_m) {
  core::CameraDescription camera;
  camera.orthographic = true;
  camera.x_magnification = camera.y_magnification = 0.5F;
  camera.to_world = {{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {0, height_m, 0}};
  scene.cameras.push_back(camera);
}

core::PrimitiveDescription floor_quad(float half_m) {
  return test_support::quad({-half_m, 0, half_m}, {2 * half_m, 0, 0}, {0, 0, -2 * half_m}, 0);
}

/// The image is the form factor of two parallel unit squares at a distance of 1. The floor is
/// larger than its visible part, so disks of photons reach beyond no edge.
core::View parallel_squares(float gain) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(1)), test_support::emitter(Rgb(gain))},
      {floor_quad(0.6F), test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1)});
  look_down(scene, 0.9F);
  return view_of(std::move(scene));
}

/// That of two unit squares that share an edge.
core::View adjacent_squares(float gain) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(1)), test_support::emitter(Rgb(gain))},
      {floor_quad(0.5F), test_support::quad({-0.5F, 0, -0.5F}, {1, 0, 0}, {0, 1, 0}, 1)});
  look_down(scene, 0.9F);
  return view_of(std::move(scene));
}

core::View inside_glass(float gain) {
  core::View view = view_of(test_support::scene_of({glass(0)}, {facets({}, false, 0)}));
  test_support::look_at(view, {0, 0, 0}, {0, 0, -1}, 60);
  view.environment = test_support::constant_sky(Rgb(gain));
  return view;
}

/// A white disk in the centre of a glass ball, seen by a camera in the same glass. No light is
/// trapped: all of it meets the surface at less than the critical angle.
core::View disk_in_glass(float gain) {
  core::PrimitiveDescription disk;
  disk.material = 1;
  disk.positions.push_back({});
  constexpr std::uint32_t kSides = 32;
  for (std::uint32_t i = 0; i < kSides; ++i) {
    const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(i) / kSides;
    disk.positions.push_back({0.6F * std::cos(phi), 0.6F * std::sin(phi), 0});
    disk.indices.insert(disk.indices.end(), {0, 1 + i, 1 + (i + 1) % kSides});
  }
  core::View view = view_of(test_support::scene_of({glass(0), test_support::lambert(Rgb(1))},
                                                   {facets({}, false, 0), disk}));
  test_support::look_at(view, {0, 0, 0.7F}, {0, 0, 0}, 53);  // 0.35 m around the centre
  view.environment = test_support::constant_sky(Rgb(gain));
  return view;
}

core::PrimitiveDescription box(Vec3 low, Vec3 high, int material) {
  core::PrimitiveDescription p;
  p.material = material;
  for (unsigned i = 0; i < 8; ++i) {
    p.positions.push_back({(i & 1U) != 0 ? high.x : low.x, (i & 2U) != 0 ? high.y : low.y,
                           (i & 4U) != 0 ? high.z : low.z});
  }
  p.indices = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
               2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
  return p;
}

/// A white floor under a slab of optical depth 1/2 that absorbs, with the sky above; the camera is
/// between them. Black walls keep out light from the sides. They take less than 1e-4 of the light
/// that the formula counts, since that is so oblique.
core::View absorbing_slab(float gain) {
  core::MaterialDescription medium = glass(0);
  medium.ior = 1;
  medium.attenuation_distance = 0.02F;
  medium.attenuation_color = Rgb(std::exp(-1.0F));
  constexpr float kTop = 0.02F;
  constexpr float kWall = 0.75F;
  std::vector<core::PrimitiveDescription> parts = {
      floor_quad(0.62F), box({-kWall, kTop / 2, -kWall}, {kWall, kTop, kWall}, 1)};
  for (const float side : {-kWall, kWall}) {
    const Vec3 up = {0, 2 * kTop, 0};
    parts.push_back(test_support::quad({side, -kTop, -kWall}, up, {0, 0, 2 * kWall}, 2));
    parts.push_back(test_support::quad({-kWall, -kTop, side}, up, {2 * kWall, 0, 0}, 2));
  }
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(1)), medium, test_support::lambert({})}, std::move(parts));
  look_down(scene, kTop / 4);
  core::View view = view_of(std::move(scene));
  view.environment =
      test_support::sky_map(4, 2, [gain](int /*x*/, int y) { return y == 0 ? Rgb(gain) : Rgb{}; });
  return view;
}

/// Diffuse below a rough dielectric surface.
core::View rough_paint_ball(float gain) {
  core::MaterialDescription paint;
  paint.metallic = 0;
  paint.roughness = 0.5F;
  core::View view = view_of(test_support::scene_of({paint}, {facets({}, false, 0)}));
  test_support::look_at(view, {0, 0, 4}, {0, 0, 0}, 30);
  view.environment = test_support::constant_sky(Rgb(gain));
  return view;
}

/// Of the tables of energy compensation (truth 3).
constexpr double kTables = 5e-3;

const Truth kParallelSquares = {"parallel squares", &parallel_squares, 1, 0.199825};
const Truth kAdjacentSquares = {"adjacent squares", &adjacent_squares, 1, 0.200044, 8e-3, 2};
const Truth kRoughGlass = {
    "white furnace, rough glass", &rough_glass_ball, 32, 1, 1.2e-2, 2, kTables};
const Truth kDiskInGlass = {"disk in glass", &disk_in_glass, 64, 2.25, 1.2e-2, 0.5, 0, 2};

std::vector<Truth> truths() {
  return {{"closed sphere, one bounce", &closed_sphere, 1, 0.75, 4e-3, 0.5},  // 1 - rho^2
          {"closed sphere", &closed_sphere, 32, 1},                           // L_e / (1 - rho)
          {"white furnace, Lambert", &white_balls, 32, 1},
          {"white furnace, paint", &rough_paint_ball, 32, 1, 4e-3, 1, kTables},
          kRoughGlass,
          kParallelSquares,
          kAdjacentSquares,
          {"inside glass", &inside_glass, 64, 2.25, 4e-3, 0.125},  // every path has the same value
          kDiskInGlass,
          // 2 E_3(1/2), the transmitted part of diffuse light.
          {"absorbing slab", &absorbing_slab, 1, 0.4432087, 6e-3, 0.5, 0, 4}};
}

bool applies(const Truth& truth, const Row& row) {
  const bool is_map = row.entry->prepass_bytes != nullptr && !row.entry->keeps_prepass;
  if (row.name == "direct" && truth.max_depth > 1) {
    return false;  // renders one bounce
  }
  if (truth.view == kRoughGlass.view && (is_map || row.name == "light-trace")) {
    return false;  // photons: glass is path traced as by path; light-trace: too noisy for a
                   // decision
  }
  if (truth.view == kAdjacentSquares.view && is_map) {
    return false;  // light sampling without MIS: its variance is infinite where the squares meet
  }
  return true;
}

Moments means(const Truth& truth, const Row& row, float gain) {
  core::View view = truth.view(gain);
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(row.entry->name);
  view.settings.film = film;
  view.settings.max_depth = truth.max_depth;
  view.settings.photons = {.paths = 6144, .radius_m = 0.1F, .final_gather = row.final_gather};
  const double particles = row.name == "light-trace" ? truth.particles : 1;
  const int samples = static_cast<int>(truth.effort * particles * row.samples);
  Moments out;
  for (int i = 0; i < kSeeds; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(i) + 1;
    const auto picture = test_support::render(view, samples);
    EXPECT_EQ(picture.progress.rejected_samples, 0U) << row.name << ", " << truth.name;
    out.add(static_cast<double>(picture.mean().g));
  }
  return out;
}

/// The rule: the mean is that value, except for the allowed bias and float rounding.
bool is_value(const Moments& seen, double value, const Truth& truth, const Row& row) {
  const double slack = (row.bias + truth.scene + 1e-5) * value;
  const double off = std::max(std::fabs(seen.mean - value) - slack, 0.0);
  const double error = seen.standard_error();
  return off == 0 ||
         (error > 0 && 2 * (1 - test_support::student_t_cdf(off / error, kSeeds - 1)) > kLevel);
}

/// A value that an image too bright by three caps has.
double too_bright(const Truth& truth, const Row& row) {
  return 1 + 3 * row.caps * truth.cap + 2 * (row.bias + truth.scene);
}

void PrintTo(const Truth& truth, std::ostream* out) { *out << truth.name; }

class Truths : public testing::TestWithParam<Truth> {};

INSTANTIATE_TEST_SUITE_P(ClosedForms, Truths, testing::ValuesIn(truths()), [](const auto& of) {
  std::string name(of.param.name);
  name.erase(std::remove_if(name.begin(), name.end(), [](char c) { return c == ',' || c == ' '; }),
             name.end());
  return name;
});

TEST_P(Truths, HoldForEveryIntegrator) {
  const Truth& truth = GetParam();
  for (const Row& row : rows()) {
    if (!applies(truth, row)) {
      continue;
    }
    const Moments seen = means(truth, row, 1);
    const double error = seen.standard_error() / truth.value;
    const std::string what = std::string(truth.name) + ", " + row.name + ": " +
                             std::to_string(seen.mean) + " +- " + std::to_string(error);
    EXPECT_TRUE(is_value(seen, truth.value, truth, row)) << what;
    EXPECT_LE(4 * error, row.caps * truth.cap) << what << " is too noisy for a decision";
    EXPECT_FALSE(is_value(seen, truth.value * too_bright(truth, row), truth, row)) << what;
    if (truth.view == kDiskInGlass.view) {  // n^2 missing, and counted twice
      EXPECT_FALSE(is_value(seen, 1, truth, row)) << what;
      EXPECT_FALSE(is_value(seen, 2.25 * 2.25, truth, row)) << what;
    }
  }
}

// The planted fault: emission that is too strong by three caps.
TEST(TruthsTwin, TooMuchEmissionIsRejectedForEveryIntegrator) {
  for (const Row& row : rows()) {
    const double gain = too_bright(kParallelSquares, row);
    const Moments seen = means(kParallelSquares, row, static_cast<float>(gain));
    EXPECT_FALSE(is_value(seen, kParallelSquares.value, kParallelSquares, row)) << row.name;
  }
}

}  // namespace
