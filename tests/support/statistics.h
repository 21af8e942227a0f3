/// Statistical tests for renderers: chi-squared of samples against a density, z-tests of a mean
/// against a true value, Kolmogorov-Smirnov, and the level of each of several tests.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "core/math/vec.h"

namespace test_support {

/// The level of one of `tests` tests that together have the false alarm probability `alpha`.
double sidak(double alpha, int tests);

/// P(|Z| > |z|) of the standard normal distribution.
double two_sided_p(double z);

struct Chi2Report {
  double statistic = 0;
  double degrees = 0;
  double p_value = 0;
};

/// Pearson's test. Cells with an expected count below 5 are merged into one. If that one also
/// expects less than 5, up to 15 observations in it count as errors of the expected values; more
/// give p = 0.
Chi2Report chi2(std::span<const double> observed, std::span<const double> expected);

/// Random numbers for tests: a counter through SplitMix64, not the renderer's sampler.
class Random {
 public:
  explicit Random(std::uint64_t seed);
  std::uint64_t bits();
  float uniform();  ///< [0,1)
  double uniform_double();
  core::Vec2 uniform_2d();
  double normal();

 private:
  std::uint64_t state_;
};

/// Samples a direction, or returns nothing (absorbed, or a delta lobe).
using SampleDirection = std::function<std::optional<core::Vec3>(Random&)>;
using DensityOfDirection = std::function<float(core::Vec3)>;

struct SphereGrid {
  int rows = 20;     ///< of equal height in z; even, so that z = 0 is an edge
  int columns = 24;  ///< of equal azimuth
  /// every cell is divided into four at least this often before it is integrated
  int depth_least = 2;
  int depth_most = 8;  ///< higher where the density jumps
};

/// Tests whether directions follow the density over solid angle. Absorbed samples have a separate
/// cell, whose expected count is the missing mass of the density.
Chi2Report chi2_sphere(const SampleDirection& sample, const DensityOfDirection& pdf_solid_angle,
                       int sample_count, std::uint64_t seed, SphereGrid grid = {});

/// Integral of f over a rectangle by adaptive 3x3 Gauss-Legendre.
double integrate_2d(const std::function<double(double, double)>& f, const double (&x)[2],
                    const double (&y)[2], double tolerance, int depth_least, int depth_most);

/// Mean and variance, streaming.
struct Moments {
  double n = 0;
  double mean = 0;
  double m2 = 0;
  void add(double x);
  double variance() const { return n > 1 ? m2 / (n - 1) : 0; }
  double standard_error() const;
  /// (mean - truth) / standard error; 0 if both are equal up to rounding.
  double z(double truth) const;
};

/// Slope of a least-squares line.
double slope(std::span<const double> x, std::span<const double> y);

/// Kolmogorov-Smirnov against the uniform distribution over [0,1]: the p-value (asymptotic form,
/// Stephens 1970).
double ks_uniform(std::vector<double> values);

/// P(T <= t), Student's t with k degrees of freedom.
double student_t_cdf(double t, double k);

}  // namespace test_support
