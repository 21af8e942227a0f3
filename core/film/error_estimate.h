/// How wrong a picture still is.
///
/// relative RMSE = sqrt(mean over pixels and channels of Var / (mu^2 + 0.01)), Var being the
/// variance of the pixel's mean, estimated from the two halves as (A - B)^2 / 4, and mu the expected value,
/// which is pooled over a region large enough to know it: dividing by a pixel's own noisy mean cannot
/// exceed 1 and reads low where fireflies are. A pixel that is brighter than its region, and whose samples agree that it
/// is, counts with the least that they leave possible.
///
/// Where lights are seen in part and samples seldom meet them, the scene tells the expected value: what such a pixel is off by is no estimate.
/// Nor is what pictures like it are off by there: an event that one picture in ten has makes no estimate, but its variance is known.
/// The same holds for the few pixels that may be much of the whole error, once they are probed. Until then a single event in one of them has two
/// readings: a pixel as dark as its region had luck, or one that is brighter shows what it is. The estimate takes the first, which is right on
/// average where events come anywhere; the interval reaches down to the second.
///
/// Where the errors of neighbouring pixels are correlated (PixelErrors), variances still are what the halves say of each
/// pixel and the mean over pixels is right, but fewer of them are known independently: intervals are wider. The variance
/// of a block's mean is then not the sum of its pixels' variances; it is had from the block's means in the replicates.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/film/expected_values.h"
#include "core/film/film.h"
#include "core/film/probed_pixel.h"

namespace core {

struct ErrorInterval {
  double relative_rmse = 0;  ///< NaN when there is only one half
  double low = 0;            ///< of the confidence interval
  double high = 0;
  bool unreliable = false;  ///< too few distinct events
};

struct PixelError {
  Rgb standard_error;  ///< of the mean, pooled; NaN with one half
  Rgb low;             ///< 95 % interval
  Rgb high;
};

class ErrorEstimate {
 public:
  /// Looks at the whole snapshot at once; O(pixels).
  /// edges: where the scene is at hand (core/film/light_edges.h); the snapshot is then of the film's whole crop.
  /// probed: pixels that do not see lights in part, and what samples that are not in the film say of them.
  /// foretells: is the variance at rare rims taken from the scene? Not for jobs that their own error ends: what such a picture met is the matter.
  explicit ErrorEstimate(const FilmSnapshot& film, const LightEdges& edges = {}, std::span<const ProbedPixel> probed = {},
                         bool foretells = false);

  bool valid() const noexcept { return valid_; }
  ErrorInterval image(double confidence) const;
  /// rect in pixels of the full film, inside the snapshot.
  ErrorInterval region(PixelRect rect, double confidence) const;
  /// What this very picture is off by, sqrt(mean over pixels and channels of error^2 / (mu^2 + 0.01)), is more with
  /// probability alpha. Intervals are of what pictures like it are off by on average. NaN with one half.
  double most(PixelRect rect, double alpha) const;
  double most(double alpha) const { return most(rect_, alpha); }
  /// Of the whole picture, if the few pixels that carry much of the error are as bright as they look. NaN with one half.
  double least() const;
  PixelError pixel(int x, int y) const;
  /// sqrt(mean over channels of pooled Var / (mu^2 + 0.01)) of one pixel: the `error` layer.
  float relative_error(int x, int y) const;

  /// Pixels that by their own samples may make more than a hundredth of what is said of the picture, largest first, 64 at most: probes of
  /// them are worth their time.
  const std::vector<std::uint32_t>& doubtful() const noexcept { return doubtful_; }
  /// Of probes of doubtful() those that contradict what was expected of their pixels. Where they agree the pixel is one of many alike, of which
  /// some have met rare events and others not yet: to know what the first are off by, and not the others, would be a bias.
  std::vector<ProbedPixel> surprises(const std::vector<ProbedPixel>& probed) const;

 private:
  /// Of the raw ratios over a rectangle.
  struct MeanRatio {
    double value = 0;          ///< NaN where unknown
    double degrees = 0;        ///< of freedom of `value`, where that is above 0
    double largest_share = 0;  ///< of the sum, that one pixel has
  };
  /// kPicture: of this very picture, where what pixels are known to be off by has no spread. kExpected: of pictures like it.
  /// kLeast: the same, if the few pixels that carry much of the error are as bright as they look, and did not have luck.
  enum class Of { kExpected, kPicture, kLeast };
  MeanRatio mean_ratio(PixelRect rect, Of of) const;
  void know(const FilmSnapshot& film, const LightEdges& edges, const std::vector<ExpectedValue>& expected);
  void know(std::span<const ProbedPixel> probed);
  void doubt(const FilmSnapshot& film, const LightEdges& edges, const std::vector<ExpectedValue>& expected);
  void weigh(const std::vector<Rgb>& variances, const std::vector<ExpectedValue>& expected);
  std::size_t index(int x, int y) const noexcept;
  PixelRect rect_;
  bool valid_ = false;
  bool foretells_ = false;
  double dependence_ = 1;  ///< variance of a sum of (A - B)^2 over that of independent pixels
  std::vector<Rgb> mean_;
  std::vector<Rgb> pooled_variance_;
  std::vector<float> raw_ratio_;     ///< mean over channels of (A-B)^2/4 / (mu_w^2 + 0.01)
  std::vector<float> influence_;     ///< of the pixel on the sum of raw_ratio_, shared expected values included
  std::vector<float> unlike_;        ///< ExpectedValue::unlike
  std::vector<float> known_;         ///< mean over channels of error^2 / (mu^2 + 0.01) of this very pixel; NaN where unknown
  std::vector<float> unsure_;        ///< variance of known_, where probes gave it
  std::vector<float> foretold_;      ///< what raw_ratio_ is on average, where the scene tells it; NaN where it does not
  std::vector<float> least_;         ///< raw_ratio_ of a pixel with much of the error, if its own mean is its expected value; NaN elsewhere
  std::vector<std::uint32_t> doubtful_;
  std::vector<float> doubtful_square_;  ///< mu^2 + 0.01 of each, luminance
  std::vector<float> pooled_ratio_;  ///< raw_ratio_ as pooled_variance_ is
  std::vector<float> window_ratio_;  ///< mean of raw_ratio_ over a window that knows its expected value
  std::vector<float> degrees_;       ///< of freedom of pooled_variance_
};

}  // namespace core
