// Ground: a shadow catcher composited over the image of the bare ground equals the image of the
// model on the real ground.
#include "core/scene/ground.h"

#include <array>
#include <cmath>
#include <span>

#include "core/denoise/denoised_picture.h"
#include "core/denoise/statistical.h"
#include "core/integrators/catcher.h"
#include "core/settings/registry.h"
#include "tests/render/asset_files.h"
#include "tests/render/catcher_stage.h"
#include "tests/render/truth.h"
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
  core::View view = test_support::view_of(test_support::build(std::move(scene)), kSide, kSide);
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
    GTEST_SKIP() << "the folder of assets is missing (TESSERA_ASSETS names it)";
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
      core::View view = test_support::view_of(test_support::build(std::move(scene)), kSide, kSide);
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
  EXPECT_EQ(made->picture.full_alpha[0], 0);
  EXPECT_EQ(made->picture.full[0][0], 0);
  float most = 0;
  for (const float alpha : made->picture.mixed_alpha) {
    most = std::max(most, alpha);
  }
  EXPECT_NEAR(most, 1, 1e-3F);
}

core::View neutral_catcher(core::SceneDescription scene = model()) {
  core::View view = transparent_catcher(std::move(scene));
  view.settings.ground.shadow.color = core::ShadowColor::kNeutral;
  return view;
}

float alpha_of(const Picture& picture, std::size_t i) {
  return core::pixel_value(picture.snapshot, i).alpha;
}

/// Luminance of the middle of the image, where a neutral shadow does not fade, and its variance.
std::array<double, 2> middle_light(const catcher_stage::HalvesOfPixel& image) {
  std::array<double, 2> out{};
  for (int y = 3; y < kSide - 3; ++y) {
    for (int x = 3; x < kSide - 3; ++x) {
      const catcher_stage::Halves h = image(static_cast<std::size_t>(y * kSide + x));
      const auto a = static_cast<double>(luminance(h[0]));
      const auto b = static_cast<double>(luminance(h[1]));
      out[0] += 0.5 * (a + b);
      out[1] += 0.25 * (a - b) * (a - b);
    }
  }
  return out;
}

TEST(NeutralShadow, DarkensTheBareGroundByTheLuminanceThatTheModelTakes) {
  core::SceneDescription scene = model();
  scene.materials[1] = test_support::lambert({0.5F, 0.5F, 0.5F});  // adds no light of its own
  const Picture real = render(view_of(scene, GroundType::kNone), 1, 256);
  const Picture caught = render(neutral_catcher(scene), 2, 256);
  const Picture bare = render(bare_view(scene), 3, 256);
  const auto z = [&](float alpha_scale) {
    const auto a = middle_light(over(caught, bare, alpha_scale));
    const auto b = middle_light(halves(real));
    return std::fabs(a[0] - b[0]) / std::sqrt(a[1] + b[1]);
  };
  EXPECT_LT(z(1), 5);  // P(|z| > 5) is 6e-7
  EXPECT_GT(z(0.9F), 5) << "the planted fault";
}

TEST(NeutralShadow, HasNoColorAndEndsAtTheBorderOfTheImage) {
  core::View view = neutral_catcher();
  view.environment = test_support::constant_sky({0.3F, 0.4F, 1});
  const Picture neutral = render(view, 1, 256);
  view.settings.ground.shadow.color = core::ShadowColor::kPhysical;
  const Picture physical = render(view, 1, 256);
  int shadows = 0;
  int coloured = 0;
  double edge = 0;
  double physical_edge = 0;
  for (std::size_t i = 0; i < neutral.snapshot.pixel_count(); ++i) {
    const core::HalfValue v = core::pixel_value(neutral.snapshot, i);
    const auto x = static_cast<int>(i) % kSide;
    const auto y = static_cast<int>(i) / kSide;
    if (v.alpha > 0.05F && is_black(v.mean)) {  // the model reflects light
      ++shadows;
      coloured += is_black(core::pixel_value(physical.snapshot, i).mean) ? 0 : 1;
    }
    if (x == 0 || y == 0 || x == kSide - 1 || y == kSide - 1) {
      edge += static_cast<double>(std::fabs(v.alpha));
      physical_edge += static_cast<double>(alpha_of(physical, i));
    }
  }
  EXPECT_GT(shadows, 20);
  EXPECT_GT(coloured, shadows / 2) << "the physical shadow has a colour";
  EXPECT_GT(physical_edge, 0.2) << "the shadow reaches the border";
  EXPECT_LT(edge, 0.1 * physical_edge);
}

TEST(NeutralShadow, StrengthScalesItsAlpha) {
  core::View view = neutral_catcher();
  const Picture whole = render(view, 1, 16);
  view.settings.ground.shadow.strength = 0.25F;
  const Picture weak = render(view, 1, 16);
  int shadows = 0;
  for (std::size_t i = 0; i < whole.snapshot.pixel_count(); ++i) {
    if (is_black(core::pixel_value(whole.snapshot, i).mean)) {
      EXPECT_NEAR(alpha_of(weak, i), 0.25F * alpha_of(whole, i), 1e-5F);
      ++shadows;
    }
  }
  EXPECT_GT(shadows, kSide);
}

/// Under a distant light alone the edge of a shadow is as wide as the pixels; widened by 0.3 it is
/// a penumbra. The light that the ground loses is nearly the same: a wide cone is a little lower.
TEST(NeutralShadow, SoftnessWidensItsEdge) {
  core::SceneDescription scene = model();
  scene.materials[0] = scene.materials[1] = test_support::lambert({0, 0, 0});
  core::View view = neutral_catcher(std::move(scene));
  view.environment = nullptr;
  const auto counts = [&](float softness) {
    view.settings.ground.shadow.softness = softness;
    const Picture picture = render(view, 1, 256);
    std::array<double, 2> out{};
    for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
      const float alpha = alpha_of(picture, i);
      out[0] += alpha > 0.1F && alpha < 0.9F ? 1 : 0;
      out[1] += static_cast<double>(alpha);
    }
    return out;
  };
  const auto hard = counts(0);
  const auto soft = counts(0.3F);
  EXPECT_GT(soft[0], 1.5 * hard[0]);
  EXPECT_NEAR(soft[1], hard[1], 0.25 * hard[1]);
}

/// A ground seen through a clear pane has the same shadow, and shows the page.
TEST(NeutralShadow, IsSeenThroughGlass) {
  core::MaterialDescription clear;
  clear.metallic = 0;
  clear.roughness = 0;
  clear.transmission = 1;
  core::SceneDescription scene = model();
  scene.materials.push_back(clear);
  scene.meshes[0].primitives.push_back(
      test_support::quad({-2, 3, -2}, {0, 0, 4}, {4, 0, 0}, 2));  // a pane above the model
  core::View view = neutral_catcher(std::move(scene));
  view.settings.background.through_glass = true;
  const Picture clear_picture = render(view, 1, 16);
  int page = 0;
  for (const Rgb color : {Rgb(1), Rgb{0.1F, 0.3F, 0.6F}}) {
    view.settings.background = {BackgroundType::kColor, color, true};
    const Picture colored = render(view, 1, 16);
    for (std::size_t i = 0; i < colored.snapshot.pixel_count(); ++i) {
      const core::HalfValue v = core::pixel_value(clear_picture.snapshot, i);
      const Rgb seen = core::pixel_value(colored.snapshot, i).mean;
      for (int c = 0; c < 3; ++c) {
        ASSERT_NEAR(v.mean[c] + color[c] * (1 - v.alpha), seen[c], 1e-4F * std::max(1.0F, seen[c]));
      }
      page += v.alpha > 0.03F && v.alpha < 0.3F ? 1 : 0;
    }
  }
  EXPECT_GT(page, kSide) << "the pane, of which 4% and more reflect, before a lit ground";
}

TEST(Catcher, AutomaticCamerasFrameTheShadow) {
  const auto bounds = [](GroundType type) {
    core::SceneDescription scene = model();
    core::add_ground(scene, {type, {}, kGroundColor, 0, {}});
    return test_support::build(std::move(scene))->summary().bounds;
  };
  const core::Bounds own = bounds(GroundType::kSweep);
  const core::Bounds framed = bounds(GroundType::kCatcher);
  const float reach = 0.5F * own.diagonal().y;
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
  // From the other side the wall would be in front of the model.
  test_support::look_at(view, {-6, 3, -6}, to, 50);
  view.settings.film.depth = true;
  const Picture behind = render(view, 1, 4);
  EXPECT_LT(behind.snapshot.aux[kSide * kSide / 2 + kSide / 2].depth_m, 8.0F);
}

}  // namespace
