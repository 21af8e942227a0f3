/// mean_of_frames(): averages a denoised image with the denoised images before and after in a
/// series, along the motion of the surfaces.
///
/// Each half is averaged with the same half of its neighbours, so that FA is a function of halves A
/// alone: B does not depend on them, and measures the error as that of an image alone. If features
/// are given, light without emission is divided by the colour of the surfaces of its own image,
/// averaged, and multiplied by that here, so that textures stay sharp. A neighbour's pixel counts
/// as far as the features agree and the plain halves do not differ: the difference of their means
/// around the pixel, in standard deviations of its noise (Welch's test). Light that changes, such
/// as highlights and shadows that move over a surface, is so left alone.
#pragma once

#include <span>
#include <vector>

#include "core/denoise/denoiser.h"
#include "core/denoise/frame_match.h"

namespace core {

/// The halves of an image, plain and denoised.
struct CleanHalves {
  std::vector<HalfPicture> plain;  ///< A, B
  std::vector<ColorPlanes> clean;  ///< FA, FB
};

/// The image before or after.
struct SeriesFrame {
  const CleanHalves* halves = nullptr;
  const FeaturePicture* features = nullptr;
  const FrameMatch* match = nullptr;  ///< from the image that is averaged
};

/// Returns FA and FB. Pre: all are of the same size, with features of all or of none.
std::vector<ColorPlanes> mean_of_frames(const CleanHalves& own, const FeaturePicture* features,
                                        std::span<const SeriesFrame> frames);

}  // namespace core
