// Ground: pictures of a shadow catcher over what the ground looks like without the model are those
// of the model on the real ground.
#include "core/scene/ground.h"

#include <array>
#include <cmath>
#include <functional>
#include <span>

#include "core/integrators/catcher.h"
#include "core/settings/registry.h"
#include "tests/render/truth.h"

namespace {

using core::BackgroundType;
using core::GroundType;
using core::Rgb;
using core::Vec3;
using test_support::Picture;

constexpr int kSide = 24;
constexpr Rgb kGroundColor = {0.7F, 0.6F, 0.5F};

/// A red ball above the ground, and a lamp that belongs to it.
core::SceneDescription model() {
  auto scene = test_support::scene_of(
      {test_support::lambert({0.8F, 0.3F, 0.2F}), test_support::emitter({2, 2, 3})},
      {test_support::sphere({0, 1, 0}, 1, 12, false, 0),
       test_support::quad({1.6F, 1, -0.4F}, {0, 0, 0.8F}, {0, 0.8F, 0}, 1)});
  core::PunctualLightDescription sun;
  sun.type = core::PunctualType::kDirectional;
  sun.intensity = {1.5F, 1.4F, 1};
  // Shines along -z of its frame: from the left, 45 degrees high.
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

/// From above, so that the ground fills the picture.
core::View view_of(core::SceneDescription scene, GroundType kind) {
  core::View view;
  core::GroundSettings ground = {GroundType::kCatcher, 0.0F, kGroundColor};
  core::add_ground(scene, ground);
  view = test_support::view_of(test_support::build(std::move(scene)), kSide, kSide);
  test_support::look_at(view, {0.5F, 7, 5}, {0, 0.5F, 0}, 50);
  view.environment = sky();
  ground.type = kind;
  view.settings.ground = ground;
  view.settings.max_depth = 6;
  return view;
}

core::View bare_view() {
  core::SceneDescription scene = model();
  scene.instances.clear();
  scene.meshes.clear();
  return view_of(std::move(scene), GroundType::kNone);
}

core::View transparent_catcher() {
  core::View view = view_of(model(), GroundType::kCatcher);
  view.settings.background.type = BackgroundType::kTransparent;
  view.settings.film.errors_over_white = true;
  return view;
}

Picture render(core::View view, std::uint64_t seed, int samples) {
  view.settings.seed = seed;
  return test_support::render(view, samples);
}

using Halves = std::array<Rgb, 2>;
using HalvesOfPixel = std::function<Halves(std::size_t)>;

HalvesOfPixel halves(const Picture& picture) {
  return [&picture](std::size_t i) {
    return Halves{core::half_value(picture.snapshot, i, 0).mean,
                  core::half_value(picture.snapshot, i, 1).mean};
  };
}

/// The largest |z| of differences over blocks of 4 x 4 pixels and channels; each has 16 degrees of
/// freedom from either picture's halves.
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

/// P(|t| > 6.5) with 32 degrees is 2.6e-7; over 108 blocks and channels 3e-5.
constexpr double kTooFar = 6.5;

TEST(Catcher, OverTheBareGroundIsTheModelOnTheRealGround) {
  const Picture real = render(view_of(model(), GroundType::kNone), 1, 256);
  const Picture caught = render(transparent_catcher(), 2, 256);
  const Picture bare = render(bare_view(), 3, 256);
  const auto composite = [&](float alpha_scale) {
    return [&, alpha_scale](std::size_t i) {
      Halves out;
      for (int half = 0; half < 2; ++half) {
        const core::HalfValue c = core::half_value(caught.snapshot, i, half);
        out[static_cast<std::size_t>(half)] =
            c.mean + core::half_value(bare.snapshot, i, half).mean * (1 - alpha_scale * c.alpha);
      }
      return out;
    };
  };
  EXPECT_LT(largest_z(composite(1), halves(real)), kTooFar);
  EXPECT_GT(largest_z(composite(0.9F), halves(real)), kTooFar) << "a planted fault";
  EXPECT_EQ(caught.progress.rejected_samples, 0U);
}

TEST(Catcher, BeforeTheColourOfTheBareGroundIsTheModelOnTheRealGround) {
  core::View view = view_of(model(), GroundType::kCatcher);
  const core::BareGround ground(view.scene->data(), view.environment.get(), kGroundColor);
  view.settings.background = {BackgroundType::kColor, ground.radiance({}, 1)};
  const Picture real = render(view_of(model(), GroundType::kNone), 1, 256);
  const Picture caught = render(view, 2, 256);
  EXPECT_LT(largest_z(halves(caught), halves(real)), kTooFar);
  view.settings.background.color *= 0.95F;
  EXPECT_GT(largest_z(halves(render(view, 2, 256)), halves(real)), kTooFar) << "a planted fault";
  for (std::size_t i = 0; i < caught.snapshot.pixel_count(); ++i) {
    ASSERT_EQ(core::pixel_value(caught.snapshot, i).alpha, 1);
  }
}

TEST(Catcher, TheBareGroundHasItsClosedForm) {
  const Picture bare = render(bare_view(), 3, 256);
  const core::View view = bare_view();
  const core::BareGround ground(view.scene->data(), view.environment.get(), kGroundColor);
  test_support::expect_truth(bare, static_cast<double>(ground.radiance({}, 1).g), 0.002, "ground");
}

TEST(Catcher, WhereTheModelChangesNothingThereIsNoNoise) {
  core::SceneDescription scene = model();
  scene.materials[0] = test_support::lambert({0, 0, 0});
  scene.materials[1] = test_support::lambert({0, 0, 0});
  core::View view = view_of(std::move(scene), GroundType::kCatcher);
  view.environment = nullptr;
  view.settings.background.type = BackgroundType::kTransparent;
  const Picture picture = render(view, 1, 16);
  // The sun is on the left: its shadow is not there.
  for (int y = 0; y < kSide; ++y) {
    const core::HalfValue value =
        core::pixel_value(picture.snapshot, static_cast<std::size_t>(y) * kSide);
    EXPECT_EQ(value.alpha, 0) << y;
    EXPECT_TRUE(is_black(value.mean)) << y;
  }
  // And in the middle of the shadow there is nothing else.
  float most = 0;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    most = std::max(most, core::pixel_value(picture.snapshot, i).alpha);
  }
  EXPECT_NEAR(most, 1, 1e-4F);
}

TEST(Catcher, ItsErrorIsThatOfThePictureOverWhite) {
  const Picture caught = render(transparent_catcher(), 2, 16);
  core::FilmSnapshot white = caught.snapshot;
  for (std::size_t i = 0; i < white.pixels.size(); i += 2) {
    if (white.pixels[i].mean_alpha + white.pixels[i + 1].mean_alpha > 0) {  // else it is nothing
      for (core::ReplicatePixel& p : std::span(white.pixels).subspan(i, 2)) {
        p.mean_r += 1 - p.mean_alpha;
        p.mean_g += 1 - p.mean_alpha;
        p.mean_b += 1 - p.mean_alpha;
      }
    }
  }
  const core::TileSums seen = caught.film->half_sums(0);
  const core::TileSums expected = core::half_sums(white.rect, white.pixels, white.replicates);
  EXPECT_NEAR(seen.noise, expected.noise, 1e-6 * expected.noise);  // which adds in floats
  EXPECT_NEAR(seen.signal, expected.signal, 1e-6 * expected.signal);
  const core::TileSums colour =
      core::half_sums(white.rect, caught.snapshot.pixels, white.replicates);
  EXPECT_GT(seen.noise, 2 * colour.noise) << "the noise of a shadow is in its alpha";
}

TEST(Catcher, ItsIntervalHoldsTheErrorOfPictures) {
  // Errors of pictures of 16 samples against one of 1024, whose own is an eighth.
  const Picture truth = render(transparent_catcher(), 99, 1024);
  constexpr int kPictures = 20;
  double squares = 0;
  double low = 0;
  double high = 0;
  for (int i = 0; i < kPictures; ++i) {
    const Picture seen = render(transparent_catcher(), static_cast<std::uint64_t>(i), 16);
    double off = 0;
    double signal = 0;
    for (std::size_t p = 0; p < seen.snapshot.pixel_count(); ++p) {
      const core::HalfValue a = core::pixel_value(seen.snapshot, p);
      const core::HalfValue b = core::pixel_value(truth.snapshot, p);
      for (int c = 0; c < 3; ++c) {
        const auto over = [c](const core::HalfValue& v) {
          return static_cast<double>(v.mean[c] + 1 - v.alpha);
        };
        off += std::pow(over(a) - over(b), 2);
        signal += a.alpha > 0 ? over(b) * over(b) : 0;  // the others do not count
      }
    }
    squares += off / signal;
    low += std::pow(seen.progress.error.low, 2);
    high += std::pow(seen.progress.error.high, 2);
  }
  // The definition's floor adds less than 1 % to the signal of a picture as bright as white.
  EXPECT_GT(squares, 0.9 * low);
  EXPECT_LT(squares, 1.1 * high);
  EXPECT_LT(high, 9 * squares) << "and says something";
}

TEST(Sweep, FillsThePictureBehindTheModel) {
  core::SceneDescription scene = model();
  core::GroundSettings ground = {GroundType::kSweep, {}, kGroundColor};
  const Vec3 from = {6, 3, 6};
  const Vec3 to = {0, 1, 0};
  core::add_ground(scene, ground, to - from);
  core::View view = test_support::view_of(test_support::build(std::move(scene)), kSide, kSide);
  EXPECT_NEAR(view.scene->summary().bounds.min.y, 0, 1e-5F) << "the model's own bounds";
  test_support::look_at(view, from, to, 50);
  view.environment = sky();
  view.settings.background.type = BackgroundType::kTransparent;
  view.settings.ground = ground;
  const Picture picture = render(view, 1, 4);
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    EXPECT_EQ(core::pixel_value(picture.snapshot, i).alpha, 1) << i;
  }
  // From the other side the wall would stand before the model.
  test_support::look_at(view, {-6, 3, -6}, to, 50);
  view.settings.film.depth = true;
  const Picture behind = render(view, 1, 4);
  EXPECT_LT(behind.snapshot.aux[kSide * kSide / 2 + kSide / 2].depth_m, 8.0F);
}

}  // namespace
