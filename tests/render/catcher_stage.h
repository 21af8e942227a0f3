/// Pictures of a shadow catcher to compare with those of a real ground.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <vector>

#include "tests/support/scenes.h"

namespace catcher_stage {

using test_support::Picture;

inline constexpr int kSide = 24;
inline constexpr core::Rgb kGroundColor = {0.7F, 0.6F, 0.5F};

/// A red ball above the ground, and a lamp that belongs to it.
core::SceneDescription model();
std::shared_ptr<const core::Environment> sky();

/// What stands on the ground, and the sky around it.
struct Subject {
  const char* name;
  core::SceneDescription scene;
  std::shared_ptr<const core::Environment> sky;
};

/// Gold that throws light on the ground, and a coat over red; glass that bends it; and a lamp of
/// the model's own in front of a mirror, under a spot.
std::vector<Subject> subjects();

/// From above, so that the ground fills the picture. reflection: weight of the ground's coat.
core::View view_of(core::SceneDescription scene, core::GroundType kind, float reflection = 0);
core::View bare_view(core::SceneDescription scene = model(), float reflection = 0);
core::View transparent_catcher(core::SceneDescription scene = model(), float reflection = 0);
Picture render(core::View view, std::uint64_t seed, int samples);

/// A pixel of the two halves of the samples.
using Halves = std::array<core::Rgb, 2>;
using HalvesOfPixel = std::function<Halves(std::size_t)>;

/// The picture is borrowed.
HalvesOfPixel halves(const Picture& picture);

/// The largest |z| of differences over blocks of 4 x 4 pixels and channels; each has 16 degrees of
/// freedom from either picture's halves.
double largest_z(const HalvesOfPixel& first, const HalvesOfPixel& second);

/// P(|t| > 6.5) with 32 degrees is 2.6e-7; over 108 blocks and channels 3e-5.
inline constexpr double kTooFar = 6.5;

/// The picture of a catcher over that of the bare ground, both borrowed; the others plant faults:
/// alpha_scale in the whole of it, light_scale where the ground is seen.
HalvesOfPixel over(const Picture& caught, const Picture& bare, float alpha_scale = 1,
                   float light_scale = 1);

}  // namespace catcher_stage
