/// DenoisedPicture: what a denoiser makes of both halves, and how wrong that is.
///
/// A, B: means of the halves, independent. FA = D(A), FB = D(B), F = (FA + FB) / 2, I = (A + B)
/// / 2. Per pixel and channel
///   m = ((FA - B)^2 + (FB - A)^2 - (A - B)^2) / 2 - (FA - FB)^2 / 4
/// has the expected value of (F - mu)^2, bias included, for any denoiser and any noise:
/// E (FA - B)^2 = E (FA - mu)^2 + Var B, since D(A) knows nothing of B, and E (A - B)^2 = Var A +
/// Var B; a mean's square is the mean of the squares less that of half the difference. It may be
/// negative: sums of it count, and nothing is clipped before. Source: Bitterli 2016, 5.3, without
/// its cross-filtering, which lets A into FB.
///
/// The mixed picture G = F + w (I - F) has w from m, v = (A - B)^2 / 4 and S = (F - I)^2, relative
/// to the light around and pooled around the pixel without what is near it, so that w is fixed as
/// far as the pixel's own samples go: w = 1/2 + (m - v) / (2 S), where (G - mu)^2 is least. As v
/// goes to 0 so does the bias that is left: consistent. Its m is that of GA = FA + w (A - FA) and
/// GB.
#pragma once

#include <string>

#include "core/denoise/denoiser.h"
#include "core/error/error_estimate.h"

namespace core {

enum class DenoiseMode { kFull, kMixed };

struct DenoisedPicture {
  PixelRect rect;
  std::uint32_t revision = 0;  ///< of the film
  ColorPlanes full;            ///< F
  ColorPlanes mixed;           ///< G
  Plane weight;                ///< w: share of the plain picture
  /// Denoised coverage of `full` and `mixed` where the film's errors are over white: D is then that
  /// of light and alpha, each denoised alone, before white. Else empty: the film's own counts.
  Plane full_alpha;
  Plane mixed_alpha;
  /// Relative error of `mixed` and `full`, pooled over kDenoisedWindow.
  Plane mixed_error;
  Plane full_error;
  ColorPlanes bias;        ///< F - I, pooled over kBiasWindow
  ColorPlanes bias_error;  ///< its standard error
  std::vector<TileSums> plain_tiles;
  std::vector<TileEnergy> mixed_tiles;
  std::vector<TileEnergy> full_tiles;
  /// Errors of neighbouring pixels are correlated: no intervals.
  bool has_intervals = true;

  const ColorPlanes& planes(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full : mixed;
  }
  const Plane& alpha(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_alpha : mixed_alpha;
  }
  const std::vector<TileEnergy>& tiles(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_tiles : mixed_tiles;
  }
  const Plane& error(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_error : mixed_error;
  }
  ErrorInterval interval(DenoiseMode mode, double confidence) const;
  /// Of the error of this very picture, exceeded with probability alpha at most; infinite: unknown.
  double bound(DenoiseMode mode, double alpha) const;
  std::size_t bytes() const noexcept;
};

/// Sides of windows: 64 pixels for errors, 15 for the bias.
inline constexpr int kDenoisedWindow = 32;
inline constexpr int kBiasWindow = 7;

/// A denoised picture and its maker.
struct MadeDenoised {
  DenoisedPicture picture;
  DenoiserFacts by;
  std::string note;  ///< why `auto` did not take the better one; empty: it did
};

/// Pre: every pixel of the film has samples of both halves. features: null, or of the film's crop.
Result<MadeDenoised> denoise(const FilmSnapshot& film, const FeaturePicture* features,
                             const Denoiser& denoiser, const ParallelFor& parallel);
/// The same of halves that have been denoised. halves: A, B; filtered: FA, FB.
DenoisedPicture denoised_picture(const FilmSnapshot& film, std::span<const HalfPicture> halves,
                                 std::span<const ColorPlanes> filtered);

/// Does every pixel have samples of both halves?
bool has_both_halves(const FilmSnapshot& film);

/// What denoise() takes for so many pixels beside the snapshot, at most.
std::uint64_t denoising_bytes(std::uint64_t pixels);

}  // namespace core
