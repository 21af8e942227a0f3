/// DenoisedPicture: the denoised image of both halves, with an estimate of its error.
///
/// A, B: means of the halves, independent. FA = D(A), FB = D(B), F = (FA + FB) / 2, I = (A + B)
/// / 2.
///   m = (FA - A)(FB - B) + ((FA - FB) / 2)^2
/// has the expected value of (F - mu)^2, bias included, for any denoiser and any noise: D(A) - A
/// and D(B) - B are independent, so the first term is the square of their mean, the bias, and the
/// second is the variance of F. Source: Bitterli 2016, 5.3, without its cross-filtering, which
/// would make FB depend on A, and with the terms in another order. Both are relative to the light
/// of F and bounded (core/error/squared_error.h): a firefly that the denoiser removes from A meets
/// the noise of FB - B, one that it spreads over a blot is in the second term.
///
/// The denoiser reads the halves without their fireflies (core/film/set_aside.h), and the mixed
/// image shows those halves: G = F + w (I - F). w = E (F - mu)(F - I) / E (F - I)^2 minimises
/// (G - mu)^2. Its numerator is the mean of (FA - B)(FA - A), (FB - A)(FB - B) and twice (FA -
/// A)(FB
/// - B) over 4, since B stands for mu where A is not involved. Both are pooled around the pixel,
/// excluding its immediate neighbourhood, so that w does not depend on the pixel's own samples. As
/// I goes to mu, so does G: it is consistent. Its m is that of GA = FA + w (A - FA) and GB. w is 0
/// everywhere if F has a smaller error as a whole, and 1 unless G is better than I beyond doubt.
#pragma once

#include <span>
#include <string>

#include "core/denoise/denoiser.h"
#include "core/denoise/series_mean.h"
#include "core/error/error_estimate.h"
#include "core/film/set_aside.h"

namespace core {

enum class DenoiseMode { kFull, kMixed };

struct DenoisedPicture {
  PixelRect rect;
  std::uint32_t revision = 0;  ///< of the film
  ColorPlanes full;            ///< F
  ColorPlanes mixed;           ///< G
  Plane weight;                ///< w: fraction of the plain image
  bool is_plain = false;       ///< w is 1 everywhere: `mixed` and its interval are the plain ones
  /// Denoised coverage of `full` and `mixed` if the film's errors are those over white: light and
  /// alpha are then denoised separately and composited over white. Otherwise empty: the film's own
  /// coverage is used.
  Plane full_alpha;
  Plane mixed_alpha;
  /// Error of `mixed` and `full`, over kDenoisedWindow.
  Plane mixed_error;
  Plane full_error;
  ColorPlanes apart;       ///< (FA - FB) / 2, as errors are measured
  ColorPlanes bias;        ///< F - I, pooled over kBiasWindow
  ColorPlanes bias_error;  ///< its standard error
  std::vector<TileSums> plain_tiles;
  ErrorRoots mixed_roots;
  ErrorRoots full_roots;
  PixelErrors errors = PixelErrors::kIndependent;  ///< of the plain image
  SetAside set_aside;                              ///< by denoise(), from the halves

  const ColorPlanes& planes(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full : mixed;
  }
  const Plane& alpha(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_alpha : mixed_alpha;
  }
  const ErrorRoots& roots(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_roots : mixed_roots;
  }
  const Plane& error(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_error : mixed_error;
  }
  ErrorInterval interval(DenoiseMode mode, double confidence) const;
  double tile_error(DenoiseMode mode, std::size_t tile) const;
  std::size_t bytes() const noexcept;
};

/// Pixels to each side of the windows of planes: 64 x 64 pixels for errors, 15 x 15 for the bias.
inline constexpr int kDenoisedWindow = 32;
inline constexpr int kBiasWindow = 7;

/// A denoised image and its denoiser.
struct MadeDenoised {
  DenoisedPicture picture;
  DenoiserFacts by;
  std::string note;  ///< why `auto` did not use oidn; empty: it did
};

/// Pre: every pixel of the film has samples of both halves. features: null, or of the film's crop.
Result<MadeDenoised> denoise(const FilmSnapshot& film, const FeaturePicture* features,
                             const Denoiser& denoiser, const ParallelFor& parallel);

/// A film's halves, with those denoised. Steps of denoise(), for images of a series.
struct CleanFilm {
  CleanHalves light;
  CleanHalves alpha;  ///< if the film's errors are those over white
  CalmFactors calm;
  DenoiserFacts by;

  std::size_t bytes() const noexcept;
};
Result<CleanFilm> clean_film(const FilmSnapshot& film, const FeaturePicture* features,
                             const Denoiser& denoiser, const ParallelFor& parallel);
/// An image before or after. Pre: of the same size, with features if the image has some.
struct CleanNeighbour {
  const CleanFilm* film = nullptr;
  const FeaturePicture* features = nullptr;
  const FrameMatch* match = nullptr;
};
/// Averages the denoised halves with those of the neighbours (core/denoise/series_mean.h).
CleanFilm mean_in_series(CleanFilm own, const FeaturePicture* features,
                         std::span<const CleanNeighbour> others);
/// Pre: `clean` is of the film and features.
MadeDenoised denoised(const FilmSnapshot& film, const FeaturePicture* features, CleanFilm clean);

/// The same for halves that are already denoised. halves: A, B as they are shown; filtered: FA, FB.
DenoisedPicture denoised_picture(const FilmSnapshot& film, std::span<const HalfPicture> halves,
                                 std::span<const ColorPlanes> filtered);

/// Returns how far the gain from one image to the other may be from its estimate, with this
/// confidence: Student's t with the spread of the tiles' gains around what their pixels would have
/// of the whole gain (the ratio estimator; Cochran, Sampling Techniques, 1977, chapter 6). Noise
/// that both images share cancels in each, and errors of neighbouring windows are alike. A gain in
/// one tile alone is uncertain: infinite.
double reach_of_gain(const ErrorRoots& from, const ErrorRoots& to, std::span<const TileSums> tiles,
                     double confidence);

/// Returns the smallest sample count of a half in any pixel.
int samples_of_halves(const FilmSnapshot& film);

/// Returns an upper bound of the memory of denoise() for an image of this size, without the
/// snapshot.
std::uint64_t denoising_bytes(std::uint64_t pixels);

}  // namespace core
