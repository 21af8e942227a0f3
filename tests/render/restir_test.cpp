// Light samples reused between pixels: whole images against those of the light tree, weights
// against planted faults, and determinism.
#include <array>
#include <cmath>

#include "core/base/check.h"
#include "core/light_samplers/light_sampler.h"
#include "core/sampling/shared_samples.h"
#include "core/scene_io/builtin_scenes.h"
#include "core/scene_io/gltf_load.h"
#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::LightSamplerType;
using core::Rgb;
using core::Vec3;
using core::View;
using test_support::Moments;

constexpr int kWidth = 48;
constexpr int kHeight = 32;
constexpr std::size_t kReplicates = 16;
constexpr int kBlock = 16;
constexpr std::size_t kBlocks = static_cast<std::size_t>(kWidth / kBlock) * (kHeight / kBlock);

View builtin(const char* name) {
  const auto glb = core::find_builtin_scene(name)->make_glb();
  auto description = core::load_gltf(glb, {}, {});
  CHECK(description);
  View view = test_support::view_of(std::move(*description), kWidth, kHeight);
  const core::SceneData& data = view.scene->data();
  if (data.punctual_lights.empty() && data.triangle_lights.empty()) {
    view.environment = test_support::constant_sky(Rgb(1));
  }
  view.settings.max_depth = 1;  // light of emitters at first surfaces: by light samples, and by
                                // BSDF samples that hit emitters
  return view;
}

/// Cases in which neighbours cannot draw a sample: spots with hard cones, emitters whose back or
/// whose plane divides the floor, balls that face away from emitters near the floor, and shadows of
/// a grating.
View edges(float power) {
  std::vector<core::PrimitiveDescription> things = {
      test_support::quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, 0),
      test_support::sphere({-0.8F, 0.4F, 0}, 0.4F, 16, false, 1),
      test_support::sphere({0.9F, 0.3F, 0.5F}, 0.3F, 16, false, 0),
      test_support::quad({0.2F, 0.1F, -0.5F}, {0, 0.5F, 0}, {0.5F, 0, 0}, 2),
      test_support::quad({-1.8F, 0.02F, -1}, {0, 0, 0.8F}, {0, 0.3F, 0}, 2),
  };
  for (int i = 0; i < 6; ++i) {
    things.push_back(test_support::quad({-1.2F + 0.4F * static_cast<float>(i), 0.3F, 1.2F},
                                        {0.2F, 0, 0}, {0, 0, -0.7F}, 0));
  }
  core::MaterialDescription plastic;
  plastic.metallic = 0;
  plastic.roughness = 0.3F;
  plastic.base_color = {0.3F, 0.6F, 0.4F};
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert(Rgb(0.6F)), plastic, test_support::emitter(Rgb(4 * power))}, things);
  for (int i = 0; i < 4; ++i) {
    core::PunctualLightDescription spot;
    spot.type = core::PunctualType::kSpot;
    spot.intensity = Rgb(3 * power);
    spot.inner_cone_rad = 0.3F;
    spot.outer_cone_rad = 0.301F;
    spot.to_world = core::translation({-1.2F + 0.8F * static_cast<float>(i), 1.5F, 0.7F}) *
                    core::rotation({-std::sqrt(0.5F), 0, 0, std::sqrt(0.5F)});
    scene.lights.push_back(spot);
  }
  View view = test_support::view_of(std::move(scene), kWidth, kHeight);
  test_support::look_at(view, {0, 1.6F, 3}, {0, 0.1F, 0.2F}, 45);
  view.settings.max_depth = 1;
  return view;
}

/// Sum of each block, and last that of the image, in green: for each of the replicates, which are
/// independent.
using Blocks = std::array<std::array<double, kBlocks + 1>, kReplicates>;

Blocks blocks_of(View view, int samples) {
  view.settings.replicates = kReplicates;
  view.settings.seed = 5;
  const test_support::Picture picture = test_support::render(view, samples);
  EXPECT_EQ(picture.progress.rejected_samples, 0U);
  Blocks out{};
  for (std::size_t r = 0; r < kReplicates; ++r) {
    for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
      const auto g = static_cast<double>(picture.snapshot.pixels[p * kReplicates + r].mean_g);
      out[r][p / kWidth / kBlock * (kWidth / kBlock) + p % kWidth / kBlock] += g;
      out[r].back() += g;
    }
  }
  return out;
}

struct Agreement {
  double picture = 1;  ///< p-value of the image's mean
  double least = 1;    ///< smallest p-value of a block
  double error = 0;    ///< relative standard error of the difference of the images
};

/// Both images use one seed, and so the same camera rays and BSDF samples: they differ only in
/// light samples. Student's t of the differences of the replicates. Where almost nothing differs,
/// the differences are MIS weights: a little less light in every replicate, and that much more in
/// the few where a rare BSDF sample hits an emitter, too few for t. A ten thousandth of the light
/// is allowed for those.
constexpr double kRare = 1e-4;

Agreement compare(const Blocks& a, const Blocks& b) {
  Agreement out;
  for (std::size_t i = 0; i <= kBlocks; ++i) {
    Moments difference;
    Moments light;
    for (std::size_t r = 0; r < kReplicates; ++r) {
      difference.add(a[r][i] - b[r][i]);
      light.add(b[r][i]);
    }
    const double t =
        std::fabs(difference.mean) / std::hypot(difference.standard_error(), kRare * light.mean);
    const double p = 2 * (1 - test_support::student_t_cdf(t, kReplicates - 1));
    (i == kBlocks ? out.picture : out.least) = i == kBlocks ? p : std::min(out.least, p);
    out.error = difference.standard_error() / light.mean;
  }
  return out;
}

struct Sharing {
  int candidates = 1;
  int block = 1;
  int history = 1;
};

View shared(View view, const Sharing& sharing) {
  view.settings.light_sampler = LightSamplerType::kRestir;
  view.settings.block_candidates = sharing.candidates;
  view.settings.light_block = sharing.block;
  view.settings.light_history = sharing.history;
  return view;
}

/// Only spatial, only temporal, and both; 8 or more samples of each replicate are whole windows of
/// all of them.
constexpr std::array kSharing = {Sharing{1, 4, 1}, Sharing{3, 5, 1}, Sharing{2, 8, 1},
                                 Sharing{1, 1, 8}, Sharing{1, 3, 4}, Sharing{2, 5, 2}};

/// 0.1% false alarms over all images and blocks of the six comparisons with each kind (Sidak).
void expect_agreement(const View& view, int samples, double error) {
  const double level =
      test_support::sidak(0.001, 6 * static_cast<int>(kSharing.size() * (kBlocks + 1)));
  const Blocks reference = blocks_of(view, samples);
  for (const Sharing& sharing : kSharing) {
    SCOPED_TRACE(testing::Message() << sharing.candidates << " candidates, " << sharing.block
                                    << ", " << sharing.history);
    const Agreement a = compare(blocks_of(shared(view, sharing), samples), reference);
    EXPECT_GT(a.picture, level);
    EXPECT_GT(a.least, level);
    EXPECT_LT(a.error, error) << "too noisy for a decision";
  }
}

TEST(SharedLights, AgreesWithTheLightTreeInTheCornellBox) {
  expect_agreement(builtin("cornell-box"), 128, 0.001);
}
TEST(SharedLights, AgreesWithTheLightTreeUnderManyEmitters) {
  expect_agreement(builtin("many-lights"), 128, 0.003);
}
TEST(SharedLights, AgreesWithTheLightTreeOnGloss) {
  expect_agreement(builtin("veach-mis"), 128, 0.016);
}
TEST(SharedLights, AgreesWithTheLightTreeThroughGlass) {
  expect_agreement(builtin("glass"), 128, 0.001);
}
TEST(SharedLights, AgreesWithTheLightTreeInARoom) {
  expect_agreement(builtin("interior"), 128, 0.01);
}
TEST(SharedLights, AgreesWithTheLightTreeWhereNeighboursCannotSeeAnEmitter) {
  expect_agreement(edges(1), 512, 0.003);
}

// The planted fault must be detected: emission that is 2% too strong.
TEST(SharedLights, DetectsTwoPercentMoreLight) {
  const Blocks reference = blocks_of(edges(1), 512);
  EXPECT_LT(compare(blocks_of(shared(edges(1.02F), {1, 4, 1}), 512), reference).picture, 1e-4);
  EXPECT_LT(compare(blocks_of(shared(edges(1.02F), {1, 3, 4}), 512), reference).picture, 1e-4);
}

/// kOneOverM: counts the weights of neighbours that could not have drawn the sample. kNoWeight:
/// uses the neighbour's sample as if it were drawn here. kDoubly: every path gives its sample the
/// full weight. kPassAlone: weights consider only the paths of the sample's pass, and sum to 1 in
/// each pass.
enum class Fault { kNone, kOneOverM, kNoWeight, kDoubly, kPassAlone };

constexpr int kRow = 8;
constexpr int kPaths = 2 * kRow;  // in two passes
Vec3 row_point(int i) { return {-0.7F + 0.2F * static_cast<float>(i % kRow), 0, 0}; }

/// Light of an emitter on a row of points of which half cannot see it, at the last point before the
/// emitter's plane: the point selects one of the samples of all points, as the renderer does. One
/// sample of each point in each pass, made of the same parts.
Moments row_of_points(Fault fault, int samples) {
  const auto scene = test_support::build(
      test_support::scene_of({test_support::emitter(Rgb(1))},
                             {test_support::quad({0, 0.2F, -0.5F}, {0, 1, 0}, {0, 0, 1}, 0),
                              test_support::quad({-1, 1.5F, 2}, {2, 0, 0}, {0, 0, 0.5F}, 0)}));
  const core::LightSampler lights(scene->data(), nullptr, core::LightPick::kTree);
  constexpr std::size_t kHere = 4;  // x = 0.1: before the first emitter, with four points behind it
  const Vec3 up = {0, 1, 0};
  test_support::Random random(11);
  core::SharedSamples shared;
  Moments out;
  for (int n = 0; n < samples; ++n) {
    std::array<core::LightPoint, kPaths> drawn;
    for (int i = 0; i < kPaths; ++i) {
      const float pick = random.uniform();
      drawn[static_cast<std::size_t>(i)] =
          lights.point_of(lights.sample(row_point(i), up, pick, random.uniform_2d()));
    }
    shared.start(kPaths);
    for (int i = 0; i < kPaths; ++i) {
      for (std::size_t j = 0; j < kPaths; ++j) {
        const core::LightView view = lights.view(drawn[j], row_point(i));
        const float seen = view.geometric * std::max(dot(up, view.wi_world), 0.0F);
        const bool forgotten =
            fault == Fault::kPassAlone && static_cast<std::size_t>(i) / kRow != j / kRow;
        shared.set(static_cast<std::size_t>(i), j,
                   forgotten                   ? 0.0F
                   : fault == Fault::kOneOverM ? 1.0F
                                               : seen);
      }
    }
    shared.choose(0xFFFF);
    double sum = 0;
    std::array<double, kPaths> value{};
    for (std::size_t j = 0; j < kPaths; ++j) {
      const core::LightView view = lights.view(drawn[j], row_point(kHere));
      if (!(drawn[j].pdf_measure > 0)) {
        continue;
      }
      const float share = fault == Fault::kDoubly ? 1.0F : shared.weight(j);
      float w = share / drawn[j].pdf_measure;
      if (fault == Fault::kNoWeight) {
        w = share /
            (view.solid_angle > 0
                 ? lights.pdf_solid_angle(drawn[j], view, row_point(kHere), up) * view.solid_angle
                 : 1.0F);
      }
      value[j] = static_cast<double>(core::luminance(view.radiance) * view.solid_angle *
                                     std::max(dot(up, view.wi_world), 0.0F) * w);
      sum += value[j];
    }
    out.add(sum);
  }
  return out;
}

/// The same by quadrature over both emitters.
double row_truth() {
  constexpr int kSteps = 2000;
  const Vec3 p = row_point(4);
  double sum = 0;
  for (int a = 0; a < kSteps; ++a) {
    for (int b = 0; b < kSteps; ++b) {
      const double u = (a + 0.5) / kSteps;
      const double v = (b + 0.5) / kSteps;
      const auto add = [&](double x, double y, double z, double nx, double ny, double nz,
                           double area) {
        const double dx = x - static_cast<double>(p.x);
        const double d2 = dx * dx + y * y + z * z;
        const double cos_light = -(nx * dx + ny * y + nz * z);
        if (cos_light > 0) {
          sum += area * y * cos_light / (d2 * d2) / (kSteps * kSteps);
        }
      };
      add(0, 0.2 + u, -0.5 + v, 1, 0, 0, 1);           // faces +x: cross of its edges
      add(-1 + 2 * u, 1.5, 2 + 0.5 * v, 0, -1, 0, 1);  // faces down
    }
  }
  return sum;
}

// 0.1% false alarms in total.
TEST(SharedSamples, HaveTheMeanOfTheLight) {
  const Moments m = row_of_points(Fault::kNone, 150000);
  EXPECT_LT(std::fabs(m.z(row_truth())), 4) << m.mean << " for " << row_truth();
  EXPECT_LT(m.standard_error(), 2e-3 * m.mean);
}
TEST(SharedSamples, RejectsPlantedFaults) {
  const double truth = row_truth();
  for (const Fault fault :
       {Fault::kOneOverM, Fault::kNoWeight, Fault::kDoubly, Fault::kPassAlone}) {
    EXPECT_GT(std::fabs(row_of_points(fault, 50000).z(truth)), 6) << static_cast<int>(fault);
  }
}

}  // namespace
