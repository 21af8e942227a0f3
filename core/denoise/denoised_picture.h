/// DenoisedPicture: the denoised image of both halves, with an estimate of its error.
///
/// A, B: means of the halves, independent. FA = D(A), FB = D(B), F = (FA + FB) / 2, I = (A + B)
/// / 2. With squares in place of q,
///   m = (q(FA, B) + q(FB, A) - q(A, B)) / 2 - q(FA, FB) / 4
/// has the expected value of (F - mu)^2, bias included, for any denoiser and any noise:
/// E (FA - B)^2 = E (FA - mu)^2 + Var B, since D(A) is independent of B, and E (A - B)^2 = Var A +
/// Var B; the square of a mean is the mean of the squares minus the square of half the difference.
/// Source: Bitterli 2016, 5.3, without its cross-filtering, which would make FB depend on A.
///
/// A firefly would outweigh all other squares, so each is bounded by 1:
///   q(x, y) = (sum over channels of |x - y| / sum over channels of max(|x|, |y|) + F)^2
/// with F of core/film/half_sums.h. A firefly in A cancels in q(FB, A) - q(A, B), a blot in FA does
/// not. m may be negative: it is averaged over windows of kEnergyWindow pixels before its root is
/// taken (denoised_error()).
///
/// The denoiser reads the halves without their fireflies (core/film/set_aside.h), and the mixed
/// image shows those halves: G = F + w (I - F). w = 1/2 + (m - v) / (2 S) minimises (G - mu)^2,
/// with v = m of I and S = q(F, I). All three are pooled around the pixel, excluding its immediate
/// neighbourhood, so that w does not depend on the pixel's own samples. As v goes to 0, so does the
/// remaining bias: G is consistent. Its m is that of GA = FA + w (A - FA) and GB.
#pragma once

#include <string>

#include "core/denoise/denoiser.h"
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
  /// Denoised coverage of `full` and `mixed` if the film's errors are those over white: light and
  /// alpha are then denoised separately and composited over white. Otherwise empty: the film's own
  /// coverage is used.
  Plane full_alpha;
  Plane mixed_alpha;
  /// Error of `mixed` and `full`, over kDenoisedWindow.
  Plane mixed_error;
  Plane full_error;
  ColorPlanes bias;        ///< F - I, pooled over kBiasWindow
  ColorPlanes bias_error;  ///< its standard error
  std::vector<TileSums> plain_tiles;
  /// Per tile: sum over its windows of n sqrt(max(0, mean m)).
  std::vector<double> mixed_roots;
  std::vector<double> full_roots;
  PixelErrors errors = PixelErrors::kIndependent;  ///< of the plain image
  SetAside set_aside;                              ///< by denoise(), from the halves

  const ColorPlanes& planes(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full : mixed;
  }
  const Plane& alpha(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_alpha : mixed_alpha;
  }
  const std::vector<double>& roots(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_roots : mixed_roots;
  }
  const Plane& error(DenoiseMode mode) const {
    return mode == DenoiseMode::kFull ? full_error : mixed_error;
  }
  ErrorInterval interval(DenoiseMode mode, double confidence) const;
  double tile_error(DenoiseMode mode, std::size_t tile) const;
  std::size_t bytes() const noexcept;
};

/// Side of the windows over which m is averaged.
inline constexpr int kEnergyWindow = 8;

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
/// The same for halves that are already denoised. halves: A, B as they are shown; filtered: FA, FB.
DenoisedPicture denoised_picture(const FilmSnapshot& film, std::span<const HalfPicture> halves,
                                 std::span<const ColorPlanes> filtered);

/// Returns the smallest sample count of a half in any pixel.
int samples_of_halves(const FilmSnapshot& film);

/// Returns an upper bound of the memory of denoise() for an image of this size, without the
/// snapshot.
std::uint64_t denoising_bytes(std::uint64_t pixels);

}  // namespace core
