#include "tests/support/statistics.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "core/base/statistics.h"

namespace test_support {

using core::Vec3;

double sidak(double alpha, int tests) { return 1 - std::pow(1 - alpha, 1.0 / tests); }

double two_sided_p(double z) { return std::erfc(std::fabs(z) / std::sqrt(2.0)); }

Chi2Report chi2(std::span<const double> observed, std::span<const double> expected) {
  Chi2Report report;
  double rest_observed = 0;
  double rest_expected = 0;
  int cells = 0;
  const auto add = [&](double seen, double due) {
    report.statistic += (seen - due) * (seen - due) / due;
    ++cells;
  };
  for (std::size_t i = 0; i < expected.size(); ++i) {
    if (expected[i] >= 5) {
      add(observed[i], expected[i]);
    } else {
      rest_observed += observed[i];
      rest_expected += expected[i];
    }
  }
  if (rest_expected >= 5) {
    add(rest_observed, rest_expected);
  } else if (rest_observed > 15) {
    report.statistic = 1e30;
    return report;
  }
  report.degrees = std::max(cells - 1, 1);
  report.p_value = 1 - core::chi2_cdf(report.statistic, report.degrees);
  return report;
}

namespace {

std::uint64_t mixed(std::uint64_t x) {
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

}  // namespace

// Mixes the seed: streams whose starts are a few steps apart would be shifted copies of one stream.
Random::Random(std::uint64_t seed)
    : state_(mixed(mixed(seed + 0x632be59bd9b4e019ULL) + 0x1234567ULL)) {}

std::uint64_t Random::bits() { return mixed(state_ += 0x9e3779b97f4a7c15ULL); }

float Random::uniform() { return static_cast<float>(bits() >> 40) * 0x1p-24F; }

double Random::uniform_double() { return static_cast<double>(bits() >> 11) * 0x1p-53; }

core::Vec2 Random::uniform_2d() {
  const float x = uniform();
  return {x, uniform()};
}

double Random::normal() {
  const double r = std::sqrt(-2 * std::log(1 - uniform_double()));
  return r * std::cos(6.283185307179586 * uniform_double());
}

namespace {

constexpr std::array<double, 3> kNodes = {0.1127016653792583, 0.5, 0.8872983346207417};
constexpr std::array<double, 3> kWeights = {5.0 / 18, 8.0 / 18, 5.0 / 18};

double gauss(const std::function<double(double, double)>& f, const double (&x)[2],
             const double (&y)[2]) {
  double sum = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      sum += kWeights[i] * kWeights[k] *
             f(x[0] + (x[1] - x[0]) * kNodes[i], y[0] + (y[1] - y[0]) * kNodes[k]);
    }
  }
  return sum * (x[1] - x[0]) * (y[1] - y[0]);
}

double refine(const std::function<double(double, double)>& f, const double (&x)[2],
              const double (&y)[2], double coarse, double tolerance, int least, int most) {
  const double xm = 0.5 * (x[0] + x[1]);
  const double ym = 0.5 * (y[0] + y[1]);
  const double xs[2][2] = {{x[0], xm}, {xm, x[1]}};
  const double ys[2][2] = {{y[0], ym}, {ym, y[1]}};
  double parts[2][2];
  double fine = 0;
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 2; ++k) {
      parts[i][k] = gauss(f, xs[i], ys[k]);
      fine += parts[i][k];
    }
  }
  if (most <= 0 || (least <= 0 && std::fabs(fine - coarse) <= tolerance)) {
    return fine;
  }
  double sum = 0;
  for (int i = 0; i < 2; ++i) {
    for (int k = 0; k < 2; ++k) {
      sum += refine(f, xs[i], ys[k], parts[i][k], tolerance / 3, least - 1, most - 1);
    }
  }
  return sum;
}

}  // namespace

double integrate_2d(const std::function<double(double, double)>& f, const double (&x)[2],
                    const double (&y)[2], double tolerance, int depth_least, int depth_most) {
  return refine(f, x, y, gauss(f, x, y), tolerance, depth_least - 1, depth_most - 1);
}

Chi2Report chi2_sphere(const SampleDirection& sample, const DensityOfDirection& pdf_solid_angle,
                       int sample_count, std::uint64_t seed, SphereGrid grid) {
  constexpr double kTwoPi = 6.283185307179586;
  const auto cells = static_cast<std::size_t>(grid.rows * grid.columns);
  std::vector<double> observed(cells + 1, 0.0);
  std::vector<double> expected(cells + 1, 0.0);
  Random random(seed);
  for (int i = 0; i < sample_count; ++i) {
    const std::optional<Vec3> w = sample(random);
    if (!w) {
      ++observed[cells];
      continue;
    }
    double phi = std::atan2(static_cast<double>(w->y), static_cast<double>(w->x));
    phi += phi < 0 ? kTwoPi : 0.0;
    const int row = std::clamp(static_cast<int>((static_cast<double>(w->z) + 1) / 2 * grid.rows), 0,
                               grid.rows - 1);
    const int column =
        std::clamp(static_cast<int>(phi / kTwoPi * grid.columns), 0, grid.columns - 1);
    ++observed[static_cast<std::size_t>(row * grid.columns + column)];
  }
  // Over (z, phi) a solid angle is dz dphi.
  const std::function<double(double, double)> density = [&](double z, double phi) {
    const double r = std::sqrt(std::max(1 - z * z, 0.0));
    return static_cast<double>(
        pdf_solid_angle({static_cast<float>(r * std::cos(phi)),
                         static_cast<float>(r * std::sin(phi)), static_cast<float>(z)}));
  };
  double total = 0;
  for (int row = 0; row < grid.rows; ++row) {
    for (int column = 0; column < grid.columns; ++column) {
      const double z[2] = {2.0 * row / grid.rows - 1, 2.0 * (row + 1) / grid.rows - 1};
      const double phi[2] = {kTwoPi * column / grid.columns, kTwoPi * (column + 1) / grid.columns};
      const double mass = integrate_2d(density, z, phi, 2e-6, grid.depth_least, grid.depth_most);
      expected[static_cast<std::size_t>(row * grid.columns + column)] = mass * sample_count;
      total += mass;
    }
  }
  expected[cells] = (1 - total) * sample_count;
  // A density whose integral exceeds 1 is as wrong as misplaced samples; 5e-3 allows for the
  // integration.
  if (total > 1.005) {
    return {1e30, 1, 0};
  }
  expected[cells] = std::max(expected[cells], 0.0);
  return chi2(observed, expected);
}

void Moments::add(double x) {
  n += 1;
  const double d = x - mean;
  mean += d / n;
  m2 += d * (x - mean);
}

double Moments::standard_error() const { return n > 1 ? std::sqrt(variance() / n) : 0; }

double Moments::z(double truth) const {
  const double d = mean - truth;
  const double se = standard_error();
  if (std::fabs(d) <= 1e-6 * std::fabs(truth)) {
    return 0;
  }
  return se > 0 ? d / se : (d > 0 ? 1e30 : -1e30);
}

double slope(std::span<const double> x, std::span<const double> y) {
  const auto n = static_cast<double>(x.size());
  const double mx = std::accumulate(x.begin(), x.end(), 0.0) / n;
  const double my = std::accumulate(y.begin(), y.end(), 0.0) / n;
  double xy = 0;
  double xx = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xy += (x[i] - mx) * (y[i] - my);
    xx += (x[i] - mx) * (x[i] - mx);
  }
  return xy / xx;
}

double ks_uniform(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const auto n = static_cast<double>(values.size());
  double d = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    const auto at = static_cast<double>(i);
    d = std::max({d, values[i] - at / n, (at + 1) / n - values[i]});
  }
  const double root = std::sqrt(n);
  const double t = d * (root + 0.12 + 0.11 / root);
  double sum = 0;
  for (int k = 1; k < 100; ++k) {
    sum += (k % 2 == 1 ? 2.0 : -2.0) * std::exp(-2.0 * k * k * t * t);
  }
  return std::clamp(sum, 0.0, 1.0);
}

double student_t_cdf(double t, double k) {
  // The quantile is from core; its inverse is computed by bisection over p.
  double low = 0;
  double high = 1;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (core::student_t_quantile(middle, k) < t ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace test_support
