// Ground: a shadow catcher composited over the image of the bare ground equals the image of the
// model on the real ground.
#include "core/scene/ground.h"

#include <cmath>

#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "core/integrators/path/catcher.h"
#include "core/scene/drawn.h"
#include "tests/render/catcher_stage.h"
#include "tests/render/truth.h"
#include "tests/support/asset_files.h"
#include "tests/support/statistics.h"

namespace {

using catcher_stage::bare_view;
using catcher_stage::halves;
using catcher_stage::kGroundColor;
using catcher_stage::kSide;
using catcher_stage::kTooFar;
using catcher_stage::largest_z;
using catcher_stage::model;
using catcher_stage::over;
using catcher_stage::render;
using catcher_stage::sky;
using catcher_stage::Subject;
using catcher_stage::subjects;
using catcher_stage::transparent_catcher;
using catcher_stage::view_of;
using core::BackgroundType;
using core::GroundType;
using core::Rgb;
using core::Vec3;
using test_support::Picture;

TEST(Catcher, OverTheBareGroundEqualsTheModelOnARealGround) {
  const Picture real = render(view_of(model(), GroundType::kNone), 1, 256);
  const Picture caught = render(transparent_catcher(), 2, 256);
  const Picture bare = render(bare_view(), 3, 256);
  EXPECT_LT(largest_z(over(caught, bare), halves(real)), kTooFar);
  EXPECT_GT(largest_z(over(caught, bare, 0.9F), halves(real)), kTooFar) << "the planted fault";
  EXPECT_EQ(caught.progress.rejected_samples, 0U);
}

TEST(Catcher, OverTheBareGroundEqualsARealGroundForGlossGlassAndEmitters) {
  for (const Subject& subject : subjects()) {
    const auto render_of = [&subject](core::View view, std::uint64_t seed) {
      view.environment = subject.sky;
      return render(std::move(view), seed, 256);
    };
    const Picture real = render_of(view_of(subject.scene, GroundType::kNone), 1);
    const Picture caught = render_of(transparent_catcher(subject.scene), 2);
    const Picture bare = render_of(bare_view(subject.scene), 3);
    EXPECT_LT(largest_z(over(caught, bare), halves(real)), kTooFar) << subject.name;
    EXPECT_GT(largest_z(over(caught, bare, 0.9F), halves(real)), kTooFar)
        << subject.name << ": the planted fault";
    EXPECT_GT(largest_z(over(caught, bare, 1, 0.5F), halves(real)), kTooFar)
        << subject.name << ": the model reflects or emits light onto the ground";
    EXPECT_EQ(caught.progress.rejected_samples, 0U) << subject.name;
  }
}

/// Seen at so low an angle that the coat reflects a fifth of the light.
TEST(Catcher, OverTheBareGroundEqualsARealPolishedGround) {
  std::vector<Subject> all = subjects();
  all.push_back({"model", model(), sky()});
  for (const Subject& subject : all) {
    const auto render_of = [&subject](core::View view, std::uint64_t seed) {
      test_support::look_at(view, {0.5F, 2.5F, 6.5F}, {0, 0.5F, 0}, 50);
      view.environment = subject.sky;
      return render(std::move(view), seed, 256);
    };
    const Picture real = render_of(view_of(subject.scene, GroundType::kNone, 1), 1);
    const Picture caught = render_of(transparent_catcher(subject.scene, 1), 2);
    const Picture bare = render_of(bare_view(subject.scene, 1), 3);
    EXPECT_LT(largest_z(over(caught, bare), halves(real)), kTooFar) << subject.name;
    const Picture matte = render_of(transparent_catcher(subject.scene, 0), 2);
    EXPECT_GT(largest_z(over(matte, bare), halves(real)), kTooFar)
        << subject.name << ": the planted fault, no mirror image";
    EXPECT_EQ(caught.progress.rejected_samples, 0U) << subject.name;
  }
}

/// Uniform light L: the coat reflects F L, and the layer below it albedo (1 - F) L. Source of F:
/// Schlick 1994.
TEST(Catcher, BarePolishedGroundHasItsClosedFormUnderUniformLight) {
  const core::SceneDescription nothing;
  core::View view = view_of(nothing, GroundType::kCatcher, 1);
  view.environment = test_support::constant_sky({2, 2, 2});
  const core::BareGround ground(view.scene->data(), view.environment.get(), view.settings.ground);
  for (const float mu : {1.0F, 0.7F, 0.4F, 0.2F, -0.5F}) {
    const float f = 0.04F + 0.96F * std::pow(1 - std::fabs(mu), 5.0F);
    const Rgb seen = ground.radiance({}, {std::sqrt(1 - mu * mu), mu, 0});
    for (int c = 0; c < 3; ++c) {
      // The albedo table has 48 nodes.
      EXPECT_NEAR(seen[c], 2 * (kGroundColor[c] * (1 - f) + f), 2e-3F) << mu;
    }
  }
}

/// A black ball far above a polished black ground under uniform light: no light arrives in its
/// mirror image, where alpha is 1; elsewhere the ground reflects the same as without the ball.
TEST(Catcher, AlphaIsOneWhereABlackModelIsMirrored) {
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert({0, 0, 0})}, {test_support::sphere({0, 40, -40}, 4, 12, false, 0)});
  core::GroundSettings ground = {GroundType::kCatcher, 0.0F, {0, 0, 0}, 1, {}};
  core::add_ground(scene, ground);
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  // The image of the ball is in the centre: the mirrored camera looks at the ball.
  test_support::look_at(view, {0, 10, 10}, {0, 0, 0}, 20);
  view.environment = test_support::constant_sky({1, 1, 1});
  view.settings.ground = ground;
  view.settings.background.type = BackgroundType::kTransparent;
  const Picture picture = render(view, 1, 64);
  constexpr int kMiddle = kSide / 2 * kSide + kSide / 2;
  EXPECT_NEAR(core::pixel_value(picture.snapshot, kMiddle).alpha, 1, 1e-4F);
  EXPECT_EQ(core::pixel_value(picture.snapshot, 0).alpha, 0);
}

/// Third-party models: textures, thin glass, many parts; at their own scale, resting on their
/// lowest point, on a diffuse and on a polished ground.
TEST(Catcher, OverTheBareGroundEqualsARealGroundForAssets) {
  const auto folder = test_support::assets_folder();
  if (!folder) {
    GTEST_SKIP() << test_support::missing_assets();
  }
  const auto sky = test_support::load_sky(*folder / "env" / "venice_sunset_256.hdr");
  for (const std::string name :
       {"WaterBottle.glb", "SunglassesKhronos.glb", "2CylinderEngine.glb"}) {
    auto loaded = test_support::load_asset(*folder / name);
    ASSERT_TRUE(loaded) << name;
    const core::Bounds bounds = core::bounds_of(*loaded);
    const Vec3 center = bounds.center();
    const float size = length(bounds.diagonal());
    const auto picture = [&](GroundType seen, float reflection, bool bare, std::uint64_t seed) {
      core::SceneDescription scene = *loaded;
      scene.cameras.clear();
      const core::GroundSettings ground = {
          GroundType::kCatcher, bounds.min.y, kGroundColor, reflection, {}};
      core::add_ground(scene, ground);
      if (bare) {
        scene.instances.erase(scene.instances.begin(), scene.instances.end() - 1);
      }
      core::View view = test_support::view_of(std::move(scene), kSide, kSide);
      test_support::look_at(view, center + Vec3{0.1F, 1.1F, 0.6F} * size, center, 50);
      view.environment = sky;
      view.settings.ground = ground;
      view.settings.ground.type = seen;
      view.settings.ground.shadow.color = core::ShadowColor::kPhysical;
      view.settings.max_depth = 6;
      if (seen == GroundType::kCatcher) {
        view.settings.background.type = BackgroundType::kTransparent;
        view.settings.film.errors_over_white = true;
      }
      return render(std::move(view), seed, 256);
    };
    for (const float reflection : {0.0F, 1.0F}) {
      const Picture real = picture(GroundType::kNone, reflection, false, 1);
      const Picture caught = picture(GroundType::kCatcher, reflection, false, 2);
      const Picture bare = picture(GroundType::kNone, reflection, true, 3);
      EXPECT_LT(largest_z(over(caught, bare), halves(real)), kTooFar) << name << reflection;
      EXPECT_GT(largest_z(over(caught, bare, 0.9F), halves(real)), kTooFar)
          << name << reflection << ": the planted fault";
    }
  }
}

TEST(Catcher, OverTheColorOfTheBareGroundEqualsTheModelOnARealGround) {
  core::View view = view_of(model(), GroundType::kCatcher);
  const core::BareGround ground(view.scene->data(), view.environment.get(), view.settings.ground);
  view.settings.background = {BackgroundType::kColor, ground.radiance({}, {0, 1, 0})};
  const Picture real = render(view_of(model(), GroundType::kNone), 1, 256);
  const Picture caught = render(view, 2, 256);
  EXPECT_LT(largest_z(halves(caught), halves(real)), kTooFar);
  view.settings.background.color *= 0.95F;
  EXPECT_GT(largest_z(halves(render(view, 2, 256)), halves(real)), kTooFar) << "the planted fault";
  for (std::size_t i = 0; i < caught.snapshot.pixel_count(); ++i) {
    ASSERT_EQ(core::pixel_value(caught.snapshot, i).alpha, 1);
  }
}

TEST(Catcher, BareGroundHasItsClosedForm) {
  const Picture bare = render(bare_view(), 3, 256);
  const core::View view = bare_view();
  const core::BareGround ground(view.scene->data(), view.environment.get(), view.settings.ground);
  test_support::expect_truth(bare, static_cast<double>(ground.radiance({}, {0, 1, 0}).g), 0.008,
                             "ground");
}

TEST(Catcher, HasNoNoiseWhereTheModelHasNoEffect) {
  core::SceneDescription scene = model();
  scene.materials[0] = test_support::lambert({0, 0, 0});
  scene.materials[1] = test_support::lambert({0, 0, 0});
  core::View view = view_of(std::move(scene), GroundType::kCatcher);
  view.environment = nullptr;
  view.settings.background.type = BackgroundType::kTransparent;
  const Picture picture = render(view, 1, 16);
  // The sun is on the left, so there is no shadow here.
  for (int y = 0; y < kSide; ++y) {
    const core::HalfValue value =
        core::pixel_value(picture.snapshot, static_cast<std::size_t>(y) * kSide);
    EXPECT_EQ(value.alpha, 0) << y;
    EXPECT_TRUE(is_black(value.mean)) << y;
  }
  // The centre of the shadow is also free of noise.
  float most = 0;
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    most = std::max(most, core::pixel_value(picture.snapshot, i).alpha);
  }
  EXPECT_NEAR(most, 1, 1e-4F);
}

TEST(Catcher, DenoisedPixelsWithoutShadowStayEmpty) {
  core::SceneDescription scene = model();
  scene.materials[0] = test_support::lambert({0, 0, 0});
  scene.materials[1] = test_support::lambert({0, 0, 0});
  core::View view = transparent_catcher(std::move(scene));
  view.environment = nullptr;
  view.settings.film.width = 96;
  view.settings.film.height = 96;
  const Picture picture = render(view, 1, 4);
  const auto made =
      core::denoise(picture.snapshot, nullptr, core::StatisticalDenoiser(), core::parallel_for(2));
  ASSERT_TRUE(made);
  // The upper rows see neither the model nor its shadow.
  for (std::size_t i = 0; i < std::size_t{96} * 8; ++i) {
    ASSERT_EQ(core::pixel_value(picture.snapshot, i).alpha, 0) << i;
    EXPECT_EQ(made->picture.full_alpha[i], 0) << i;
    EXPECT_EQ(made->picture.mixed_alpha[i], 0) << i;
    for (std::size_t c = 0; c < 3; ++c) {
      EXPECT_EQ(made->picture.full[c][i], 0) << i;
      EXPECT_EQ(made->picture.mixed[c][i], 0) << i;
    }
  }
  float most = 0;
  for (const float alpha : made->picture.mixed_alpha) {
    most = std::max(most, alpha);
  }
  EXPECT_NEAR(most, 1, 1e-3F);
}

TEST(Catcher, AutomaticCamerasFrameTheShadow) {
  const auto bounds = [](GroundType type) {
    core::SceneDescription scene = model();
    core::add_ground(scene, {type, {}, kGroundColor, 0, {}});
    return test_support::build(std::move(scene))->summary().bounds;
  };
  const core::Bounds own = bounds(GroundType::kSweep);
  const core::Bounds framed = bounds(GroundType::kCatcher);
  const float reach = 0.25F * own.diagonal().y;
  EXPECT_NEAR(framed.max.x, own.max.x + reach, 1e-4F);
  EXPECT_NEAR(framed.min.z, own.min.z - reach, 1e-4F);
  EXPECT_EQ(framed.max.y, own.max.y);
}

TEST(Sweep, FillsTheImageBehindTheModel) {
  core::SceneDescription scene = model();
  core::GroundSettings ground = {GroundType::kSweep, {}, kGroundColor, 0, {}};
  const Vec3 from = {6, 3, 6};
  const Vec3 to = {0, 1, 0};
  core::add_ground(scene, ground, to - from);
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  EXPECT_NEAR(view.scene->summary().bounds.min.y, 0, 1e-5F) << "the model's own bounds";
  test_support::look_at(view, from, to, 50);
  view.environment = sky();
  view.settings.background.type = BackgroundType::kTransparent;
  view.settings.ground = ground;
  const Picture picture = render(view, 1, 4);
  for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
    EXPECT_EQ(core::pixel_value(picture.snapshot, i).alpha, 1) << i;
  }
  // From the other side the wall would be in front of the model.
  test_support::look_at(view, {-6, 3, -6}, to, 50);
  view.settings.film.depth = true;
  const Picture behind = render(view, 1, 4);
  EXPECT_LT(behind.snapshot.aux[kSide * kSide / 2 + kSide / 2].depth_m, 8.0F);
}

}  // namespace
