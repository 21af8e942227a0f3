/// Optimal weights of multiple importance sampling for two techniques of one sample each.
///
/// With densities p and q, m = p + q and an integrand f, the integral is a + b plus the mixture's
/// estimate of f - a p - b q. The coefficients with the least variance solve A (a, b) = (<f p>, <f
/// q>), where A is the matrix of <p p>, <p q> and <q q>, and <g h> is the integral of g h / m. The
/// resulting weights may be negative. Coefficients 0, 0 are the balance heuristic. Source:
/// Kondapaneni, Vevoda, Grittmann, Skrivan, Slusallek and Krivanek, Optimal Multiple Importance
/// Sampling, 2019.
#pragma once

namespace core {

/// Sums over samples of both techniques of g h / m^2: estimates of <g h> up to a common factor.
struct OptimalMisMatrix {
  double pp = 0;
  double pq = 0;
  double qq = 0;
};

struct OptimalMisCoefficients {
  double p = 0;
  double q = 0;
};

/// Solves for the coefficients. fp, fq: the right-hand side, with the same factor as the matrix. A
/// nearly singular matrix (equal densities at all samples) gives the balance heuristic.
inline OptimalMisCoefficients solve_optimal_mis(const OptimalMisMatrix& a, double fp,
                                                double fq) noexcept {
  const double determinant = a.pp * a.qq - a.pq * a.pq;
  if (!(determinant > 1e-3 * a.pp * a.qq)) {
    return {};
  }
  return {(fp * a.qq - fq * a.pq) / determinant, (a.pp * fq - a.pq * fp) / determinant};
}

}  // namespace core
