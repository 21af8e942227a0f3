/// Images of a shadow catcher, for comparison with images of a real ground.
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

/// A red ball above the ground, and an emitter that belongs to the model.
core::SceneDescription model();
std::shared_ptr<const core::Environment> sky();

/// A model on the ground, and its environment.
struct Subject {
  const char* name;
  core::SceneDescription scene;
  std::shared_ptr<const core::Environment> sky;
};

/// Gold, which reflects light onto the ground, and a clearcoat over red; refractive glass; and an
/// emitter of the model in front of a mirror, under a spot light.
std::vector<Subject> subjects();

/// Seen from above, so that the ground fills the image. reflection: weight of the ground's coat.
core::View view_of(core::SceneDescription scene, core::GroundType kind, float reflection = 0);
core::View bare_view(core::SceneDescription scene = model(), float reflection = 0);
core::View transparent_catcher(core::SceneDescription scene = model(), float reflection = 0);
Picture render(core::View view, std::uint64_t seed, int samples);

/// A pixel in each half of the samples.
using Halves = std::array<core::Rgb, 2>;
using HalvesOfPixel = std::function<Halves(std::size_t)>;

/// Returns a view of the image, which must outlive it.
HalvesOfPixel halves(const Picture& picture);

/// Returns the largest |z| of differences over blocks of 4 x 4 pixels and channels; the halves of
/// each image give 16 degrees of freedom per block.
double largest_z(const HalvesOfPixel& first, const HalvesOfPixel& second);

/// P(|t| > 6.5) with 32 degrees is 2.6e-7; over 108 blocks and channels 3e-5.
inline constexpr double kTooFar = 6.5;

/// Composites the image of a catcher over the image of the bare ground; both must outlive the
/// result. The other parameters plant faults: alpha_scale everywhere, light_scale where the ground
/// is visible.
HalvesOfPixel over(const Picture& caught, const Picture& bare, float alpha_scale = 1,
                   float light_scale = 1);

}  // namespace catcher_stage
