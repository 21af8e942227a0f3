// Where another image of a series shows the surfaces of this one, against geometry in closed form.
#include "core/render/picture/match_pass.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/aovs/motion.h"
#include "tests/support/scenes.h"

namespace {

using core::FrameMatch;
using core::Vec2;
using test_support::quad;

constexpr int kSide = 60;
constexpr float kEye = 4;      ///< distance of the camera from the card, at z = 0
constexpr float kWall = -2;    ///< z of the wall
constexpr float kHalf = 0.5F;  ///< half the side of the card

core::SceneDescription stage(float card_x) {
  core::SceneDescription out = test_support::scene_of(
      {test_support::lambert({0.5F, 0.5F, 0.5F})},
      {quad({-9, -9, kWall}, {18, 0, 0}, {0, 18, 0}, 0),
       quad({card_x - kHalf, -kHalf, 0}, {2 * kHalf, 0, 0}, {0, 2 * kHalf, 0}, 0)});
  // The ids that the scene gives to parts without names.
  out.instances[0].object = out.instances[0].instance = 1;
  out.meshes[0].primitives[0].id = 1;
  out.meshes[0].primitives[1].id = 2;
  return out;
}
core::View seen_from(float eye_x, float card_x = 0) {
  core::View view = test_support::view_of(stage(card_x), kSide, kSide);
  test_support::look_at(view, {eye_x, 0, kEye}, {eye_x, 0, 0}, 40);
  return view;
}

/// Direction of a pixel's ray at depth 1, and the film position of one.
const float kScale = std::tan(20 * 3.14159265F / 180) / (kSide / 2);
Vec2 slope(int i) {
  return {(static_cast<float>(i % kSide) + 0.5F - kSide / 2) * kScale,
          (kSide / 2 - static_cast<float>(i / kSide) - 0.5F) * kScale};
}

bool is_card(Vec2 slope, float eye_x, float card_x, float margin) {
  return std::fabs(eye_x + kEye * slope.x - card_x) < kHalf + margin &&
         std::fabs(kEye * slope.y) < kHalf + margin;
}

/// Counts wrong pixels of a match from a camera and card to another one. Pixels at the edges of the
/// card, of which the centre of another pixel decides, count neither way.
struct Wrong {
  int hidden = 0;  ///< taken where the card hides the wall
  int away = 0;    ///< taken from another pixel or distance than that of the point
  int lost = 0;    ///< not taken although it is seen
  int checked = 0;
};
Wrong wrong(const FrameMatch& match, float eye_from, float eye_to, float card_from, float card_to) {
  Wrong out;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec2 s = slope(i);
    const bool from_card = is_card(s, eye_from, card_from, 0);
    const float depth = from_card ? kEye : kEye - kWall;
    const float x = eye_from + depth * s.x + (from_card ? card_to - card_from : 0);
    const Vec2 to = {(x - eye_to) / depth, s.y};
    const float column = to.x / kScale + kSide / 2;
    const float pixel = kEye * kScale;
    const bool is_edge =
        is_card(to, eye_to, card_to, pixel) != is_card(to, eye_to, card_to, -pixel);
    const bool is_border = std::fabs(column) < 0.01F || std::fabs(column - kSide) < 0.01F ||
                           std::fabs(column - std::round(column)) < 0.01F;
    if (is_edge || is_border) {
      continue;
    }
    ++out.checked;
    const bool is_inside = column >= 0 && column < kSide;
    const bool is_seen = is_inside && is_card(to, eye_to, card_to, 0) == from_card;
    const int source = match.source[static_cast<std::size_t>(i)];
    if (!is_seen) {
      out.hidden += source >= 0 ? 1 : 0;
    } else if (source < 0) {
      ++out.lost;
    } else {
      const float farther = depth * (std::hypot(to.x, to.y, 1.0F) - std::hypot(s.x, s.y, 1.0F));
      const bool is_there =
          source == i / kSide * kSide + static_cast<int>(column) &&
          std::fabs(match.farther_m[static_cast<std::size_t>(i)] - farther) < 1e-4F;
      out.away += is_there ? 0 : 1;
    }
  }
  return out;
}

void expect_right(const Wrong& of) {
  EXPECT_EQ(of.hidden, 0);
  EXPECT_EQ(of.away, 0);
  EXPECT_EQ(of.lost, 0);
  EXPECT_GT(of.checked, kSide * kSide / 2);
}

TEST(MatchPass, FollowsAStaticSceneFromAMovingCamera) {
  const core::View here = seen_from(0);
  for (const float eye : {0.37F, -0.61F}) {
    const core::View there = seen_from(eye);
    const auto match = core::match_pass(here, {&there, nullptr}, core::parallel_for(2));
    ASSERT_TRUE(match);
    expect_right(wrong(*match, 0, eye, 0, 0));
  }
}

TEST(MatchPass, FollowsAnObjectThatMoves) {
  const core::View here = seen_from(0);
  const core::View there = seen_from(0, 0.43F);
  const core::MotionTarget target(stage(0.43F));
  const auto match = core::match_pass(here, {&there, &target}, core::parallel_for(2));
  ASSERT_TRUE(match);
  expect_right(wrong(*match, 0, 0, 0, 0.43F));
}

// The card is taken where it no longer is, and the wall behind it.
TEST(MatchPass, AnUnknownMotionIsWrong) {
  const core::View here = seen_from(0);
  const core::View there = seen_from(0, 0.43F);
  const auto match = core::match_pass(here, {&there, nullptr}, core::parallel_for(2));
  ASSERT_TRUE(match);
  const Wrong of = wrong(*match, 0, 0, 0, 0.43F);
  EXPECT_GT(of.away + of.lost, 100);
}

TEST(MatchPass, CountsInTheCropsOfBoth) {
  core::View here = seen_from(0);
  core::View there = seen_from(0);
  const core::PixelRect crop = {10, 20, 30, 8};
  here.settings.film.crop = crop;
  there.settings.film.crop = core::PixelRect{12, 20, 30, 8};
  const auto match = core::match_pass(here, {&there, nullptr}, core::parallel_for(1));
  ASSERT_TRUE(match);
  ASSERT_EQ(match->source.size(), 240U);
  for (int i = 0; i < 240; ++i) {
    EXPECT_EQ(match->source[static_cast<std::size_t>(i)], i % 30 < 2 ? -1 : i - 2);
  }
}

}  // namespace
