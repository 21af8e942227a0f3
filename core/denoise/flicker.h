/// Flicker: by how much the error of denoised images changes from one frame of a series to the
/// next.
///
/// Frames are the denoiser's own images, F: the fraction of the plain image in a mixed one is
/// chosen anew for each frame, and its grain would come and go.
///
/// Along the motion of the surfaces, D = F_t - F_s is the change that is seen, and d = mu_t - mu_s
/// that of the light, which is no flicker. With DA, DB of the denoised halves and dA, dB of the
/// plain ones,
///   m = (DA - dA)(DB - dB) + ((DA - DB) / 2)^2
/// has the expected value of (D - d)^2, as in core/denoise/denoised_picture.h: it is the mean of
/// (D - d)^2 as measured, less the noise of the plain halves. Both are relative to the light of
/// F_t and bounded (core/error/squared_error.h). The backdrop has no surface, so it does not count.
#pragma once

#include <optional>

#include "core/denoise/denoised_picture.h"

namespace core {

/// Sums of m, which add up over frames.
struct Flicker {
  double pixels = 0;    ///< that show a surface of the other frame
  double sum = 0;       ///< of m
  double variance = 0;  ///< of `sum`, from its spread over tiles
  double degrees = 0;   ///< of freedom of the variance

  Flicker& operator+=(const Flicker& other) noexcept;
};

/// The root of the mean m, as a fraction of the light, with its interval.
struct FlickerInterval {
  double relative = 0;
  double low = 0;
  double high = 0;
};
/// Empty without degrees of freedom.
std::optional<FlickerInterval> interval(const Flicker& flicker, double confidence);

/// A frame's film and its denoised image, whose `full` is shown.
struct ShownFrame {
  const FilmSnapshot* film = nullptr;
  const DenoisedPicture* picture = nullptr;
};
/// match: from `now` to the other frame. Pre: of the same size.
Flicker flicker(const ShownFrame& now, const ShownFrame& other, const FrameMatch& match);

}  // namespace core
