/// Optimal weights of multiple importance sampling for two techniques of one sample each.
///
/// With densities p and q, m = p + q and an integrand f, the integral is a + b plus the mixture's
/// estimate of f - a p - b q. The coefficients that leave the least variance solve A (a, b) = (<f
/// p>, <f q>), A the matrix of <p p>, <p q> and <q q>, where <g h> is the integral of g h / m. The
/// weights that this amounts to may be negative. 0, 0 is the balance heuristic. Source:
/// Kondapaneni, Vevoda, Grittmann, Skrivan, Slusallek and Krivanek, Optimal Multiple Importance
/// Sampling, 2019.
#pragma once

namespace core {

/// Sums over samples of both techniques of g h / m^2: estimates of <g h>, all by the same factor.
struct OptimalMisMatrix {
  double pp = 0;
  double pq = 0;
  double qq = 0;
};

struct OptimalMisCoefficients {
  double p = 0;
  double q = 0;
};

/// fp, fq: the right-hand side, by the same factor as the matrix. One that is nearly singular
/// (densities alike wherever samples fell) gives the balance heuristic.
inline OptimalMisCoefficients solve_optimal_mis(const OptimalMisMatrix& a, double fp,
                                                double fq) noexcept {
  const double determinant = a.pp * a.qq - a.pq * a.pq;
  if (!(determinant > 1e-3 * a.pp * a.qq)) {
    return {};
  }
  return {(fp * a.qq - fq * a.pq) / determinant, (a.pp * fq - a.pq * fp) / determinant};
}

}  // namespace core
