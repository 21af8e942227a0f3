/// Scenes on which all unbiased integrators must agree (agreement_test.cpp, bounces_test.cpp).
#pragma once

#include "tests/support/scenes.h"

namespace test_support {

/// The Cornell box.
core::View box(int side);
/// The same with walls of glossy plastic and a block of rough metal.
core::View glossy_box(int side);
/// Metal, rough glass and plastic under an area emitter, a point light and an environment map.
core::View zoo(int side);
/// The box behind a thin pane that half transmits, without a change of direction, and half
/// scatters.
core::View pane(int side);
/// 30 instances of a glass ball and of a diffuse one, mirrored, scaled unevenly and turned, under a
/// sky with one texel a hundred times as bright as the others.
core::View instances(int side);
/// Balls of rough and of smooth glass of strong dispersion on a floor, under an area emitter and a
/// sky.
core::View prisms(int side);
/// The box with a point light in fog whose density decreases with height; at most three scattering
/// events.
core::View fog_in_box(int side, core::Rgb scattering);

}  // namespace test_support
