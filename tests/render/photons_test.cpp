// Photon mapping: its blur matches the prediction, its light the closed form, and its films are
// independent of scheduling.
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>

#include "core/integrators/maps/photon_rules.h"
#include "core/integrators/registry.h"
#include "core/render/task/render_task.h"
#include "core/render/task/settle.h"
#include "tests/render/truth.h"
#include "tests/support/caustic.h"
#include "tests/support/statistics.h"
#include "tests/support/tasks.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Picture;

constexpr float kAlbedo = 0.7F;
constexpr float kRadius = 0.2F;
constexpr int kColumns = 32;
constexpr int kRows = 8;
constexpr float kViewWidth = 0.8F;  // of the floor

/// Looks straight down at the floor from a height of 1 m; columns run along x around 0.
core::View floor_view(core::SceneDescription scene, const char* integrator, int max_depth) {
  core::View view = test_support::view_of(std::move(scene), kColumns, kRows);
  const float half = kViewWidth / 2 * kRows / kColumns;
  test_support::look_at(view, {0, 1, 0}, {0, 0, 0},
                        2 * std::atan(half) * 180 / std::numbers::pi_v<float>);
  view.camera.up = Vec3{0, 0, -1};
  view.settings.integrator = integrator;
  view.settings.max_depth = max_depth;
  view.settings.photons.radius_m = kRadius;
  view.settings.photons.paths = 1 << 15;
  return view;
}

core::PrimitiveDescription floor_quad() {
  return test_support::quad({-0.9F, 0, 0.5F}, {1.8F, 0, 0}, {0, 0, -1}, 0);
}

/// Light straight down on x > 0: an awning above the camera keeps the rest in shadow.
core::SceneDescription half_lit() {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(kAlbedo))},
      {floor_quad(), test_support::quad({-0.9F, 1.2F, 0.5F}, {0.9F, 0, 0}, {0, 0, -1}, 0)});
  scene.lights.push_back(test_support::directional({{1, 0, 0}, {0, 0, -1}, {0, 1, 0}, {}}));
  return scene;
}

/// The same light reflected by a mirror at 45 degrees above the camera: a caustic on 0 < x < 1.
core::SceneDescription half_mirrored() {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(kAlbedo)), test_support::mirror()},
      {floor_quad(), test_support::quad({0, 2.2F, 0.5F}, {0, 0, -1}, {1, -1, 0}, 1)});
  scene.lights.push_back(test_support::directional({{0, 0, 1}, {0, 1, 0}, {-1, 0, 0}, {}}));
  return scene;
}

/// Fraction of a disk around x that is at x > 0.
double lit_share(double x, double radius) {
  const double t = std::clamp(x / radius, -1.0, 1.0);
  return 1 - (std::acos(t) - t * std::sqrt(1 - t * t)) / std::numbers::pi;
}

/// Largest difference of the columns' means from the prediction, over the unoccluded irradiance.
/// share(x): lit fraction of the disks around a column.
double worst_column(const Picture& picture, const std::function<double(double)>& share) {
  double worst = 0;
  for (int column = 0; column < kColumns; ++column) {
    double sum = 0;
    for (int row = 0; row < kRows; ++row) {
      const auto pixel = static_cast<std::size_t>(row * kColumns + column);
      sum += static_cast<double>(core::pixel_value(picture.snapshot, pixel).mean.g);
    }
    const double light = sum / kRows * std::numbers::pi / static_cast<double>(kAlbedo);
    const double x = ((column + 0.5) / kColumns - 0.5) * static_cast<double>(kViewWidth);
    worst = std::max(worst, std::fabs(light - share(x)));
  }
  return worst;
}

TEST(PhotonMapping, ShadowEdgeIsBlurredByTheSegmentOfTheDisk) {
  core::View view = floor_view(half_lit(), "photon-map", 1);
  view.settings.photons.final_gather = 0;
  const Picture picture = test_support::render(view, 32);
  EXPECT_LT(worst_column(picture, [](double x) { return lit_share(x, kRadius); }), 0.02);
  // The planted fault: a disk a fifth wider does not match.
  EXPECT_GT(worst_column(picture, [](double x) { return lit_share(x, double{1.2F * kRadius}); }),
            0.02);
}

/// Mean over passes of lit_share() around x.
double mean_share(double x, float alpha, int passes) {
  double sum = 0;
  for (int pass = 0; pass < passes; ++pass) {
    sum += lit_share(x, double{kRadius} * core::sppm_radius(alpha, pass));
  }
  return sum / passes;
}

/// The blur of a caustic after `passes` of each of two replicates is that of the published radii.
void expect_published_blur(const core::View& view, int passes) {
  const Picture picture = test_support::render(view, 2 * passes);
  const auto worst = [&](float alpha) {
    return worst_column(picture, [&](double x) { return mean_share(x, alpha, passes); });
  };
  EXPECT_LT(worst(view.settings.photons.alpha), 0.02);
  // The planted faults: constant radii, and radii that shrink faster.
  EXPECT_GT(worst(1), 0.04);
  EXPECT_GT(worst(0.2F), 0.04);
}

TEST(PhotonMapping, ProgressiveRadiiBlurACausticAsPublished) {
  expect_published_blur(floor_view(half_mirrored(), "sppm", 2), 64);
}

// Behind glass no connection finds the caustic, so merging has a weight of 1. The slab hardly
// refracts, and reflects 6e-6.
TEST(Merging, DisksBlurACausticBehindGlassAsPublished) {
  core::SceneDescription scene = half_mirrored();
  scene.materials.push_back(test_support::glass(1.005F));
  for (const float side : {1.0F, -1.0F}) {  // top and bottom
    scene.meshes[0].primitives.push_back(test_support::quad(
        {-0.95F, 0.45F + 0.05F * side, 0.55F * side}, {2, 0, 0}, {0, 0, -1.1F * side}, 2));
  }
  core::View view = floor_view(std::move(scene), "vcm", 6);
  view.settings.photons.paths = 1 << 13;
  expect_published_blur(view, 64);
  view.settings.integrator = "path-caustics";
  expect_published_blur(view, 64);
}

// A lamp lights a white ceiling, and that a glass ball: paths find all light, and what the ball
// bends is no caustic, for it has come from the lamp over a diffuse surface.
TEST(Merging, CausticsBeginAtLightsAndNotAtDiffuseSurfaces) {
  core::View view = test_support::view_of(
      test_support::scene_of(
          {test_support::lambert(Rgb(0.6F)), test_support::glass(), test_support::emitter(Rgb(12))},
          {test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0),
           test_support::quad({-1, 2.5F, -1}, {2, 0, 0}, {0, 0, 2}, 0),
           test_support::sphere({0, 0.7F, 0}, 0.5F, 16, false, 1),
           test_support::quad({-0.5F, 1.8F, 0.5F}, {1, 0, 0}, {0, 0, -1}, 2)}),
      24, 24);
  test_support::look_at(view, {0, 1.2F, 2}, {0, 0.2F, 0}, 40);
  view.settings.max_depth = 8;
  const auto mean = static_cast<double>(test_support::render(view, 512).mean().g);
  view.settings.photons.radius_m = 0.04F;
  view.settings.integrator = "path-caustics";
  EXPECT_NEAR(static_cast<double>(test_support::render(view, 128).mean().g), mean, 0.01 * mean);
}

// The published rate: after N passes bias ~ N^(alpha - 1) and variance ~ N^-alpha. Source: Knaus
// and Zwicker 2011. Replicates serve as seeds.
constexpr int kSeeds = 16;
constexpr std::array<double, 4> kPasses = {4, 16, 64, 256};
constexpr double kColumnWidth = double{kViewWidth} / kColumns;
// Four means and a slope of the bias, a slope of the variance: false alarm 0.1% for all.
const double kLevel = test_support::sidak(1e-3, 6);

struct Measured {
  double value = 0;
  double error = 0;  ///< standard error
};
using Rate = std::array<Measured, kPasses.size()>;
using Curve = std::array<double, kPasses.size()>;

/// Means of (r_i / r_0)^(2 power) over N passes.
Curve mean_areas(double alpha, int power, const Curve& passes = kPasses) {
  Curve means{};
  double area = 1;
  double sum = 0;
  int i = 0;
  for (std::size_t n = 0; n < passes.size(); ++n) {
    for (; i < passes[n]; ++i) {
      sum += std::pow(area, power);
      area *= (i + 1 + alpha) / (i + 2);
    }
    means[n] = sum / passes[n];
  }
  return means;
}

/// Disks cover H * k of the light, where H is a step and k the density of x over a disk, of
/// variance r^2 / 4. The first moment of H * k - H is, by parts, that of -x^2 / 2 (k - delta): -r^2
/// / 8.
Curve negative_moments(double alpha) {
  Curve out = mean_areas(alpha, 1);
  for (double& value : out) {
    value *= double{kRadius} * double{kRadius} / 8;
  }
  return out;
}

/// Counts of particles are Poisson: the variance of a pass is inverse to the area. Up to a factor.
Curve variances(double alpha, const Curve& passes = kPasses) {
  Curve out = mean_areas(alpha, -1, passes);
  for (std::size_t n = 0; n < out.size(); ++n) {
    out[n] /= passes[n];
  }
  return out;
}

double log_slope(const Curve& values, const Curve& passes = kPasses) {
  Curve x{};
  Curve y{};
  for (std::size_t n = 0; n < values.size(); ++n) {
    x[n] = std::log(passes[n]);
    y[n] = std::log(values[n]);
  }
  return test_support::slope(x, y);
}

/// p-value of the fitted slope if the true values are `truth` times any factor.
double p_of_slope(const Rate& rate, const Curve& truth) {
  Curve ratios{};
  for (std::size_t n = 0; n < rate.size(); ++n) {
    ratios[n] = rate[n].value / truth[n];
  }
  const double off = log_slope(ratios);
  double error = 0;
  for (std::size_t n = 0; n < rate.size(); ++n) {
    Curve one = {1, 1, 1, 1};
    one[n] = std::exp(rate[n].error / rate[n].value);
    error = std::hypot(error, log_slope(one));
  }
  std::printf("    slope %.4f +- %.4f for %.4f\n", off + log_slope(truth), error, log_slope(truth));
  return test_support::two_sided_p(off / error);
}

/// Floor light of each seed after N passes; unoccluded: 1.
class SeededColumns {
 public:
  SeededColumns(core::View view, int passes) {
    view.settings.replicates = kSeeds;
    picture_ = test_support::render(view, kSeeds * passes);
  }
  double light(int seed, int column, int row) const {
    const auto pixel = static_cast<std::size_t>(row * kColumns + column);
    const float mean =
        picture_.snapshot.pixels[pixel * kSeeds + static_cast<std::size_t>(seed)].mean_g;
    return static_cast<double>(mean) * std::numbers::pi / double{kAlbedo};
  }

 private:
  Picture picture_;
};

// Blur ends within a radius of the edge, which is between columns. A column's light counts at its
// centre: that is the moment of x^2 / 2 interpolated linearly between edges of columns, on average
// width^2 / 12 more.
TEST(PhotonMapping, ProgressiveBiasFallsAtThePublishedRate) {
  core::View view = floor_view(half_mirrored(), "sppm", 2);
  view.settings.photons.paths = core::kPhotonPathsLeast;
  constexpr auto kReach = static_cast<int>(double{kRadius} / kColumnWidth + 0.5);
  Rate bias;
  for (std::size_t n = 0; n < bias.size(); ++n) {
    const SeededColumns columns(view, static_cast<int>(kPasses[n]));
    test_support::Moments seeds;
    for (int seed = 0; seed < kSeeds; ++seed) {
      double moment = 0;
      for (int column = kColumns / 2 - kReach; column < kColumns / 2 + kReach; ++column) {
        const double x = (column + 0.5 - kColumns / 2) * kColumnWidth;
        for (int row = 0; row < kRows; ++row) {
          moment += x * (columns.light(seed, column, row) - (x > 0 ? 1 : 0)) * kColumnWidth / kRows;
        }
      }
      seeds.add(-moment - kColumnWidth * kColumnWidth / 12);
    }
    bias[n] = {seeds.mean, seeds.standard_error()};
    std::printf("    %3.0f passes: %.3e +- %.1e\n", kPasses[n], bias[n].value, bias[n].error);
  }
  const auto least_p = [&](double alpha) {
    const Curve truth = negative_moments(alpha);
    double least = 1;
    for (std::size_t n = 0; n < bias.size(); ++n) {
      const double t = std::fabs(bias[n].value - truth[n]) / bias[n].error;
      least = std::min(least, 2 * (1 - test_support::student_t_cdf(t, kSeeds - 1)));
    }
    return least;
  };
  const auto slope_p = [&](double alpha) { return p_of_slope(bias, negative_moments(alpha)); };
  EXPECT_GT(least_p(2.0 / 3), kLevel);
  EXPECT_GT(slope_p(2.0 / 3), kLevel);
  // The planted faults.
  for (const double alpha : {0.5, 0.8}) {
    EXPECT_LT(least_p(alpha), kLevel) << alpha;
    EXPECT_LT(slope_p(alpha), kLevel) << alpha;
  }
}

// Disks so small that they rarely share a stratum of the particles' point set nor overlap those of
// other pixels.
TEST(PhotonMapping, ProgressiveVarianceFallsAtThePublishedRate) {
  core::View view = floor_view(half_mirrored(), "sppm", 2);
  view.settings.photons.paths = core::kPhotonPathsLeast;
  view.settings.photons.radius_m = 0.01F;
  Rate variance;
  for (std::size_t n = 0; n < variance.size(); ++n) {
    const SeededColumns columns(view, static_cast<int>(kPasses[n]));
    test_support::Moments pixels;
    for (int column = kColumns / 2 + 1; column < kColumns; ++column) {
      for (int row = 0; row < kRows; ++row) {
        test_support::Moments seeds;
        for (int seed = 0; seed < kSeeds; ++seed) {
          seeds.add(columns.light(seed, column, row));
        }
        pixels.add(seeds.variance());
      }
    }
    variance[n] = {pixels.mean, pixels.standard_error()};
    std::printf("    %3.0f passes: %.3e +- %.1e\n", kPasses[n], variance[n].value,
                variance[n].error);
  }
  EXPECT_GT(p_of_slope(variance, variances(2.0 / 3)), kLevel);
  // The planted faults.
  EXPECT_LT(p_of_slope(variance, variances(0.5)), kLevel);
  EXPECT_LT(p_of_slope(variance, variances(0.8)), kLevel);
}

// The sums that the measured slopes are compared with have the published slopes after many passes.
TEST(PhotonMapping, SumsOverRadiiTendToThePublishedSlopes) {
  constexpr Curve kMany = {1 << 14, 1 << 16, 1 << 18, 1 << 20};
  for (const double alpha : {0.5, 2.0 / 3, 0.8}) {
    EXPECT_NEAR(log_slope(mean_areas(alpha, 1, kMany), kMany), alpha - 1, 0.01) << alpha;
    EXPECT_NEAR(log_slope(variances(alpha, kMany), kMany), -alpha, 0.01) << alpha;
  }
}

struct Mode {
  const char* integrator;
  int final_gather;
};
constexpr std::array<Mode, 6> kModes = {{{"sppm", 1},
                                         {"vcm", 1},
                                         {"path-caustics", 1},
                                         {"photon-map", 0},
                                         {"photon-map", 1},
                                         {"photon-map", 3}}};

// Truth 1: L = L_e / (1 - rho) = 1, and 1 - rho^(k + 1) at depth k.
TEST(PhotonMapping, ClosedSphereHasRadianceOne) {
  auto lamp = test_support::lambert(Rgb(0.5F));
  lamp.emissive = Rgb(0.5F);
  core::View view = test_support::view_of(
      test_support::scene_of({lamp}, {test_support::sphere({0, 0, 0}, 1, 24, true, 0)}), 24, 24);
  test_support::look_at(view, {0.1F, 0.2F, 0.3F}, {1, 0.1F, -0.4F}, 70);
  view.settings.photons.radius_m = 0.1F;
  view.settings.photons.paths = 1 << 14;
  for (const Mode& mode : kModes) {
    view.settings.integrator = mode.integrator;
    view.settings.photons.final_gather = mode.final_gather;
    for (const int depth : {1, 2, 3, 32}) {
      view.settings.max_depth = depth;
      const Picture picture = test_support::render(view, 8);
      const double truth = 1 - std::pow(0.5, depth + 1);
      // Facets tilted by up to 7.5 degrees: areas within a disk are off by less than 1%.
      EXPECT_NEAR(static_cast<double>(picture.mean().g), truth, 0.01 * truth)
          << mode.integrator << " " << mode.final_gather << " at depth " << depth;
    }
  }
}

// Blur redistributes light but loses none: means of an image with a caustic in its centre.
TEST(PhotonMapping, CausticsHaveTheEnergyOfLightTracing) {
  core::View view = test_support::caustic();
  view.settings.film.width = view.settings.film.height = 24;
  view.settings.integrator = "light-trace";
  const Picture reference = test_support::render(view, 512);
  view.settings.photons.paths = 1 << 14;
  view.settings.photons.radius_m = 0.04F;
  for (const Mode& mode : kModes) {
    view.settings.integrator = mode.integrator;
    view.settings.photons.final_gather = mode.final_gather;
    const Picture picture = test_support::render(view, 32);
    const auto mean = static_cast<double>(reference.mean().g);
    EXPECT_NEAR(static_cast<double>(picture.mean().g), mean, 0.02 * mean)
        << mode.integrator << " " << mode.final_gather;
  }
  // The planted fault: without caustics, which only the glass causes, at least a tenth is missing.
  view.settings.integrator = "direct";
  view.settings.max_depth = 1;
  EXPECT_LT(static_cast<double>(test_support::render(view, 256).mean().g),
            0.9 * static_cast<double>(reference.mean().g));
}

TEST(Prepass, FilmsAreIndependentOfRestartsAndThreads) {
  core::View view = test_support::caustic();
  view.settings.film.width = 72;
  view.settings.film.height = 40;
  view.settings.photons.paths = 4096;
  view.settings.cache = {.tolerance = 0.5F, .rays = 32, .records = 100};
  for (const core::IntegratorEntry& row : core::integrators()) {
    if (row.prepass_bytes == nullptr) {
      continue;
    }
    const std::string integrator(row.name);
    view.settings.integrator = integrator;
    const std::string calm = test_support::render(view, 4, 1).film->digest();
    EXPECT_EQ(test_support::render(view, 4, 3).film->digest(), calm) << integrator;
    const auto renderer = test_support::renderer_of(view);
    const core::TaskOptions options = test_support::samples(4);
    // Records of the cache are separate slices.
    for (int taken = 2; taken < 350; taken = taken < 60 ? taken + 7 : taken + 97) {
      const auto film = core::make_film(view.settings);
      core::NullSink sink;
      core::RenderTask task(renderer, film, options, sink);
      test_support::run_slices(task, taken);
      const auto again = test_support::restored(*film);
      core::RenderTask rest(renderer, again, options, sink);
      core::run_to_end(rest, 3);
      EXPECT_EQ(again->digest(), calm) << integrator << " after " << taken;
    }
    // The planted fault: another seed gives another film.
    core::View other = view;
    other.settings.seed = 1;
    EXPECT_NE(test_support::render(other, 4, 1).film->digest(), calm);
  }
}

TEST(PhotonMapping, CountsRaysAndSecondsOfPhotons) {
  core::View view = floor_view(half_mirrored(), "sppm", 2);
  const Picture few = test_support::render(view, 2);
  view.settings.photons.paths *= 2;
  const Picture many = test_support::render(view, 2);
  // At least two rays per particle, two samples.
  EXPECT_GT(many.progress.rays, few.progress.rays + (2ULL << 15));
  EXPECT_GT(few.progress.cpu_seconds, 0);
}

}  // namespace
