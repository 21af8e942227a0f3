/// Cross-fitted coefficients of control variates: each replicate of a pixel uses the coefficient
/// that was fitted to the samples of its partner.
///
/// Replicates come in pairs, 2k in half A and 2k + 1 in half B. A path returns its radiance F and
/// the value C of a control variate with mean 0; F + c C has the mean of F for any c that is
/// independent of the sample. So c comes from the partner, which is independent, and is updated at
/// fixed sample counts (fit_is_due()). It depends only on the samples of this pixel and pair, not
/// on slices and threads, so films with other replicates can still be merged.
///
/// The replicates stay uncorrelated although each uses the other's fit, so (A - B)^2 / 4 still
/// estimates the variance. Proof: with centred values, a sample of A is x + c_B y and a sample of B
/// is x' + c_A' y'. x and y have mean 0 given all of B; x' and y' have mean 0 given all of A. What
/// remains is the mean of c_B y c_A' y', where c_B uses samples of B before A's sample, and c_A'
/// uses samples of A before B's sample. One of the two samples does not come before the other: say
/// it is A's, with y. Then y is independent of all of B and of A's earlier samples, so the mean is
/// 0. (Samples of a low-discrepancy set are weakly dependent, which leaves the product of two small
/// covariances.)
#pragma once

#include <cstdint>

#include "core/color/rgb.h"
#include "core/settings/settings.h"

namespace core {

enum class FitType { kNone, kOptimalMis, kRegression };

/// Returns the fit that the settings ask for.
FitType fit_type(const RenderSettings& settings) noexcept;

/// The contribution of one path to the fit. kOptimalMis: n samples of both techniques; x is the sum
/// of p / m over them, xx of its squares, y of f / m and xy of f / m p / m, where p is light
/// sampling and names are those of core/sampling/optimal_mis.h. kRegression: n light samples; x is
/// the sum of the regressor, xx of its squares, y of the response and xy of the products, in
/// luminance (y and xy are grey).
struct FitSample {
  Rgb control;  ///< C; has mean 0
  float n = 0;
  float x = 0;
  float xx = 0;
  Rgb y;
  Rgb xy;
};

/// Sums of a replicate, and the coefficient applied to its own samples. 48 bytes.
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

/// Returns whether the coefficient is updated before sample `count` of a replicate: at 0 and at 2^k
/// from kFirstFit on.
inline constexpr std::uint32_t kFirstFit = 4;
constexpr bool fit_is_due(std::uint32_t count) noexcept {
  return count == 0 || (count >= kFirstFit && (count & (count - 1)) == 0);
}

/// Returns the coefficient fitted to these sums. With few samples it is shrunk towards 0, which
/// means the balance heuristic or no control variate.
Rgb fitted_coefficient(FitType type, const ReplicateFit& sums) noexcept;

}  // namespace core
