/// Procedural images for the built-in scenes; 8-bit sRGB, three channels, seamless where stated.
#pragma once

#include "core/description/scene_description.h"

namespace core {

/// Four planks per tile with grain, seamless. u runs along the planks.
Image wood_planks(int side_px);
/// A woven check of two colours, seamless.
Image woven_check(int side_px, Rgb light_srgb, Rgb dark_srgb);
/// A knotted rug: border, medallion, ornament.
Image rug(int width_px, int height_px);
/// An abstract painting of hills under a sun.
Image painting(int width_px, int height_px);

/// Adds the image to the scene and returns a repeating texture of it.
TextureDescription add_texture(SceneDescription& scene, Image image);

}  // namespace core
