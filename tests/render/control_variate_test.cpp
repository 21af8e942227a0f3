// Direct light of emitters in closed form, with samples for occlusion. agreement_test.cpp compares
// whole images with plain path tracing, and shows the size of the faults that it detects.
#include <cmath>

#include "tests/render/truth.h"
#include "tests/support/statistics.h"

namespace {

using core::ControlVariateType;
using core::Rgb;
using core::View;
using test_support::Moments;
using test_support::Picture;

/// A floor of material `floor`, seen only at the origin, under a unit square of radiance 1 at
/// height 1; with `wall`, half in shadow.
View meter(const core::MaterialDescription& floor, bool wall, bool two_sided = false) {
  auto lamp = test_support::emitter(Rgb(1));
  lamp.double_sided = two_sided;
  std::vector<core::PrimitiveDescription> things = {
      test_support::quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, 0),
      test_support::quad({-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}, 1)};
  if (wall) {
    things.push_back(test_support::quad({0, 0.5F, -1}, {1, 0, 0}, {0, 0, 2}, 2));
  }
  View view = test_support::view_of(
      test_support::scene_of({floor, lamp, test_support::lambert(Rgb(0))}, std::move(things)), 16,
      16);
  test_support::look_at(view, {-0.3F, 0.2F, 0.25F}, {0, 0, 0}, 0.001F);
  view.settings.max_depth = 1;
  return view;
}

View controlled(View view) {
  view.settings.estimator.control_variate = ControlVariateType::kAnalytic;
  return view;
}

double variance_of_mean(const Picture& picture) {
  const auto e = static_cast<double>(picture.standard_error().g);
  return e * e;
}

// Closed form: irradiance .7522747 from a unit square at distance 1, over pi; every sample is exact
// up to rounding.
TEST(ControlVariate, HasNoNoiseWithoutShadows) {
  for (const bool two_sided : {false, true}) {
    const Picture picture =
        test_support::render(controlled(meter(test_support::lambert(Rgb(1)), false, two_sided)), 4);
    for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
      ASSERT_NEAR(core::pixel_value(picture.snapshot, p).mean.g, 0.7522747F / 3.14159265F, 3e-5F)
          << two_sided;
    }
  }
}

// A wall at half the height hides the emitter at x > 0 from the origin: half of it, by symmetry.
TEST(ControlVariate, SubtractsShadows) {
  const Picture picture =
      test_support::render(controlled(meter(test_support::lambert(Rgb(1)), true)), 256);
  const auto error = static_cast<double>(picture.standard_error().g);
  EXPECT_LT(error, 1e-3);
  EXPECT_NEAR(static_cast<double>(picture.mean().g), 0.5 * 0.7522747 / 3.14159265,
              4 * error + 3e-5);  // false alarm 6e-5
}

// The closed form excludes gloss, whose difference is sampled. 32 seeds each, |t| above 4.5 for 62
// degrees of freedom: 3e-5.
TEST(ControlVariate, KeepsTheMeanOfRoughGloss) {
  core::MaterialDescription plastic;
  plastic.metallic = 0;
  plastic.roughness = 0.6F;
  plastic.base_color = {0.3F, 0.5F, 0.8F};
  const View plain = meter(plastic, true);
  const View other = controlled(plain);
  Moments a;
  Moments b;
  double noise_plain = 0;
  double noise_controlled = 0;
  for (std::uint64_t seed = 1; seed <= 32; ++seed) {
    View v = plain;
    v.settings.seed = seed;
    Picture picture = test_support::render(v, 64);
    a.add(static_cast<double>(picture.mean().g));
    noise_plain += variance_of_mean(picture);
    v = other;
    v.settings.seed = 1000 + seed;
    picture = test_support::render(v, 64);
    b.add(static_cast<double>(picture.mean().g));
    noise_controlled += variance_of_mean(picture);
  }
  const double error = std::hypot(a.standard_error(), b.standard_error());
  EXPECT_LT(std::fabs(a.mean - b.mean), 4.5 * error) << a.mean << " " << b.mean;
  EXPECT_LT(error, 2e-3 * a.mean);
  std::printf("    variance with / without: %.2f\n", noise_controlled / noise_plain);
}

}  // namespace
