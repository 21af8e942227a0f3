// The neutral shadow of a catcher: no colour, alpha from luminance, an end at the border.
#include <array>
#include <cmath>

#include "core/scene/ground.h"
#include "tests/render/catcher_stage.h"
#include "tests/render/truth.h"

namespace {

using catcher_stage::bare_view;
using catcher_stage::halves;
using catcher_stage::kSide;
using catcher_stage::model;
using catcher_stage::over;
using catcher_stage::render;
using catcher_stage::transparent_catcher;
using catcher_stage::view_of;
using core::BackgroundType;
using core::GroundType;
using core::Rgb;
using test_support::Picture;

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
  core::MaterialDescription clear = test_support::glass(1.5F, 0);
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

}  // namespace
