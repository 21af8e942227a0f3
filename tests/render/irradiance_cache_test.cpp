// Irradiance caching: closed forms, and agreement with path tracing within the allowed error.
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/integrators/registry.h"
#include "tests/render/truth.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Picture;

constexpr double kPi = std::numbers::pi;

// Truth 1: L = L_e / (1 - rho) = 1, and 1 - rho^(k + 1) at depth k, for every allowed error.
TEST(IrradianceCaching, ClosedSphereHasRadianceOne) {
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(0.5F);
  core::View view = test_support::view_of(
      test_support::scene_of({lamp}, {test_support::sphere({0, 0, 0}, 1, 24, true, 0)}), 24, 24);
  test_support::look_at(view, {0.1F, 0.2F, 0.3F}, {1, 0.1F, -0.4F}, 70);
  view.settings = core::default_settings("irradiance-cache");
  view.settings.film.width = view.settings.film.height = 24;
  view.settings.film.filter = {};
  view.settings.cache.rays = 256;
  for (const float tolerance : {0.2F, 1.0F}) {
    view.settings.cache.tolerance = tolerance;
    for (const int depth : {1, 2, 3, 32}) {
      view.settings.max_depth = depth;
      const Picture picture = test_support::render(view, 8);
      const double truth = 1 - std::pow(0.5, depth + 1);
      EXPECT_NEAR(static_cast<double>(picture.mean().g), truth, 0.005 * truth)
          << tolerance << " at depth " << depth;
    }
  }
}

constexpr double kAlbedo = 0.7;
constexpr int kColumns = 24;
constexpr int kRows = 4;

/// Irradiance on the floor at (x, 0, 0), whose normal is y, from a wall of radiance 1 at x = -1, 2
/// m wide and 1 m high. Form factor from a point to a perpendicular rectangle: Howell, "A Catalog
/// of Radiation Heat Transfer Configuration Factors", B-5, times pi.
double under_wall(double x) {
  const double c = x + 1;
  const double half = 1;
  const double h = std::sqrt(1 + c * c);
  return std::atan(half / c) - c / h * std::atan(half / h);
}

/// A sun parallel to the floor on a wall of albedo kAlbedo, which lights the floor; seen from
/// above.
core::View sunlit_wall() {
  core::SceneDescription scene =
      test_support::scene_of({test_support::lambert(Rgb(static_cast<float>(kAlbedo)))},
                             {test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0),
                              test_support::quad({-1, 0, 1}, {0, 0, -2}, {0, 1, 0}, 0)});
  // along -x
  scene.lights.push_back(test_support::directional({{0, 0, -1}, {0, 1, 0}, {1, 0, 0}, {}}));
  core::View view = test_support::view_of(std::move(scene), kColumns, kRows);
  const float half = 0.75F * kRows / kColumns;  // 1.5 m of the floor, from x = -0.75
  test_support::look_at(view, {0, 1, 0}, {0, 0, 0},
                        2 * std::atan(half) * 180 / std::numbers::pi_v<float>);
  view.camera.up = Vec3{0, 0, -1};
  view.settings.integrator = "irradiance-cache";
  view.settings.max_depth = 2;
  return view;
}

/// Largest error of a column's mean, over the irradiance of the first column.
double worst_column(const core::View& view, int samples) {
  const Picture picture = test_support::render(view, samples);
  double worst = 0;
  for (int column = 0; column < kColumns; ++column) {
    double sum = 0;
    for (int row = 0; row < kRows; ++row) {
      const auto pixel = static_cast<std::size_t>(row * kColumns + column);
      sum += static_cast<double>(core::pixel_value(picture.snapshot, pixel).mean.g) / kRows;
    }
    const double x = ((column + 0.5) / kColumns - 0.5) * 1.5;
    const double truth = kAlbedo / kPi * (kAlbedo / kPi * under_wall(x));
    worst = std::max(
        worst, std::fabs(sum - truth) / (kAlbedo / kPi * (kAlbedo / kPi * under_wall(-0.75))));
  }
  return worst;
}

TEST(IrradianceCaching, SunlitWallLightsTheFloorByItsFormFactor) {
  core::View view = sunlit_wall();
  view.settings.cache.rays = 4096;  // so that their noise is negligible
  EXPECT_LT(worst_column(view, 8), 0.01);
  // The planted fault: coarse records are less accurate.
  view.settings.cache.tolerance = 1;
  view.settings.cache.rays = 16;
  EXPECT_GT(worst_column(view, 8), 0.02);
}

/// The box in glossy paint, which adds specular to diffuse reflection.
core::View glossy_box() {
  core::SceneDescription scene = test_support::cornell();
  for (core::MaterialDescription& m : scene.materials) {
    if (core::is_black(m.emissive)) {
      m.specular = 1;
      m.roughness = 0.4F;
    }
  }
  core::View view = test_support::view_of(std::move(scene), 32, 32);
  test_support::look_at(view, {0.5F, 0.5F, 2.4F}, {0.5F, 0.5F, 0}, 30);
  view.settings.max_depth = 8;
  view.settings.cache.rays = 256;
  return view;
}

struct Difference {
  double mean = 0;  ///< of the images, relative
  double rms = 0;   ///< of blocks of 4 x 4 pixels, over the mean
};

Difference against_path(core::View view, const char* integrator, int samples) {
  view.settings.integrator = "path";
  view.settings.seed = 7;
  const Picture path = test_support::render(view, 256);
  view.settings.integrator = integrator;
  const Picture cached = test_support::render(view, samples);
  constexpr int kBlock = 4;
  const int width = view.settings.film.width;
  const int blocks = width / kBlock;
  std::vector<double> one(static_cast<std::size_t>(blocks * blocks));
  std::vector<double> other(one.size());
  for (int y = 0; y < width; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto block = static_cast<std::size_t>(y / kBlock * blocks + x / kBlock);
      const auto pixel = static_cast<std::size_t>(y * width + x);
      one[block] += static_cast<double>(core::pixel_value(cached.snapshot, pixel).mean.g);
      other[block] += static_cast<double>(core::pixel_value(path.snapshot, pixel).mean.g);
    }
  }
  Difference out;
  const auto count = static_cast<double>(one.size());
  double sum = 0;
  double squares = 0;
  for (std::size_t i = 0; i < one.size(); ++i) {
    out.mean += one[i] - other[i];
    sum += other[i];
    squares += (one[i] - other[i]) * (one[i] - other[i]);
  }
  out.mean /= sum;
  out.rms = std::sqrt(squares / count) * count / sum;
  return out;
}

// Blocks of 16 pixels: their noise is 1%. The allowed interpolation error is a quarter of a part
// of the light, and gradients remove most of it.
TEST(IrradianceCaching, AgreesWithPathTracing) {
  core::View view = glossy_box();
  const Difference seen = against_path(view, "irradiance-cache", 64);
  EXPECT_LT(std::fabs(seen.mean), 0.01);
  EXPECT_LT(seen.rms, 0.03);
  // The planted fault: no indirect light.
  EXPECT_LT(against_path(view, "direct", 16).mean, -0.1);
}

// If there is no memory for records, paths continue; the only cost is noise.
TEST(IrradianceCaching, FallsBackToPathTracingWithoutMemory) {
  core::View view = glossy_box();
  view.settings.cache.records = 1;
  const Difference seen = against_path(view, "irradiance-cache", 128);
  EXPECT_LT(std::fabs(seen.mean), 0.01);
  EXPECT_LT(seen.rms, 0.03);
}

}  // namespace
