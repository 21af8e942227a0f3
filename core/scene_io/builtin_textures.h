/// Pictures painted by code for the built-in scenes; 8-bit sRGB, three channels, seamless where
/// said.
#pragma once

#include "core/description/scene_description.h"

namespace core {

/// Four planks a tile, seamless, with grain. u runs along the planks.
Image wood_planks(int side_px);
/// A woven check of two colours, seamless.
Image woven_check(int side_px, Rgb light_srgb, Rgb dark_srgb);
/// A knotted rug: border, medallion, ornament.
Image rug(int width_px, int height_px);
/// An abstract painting of hills under a sun.
Image painting(int width_px, int height_px);

/// Adds the image to the scene; a texture that repeats it.
TextureDescription add_texture(SceneDescription& scene, Image image);

}  // namespace core
