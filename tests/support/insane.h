/// make_insane: changes one value of a tile so that no renderer can have made it.
#pragma once

#include <limits>

#include "core/film/film.h"

namespace test_support {

inline constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

inline void make_insane(core::ReplicatePixel& value) { value.mean_g = kNan; }
inline void make_insane(core::AuxPixel& value) { value.depth_m = kNan; }
inline void make_insane(core::PixelPlan& value) { value = {2, 1}; }  // takes samples back
inline void make_insane(core::PilotPixel& value) { value.m2.b = kNan; }
inline void make_insane(core::ReplicateFit& value) { value.coefficient.r = kNan; }
inline void make_insane(core::Rgb& value) { value.b = kNan; }
inline void make_insane(core::FirstHitPixel& value) { value.position.z = kNan; }
inline void make_insane(core::MattePixel& value) { value = {{{0, {1, 0}}}}; }  // hits of nothing
inline void make_insane(float& value) { value = kNan; }

}  // namespace test_support
