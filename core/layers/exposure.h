/// Exposure of an image for display formats, and how much of it they clip.
///
/// The automatic exposure maps the log-average luminance G of the pixels to the key 0.18 * 4^f,
/// with f = (2 log G - log low - log high) / (log high - log low) in [-1, 1] and low and high the
/// 1% and 99% quantiles: bright images stay bright and dark ones dark. Source: Reinhard, Parameter
/// Estimation for Photographic Tone Reproduction, journal of graphics tools 7(1), 2002. It is then
/// lowered until at most a tenth of the pixels are above 1, and rounded to 0.1 stops. Pixels count
/// by their alpha; their colour is that in front of the background; black ones do not count. So it
/// is a function of the film alone, and scaling all lights does not change the image.
#pragma once

#include <string>
#include <string_view>

#include "core/film/film.h"
#include "core/settings/settings.h"

namespace core {

struct Brightness {
  double clipped = 0;        ///< share of the pixels with luminance above 1, at exposure 0
  double auto_exposure = 0;  ///< stops, in [-30, 30]; 0 for a black image
  /// Returns whether most of the image is clipped at exposure 0.
  bool is_clipped() const noexcept { return clipped > 0.5; }
};

/// settings: the job's.
Brightness brightness_of(const Film& film, const FilmSettings& settings);

/// Returns the exposure as text: "-9.4".
std::string exposure_text(double stops);

/// In all warnings of clipped_warning().
inline constexpr std::string_view kClippedWords = " % of the pixels are above 1";
/// Returns "99 % of the pixels are above 1; OPTION-9.4 shows them". option: "--exposure ".
std::string clipped_warning(const Brightness& brightness, std::string_view option);

}  // namespace core
