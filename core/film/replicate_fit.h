/// Coefficients of control variates, cross-fitted: what the samples of one replicate of a pixel
/// teach is used on its partner.
///
/// Replicates come in pairs, 2k and 2k + 1, one in half A and one in half B. A path gives its
/// radiance F and the value C of a control variate whose mean is 0; F + c C has the mean of F
/// whatever c is, as long as c knows nothing of the sample it is used on. So c comes from the
/// partner, which is independent, at fixed sample counts (fit_is_due()). It is a function of the
/// pixel's own samples, whatever slices and threads were, and of the pair alone: films of other
/// replicates can be merged as ever.
///
/// Both replicates stay uncorrelated although each learns from the other, so that (A - B)^2 / 4 is
/// still the variance. With centred values, a sample of A is x + c_B y, of B x' + c_A y'. x, y have
/// mean 0 given all of B, x', y' given all of A; what is left is the mean of c_B y c_A' y' for c_B
/// from B's samples before that of A, c_A' from A's before that of B. One of the two samples is not
/// before the other: say it is A's, with y. It is independent of all B and of A's earlier samples,
/// so the mean is 0. (Within a low-discrepancy set samples know a little of each other; the product
/// of two such small covariances is left.)
#pragma once

#include <cstdint>

#include "core/color/rgb.h"
#include "core/settings/settings.h"

namespace core {

enum class FitType { kNone, kOptimalMis, kRegression };

/// What the settings ask to be fitted.
FitType fit_type(const RenderSettings& settings) noexcept;

/// What one path tells. kOptimalMis: n samples of both techniques, x the sum of p / m over them, xx
/// that of its squares, y that of f / m and xy that of f / m p / m, as named in
/// core/sampling/optimal_mis.h, p being light sampling. kRegression: n light samples, x the sum of
/// what is fitted to, xx of its squares, y of what it is to explain, xy of products, in luminance
/// (y and xy grey).
struct FitSample {
  Rgb control;  ///< C; mean 0
  float n = 0;
  float x = 0;
  float xx = 0;
  Rgb y;
  Rgb xy;
};

/// Sums of a replicate, and the coefficient that its own samples get. 48 bytes.
struct ReplicateFit {
  float n = 0;
  float x = 0;
  float xx = 0;
  Rgb y;
  Rgb xy;
  Rgb coefficient;

  void add(const FitSample& s) noexcept {
    n += s.n;
    x += s.x;
    xx += s.xx;
    y = y + s.y;
    xy = xy + s.xy;
  }
};

/// Before sample `count` of a replicate: does its coefficient change? At 0 and at 2^k from
/// kFirstFit on.
inline constexpr std::uint32_t kFirstFit = 4;
constexpr bool fit_is_due(std::uint32_t count) noexcept {
  return count == 0 || (count >= kFirstFit && (count & (count - 1)) == 0);
}

/// The coefficient that these sums suggest; few of them are pulled to 0, which is the balance
/// heuristic, or no control variate.
Rgb fitted_coefficient(FitType type, const ReplicateFit& sums) noexcept;

}  // namespace core
