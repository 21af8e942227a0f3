#include "core/compare/comparison.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include "core/base/statistics.h"
#include "core/compare/flip.h"
#include "core/film/summed_area.h"

namespace core {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kRegularizer = 0.01;
/// Noise is pooled over this many pixels to each side. Both images together then give 18 squares,
/// which the degrees of freedom account for. Wider windows mix noise of different strength,
/// dominated by the strongest.
constexpr int kPoolRadius = 1;
/// Relative error of running means in single precision.
constexpr double kRounding = 0x1p-21;
constexpr double kZMax = 38;  // end of the normal distribution's range in double precision

/// Returns the degrees of freedom of a sum of squares, from sum e^2 and sum e^4: the number of
/// terms if they are Gaussian and equal (E e^4 = 3 sigma^4), 1 if one term dominates.
double degrees_of(double squares, double fourths) {
  return fourths > 0 ? std::max(3 * squares * squares / fourths - 2, 1.0) : 1.0;
}

/// Returns the normal deviate with the same probability as Student's t with k degrees of freedom.
/// Source: Wallace, Bounds on normal approximations to Student's and the chi-square distributions,
/// 1959.
double normal_from_t(double t, double k) {
  const double z = (8 * k + 1) / (8 * k + 3) * std::sqrt(k * std::log1p(t * t / k));
  return std::copysign(std::min(z, kZMax), t);
}

/// Variance of one image's luminance, per pixel.
class SideNoise {
 public:
  explicit SideNoise(const Picture& picture)
      : picture_(picture),
        squares_(picture.width, picture.height),
        fourths_(picture.width, picture.height),
        spread_(picture.width, picture.height) {
    if (picture.half_difference.empty()) {
      return;
    }
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const std::size_t i = index(x, y);
        const auto e = static_cast<double>(luminance(picture.half_difference[i]));
        squares_.set(x, y, e * e);
        fourths_.set(x, y, e * e * e * e);
        spread_.set(x, y,
                    picture.sample_variance.empty()
                        ? 1.0
                        : static_cast<double>(picture.sample_variance[i]));
      }
    }
  }

  struct Value {
    double variance = 0;
    double squares = 0;  ///< sums over the window, for the degrees of freedom
    double fourths = 0;
  };
  Value at(int x, int y) const {
    Value value;
    if (picture_.half_difference.empty()) {
      return value;
    }
    const int x0 = std::max(x - kPoolRadius, 0);
    const int y0 = std::max(y - kPoolRadius, 0);
    const PixelRect window = {x0, y0, std::min(x + kPoolRadius + 1, picture_.width) - x0,
                              std::min(y + kPoolRadius + 1, picture_.height) - y0};
    const double count = static_cast<double>(window.width) * static_cast<double>(window.height);
    value.squares = std::max(squares_.sum(window), 0.0);
    value.fourths = std::max(fourths_.sum(window), 0.0);
    // Averages the window's estimate and the spread of the pixel's own samples, because noise
    // changes abruptly at edges.
    const double spread = spread_.sum(window) / count;
    const double own = picture_.sample_variance.empty()
                           ? 1.0
                           : static_cast<double>(picture_.sample_variance[index(x, y)]);
    value.variance = value.squares / count * (spread > 0 ? 0.5 + 0.5 * own / spread : 1.0);
    return value;
  }
  double rounding_variance(std::size_t i) const {
    const double own = static_cast<double>(luminance(picture_.values[i])) * kRounding;
    return own * own + (picture_.rounding_variance.empty()
                            ? 0.0
                            : static_cast<double>(picture_.rounding_variance[i]));
  }
  /// Returns whether all known samples of the pixel agree; the noise of its neighbours then does
  /// not apply.
  bool is_silent(std::size_t i) const {
    if (picture_.half_difference.empty()) {
      return true;
    }
    const auto e = static_cast<double>(luminance(picture_.half_difference[i]));
    const double rounding = 16 * rounding_variance(i);
    return !picture_.sample_variance.empty() && e * e <= rounding &&
           static_cast<double>(picture_.sample_variance[i]) <= rounding;
  }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(picture_.width) +
           static_cast<std::size_t>(x);
  }

 private:
  const Picture& picture_;
  SummedArea squares_;
  SummedArea fourths_;
  SummedArea spread_;
};

void measure_difference(const Picture& a, const Picture& b, Comparison& out) {
  const std::size_t n = a.pixel_count();
  out.difference.resize(n);
  for (std::size_t i = 0; i < n; ++i) {
    out.difference[i] = a.values[i] - b.values[i];
    for (int c = 0; c < 3; ++c) {
      const auto d = static_cast<double>(a.values[i][c]) - static_cast<double>(b.values[i][c]);
      const auto reference = static_cast<double>(b.values[i][c]);
      out.mse += d * d;
      out.relmse += d * d / (reference * reference + kRegularizer);
      out.bias += d;
    }
  }
  const double values = 3 * static_cast<double>(n);
  out.mse /= values;
  out.relmse /= values;
  out.bias /= values;
}

/// Variance of a mean over the image, and its degrees of freedom.
struct MeanNoise {
  double variance = 0;
  double degrees = 1;
};

/// If errors of pixels are independent, their squares add up, which estimates the variance better
/// than a few replicates.
MeanNoise noise_of_independent(std::span<const Picture* const> sides) {
  double squares = 0;
  double fourths = 0;
  for (const Picture* side : sides) {
    for (const Rgb& half : side->half_difference) {
      const auto e = static_cast<double>(average(half));
      squares += e * e;
      fourths += e * e * e * e;
    }
  }
  const auto pixels = static_cast<double>(sides.front()->pixel_count());
  return {squares / (pixels * pixels), degrees_of(squares, fourths)};
}

MeanNoise mean_noise(const Picture& side) {
  if (side.errors == PixelErrors::kIndependent) {
    const Picture* const one = &side;
    return noise_of_independent({&one, 1});
  }
  return {side.mean_variance, side.mean_degrees};
}

/// Source: Welch, The generalization of Student's problem when several different population
/// variances are involved, 1947.
MeanNoise sum_of(const MeanNoise& a, const MeanNoise& b) {
  const double variance = a.variance + b.variance;
  const double spread = a.variance * a.variance / a.degrees + b.variance * b.variance / b.degrees;
  return {variance, spread > 0 ? variance * variance / spread : 1.0};
}

bool knows_its_mean(const Picture& side) {
  return side.is_exact || (!side.half_difference.empty() &&
                           (side.errors == PixelErrors::kIndependent || side.mean_degrees > 0));
}

void bound_bias(const Picture& a, const Picture& b, Comparison& out) {
  if (!knows_its_mean(a) || !knows_its_mean(b)) {
    out.bias_low = out.bias_high = kNan;
    return;
  }
  const bool adds_up =
      a.errors == PixelErrors::kIndependent && b.errors == PixelErrors::kIndependent;
  const std::array sides = {&a, &b};
  const MeanNoise noise =
      adds_up ? noise_of_independent(sides) : sum_of(mean_noise(a), mean_noise(b));
  const double width = student_t_quantile(0.975, noise.degrees) * std::sqrt(noise.variance);
  out.bias_low = out.bias - width;
  out.bias_high = out.bias + width;
}

void map_z(const Picture& a, const Picture& b, Comparison& out) {
  out.z.resize(a.pixel_count());
  if (!a.knows_its_error() || !b.knows_its_error()) {
    std::fill(out.z.begin(), out.z.end(), std::numeric_limits<float>::quiet_NaN());
    out.z_mean = out.z_variance = out.z_share_above_3 = kNan;
    return;
  }
  const SideNoise left(a);
  const SideNoise right(b);
  double count = 0;
  double sum = 0;
  double squares = 0;
  double beyond = 0;
  for (int y = 0; y < a.height; ++y) {
    for (int x = 0; x < a.width; ++x) {
      const std::size_t i = left.index(x, y);
      const double d =
          static_cast<double>(luminance(a.values[i])) - static_cast<double>(luminance(b.values[i]));
      const SideNoise::Value va = left.at(x, y);
      const SideNoise::Value vb = right.at(x, y);
      const double noise = va.variance + vb.variance;
      const double rounding = left.rounding_variance(i) + right.rounding_variance(i);
      const bool is_random = noise > 0 && !(left.is_silent(i) && right.is_silent(i));
      if (!(noise + rounding > 0) || (!is_random && d * d <= 16 * rounding)) {
        continue;  // no noise and no difference
      }
      const double z = normal_from_t(
          d / std::sqrt(noise + rounding),
          noise > 0 ? degrees_of(va.squares + vb.squares, va.fourths + vb.fourths) : 1e9);
      out.z[i] = static_cast<float>(z);
      count += 1;
      sum += z;
      squares += z * z;
      beyond += std::abs(z) > 3 ? 1 : 0;
    }
  }
  out.z_mean = count > 0 ? sum / count : 0;
  out.z_variance = count > 1 ? (squares - sum * sum / count) / (count - 1) : kNan;
  out.z_share_above_3 = count > 0 ? beyond / count : 0;
}

Rgb between(const Rgb* colors, std::size_t count, float t) noexcept {
  const float at = std::clamp(t, 0.0F, 1.0F) * static_cast<float>(count - 1);
  const auto first = std::min(static_cast<std::size_t>(at), count - 2);
  return lerp(colors[first], colors[first + 1], at - static_cast<float>(first));
}

}  // namespace

Result<Comparison> compare_pictures(const Picture& a, const Picture& b) {
  if (a.width != b.width || a.height != b.height) {
    return Error{ErrorCode::kInvalidArgument,
                 "the images have different sizes: " + std::to_string(a.width) + " by " +
                     std::to_string(a.height) + " and " + std::to_string(b.width) + " by " +
                     std::to_string(b.height) + " pixels",
                 "/b"};
  }
  Comparison out;
  measure_difference(a, b, out);
  bound_bias(a, b, out);
  map_z(a, b, out);
  out.flip_map = flip_map(a.values, b.values, a.width, a.height);
  for (const float value : out.flip_map) {
    out.flip += static_cast<double>(value);
  }
  out.flip /= static_cast<double>(a.pixel_count());
  return out;
}

Rgb heat_color(float value) noexcept {
  constexpr std::array<Rgb, 5> kColors = {Rgb{0, 0, 0.02F}, Rgb{0.27F, 0.08F, 0.45F},
                                          Rgb{0.73F, 0.22F, 0.33F}, Rgb{0.98F, 0.57F, 0.15F},
                                          Rgb{0.99F, 0.98F, 0.75F}};
  return between(kColors.data(), kColors.size(), value > 0 ? value : 0.0F);
}

Rgb signed_color(float value) noexcept {
  constexpr std::array<Rgb, 5> kColors = {Rgb{0.03F, 0.19F, 0.42F}, Rgb{0.33F, 0.6F, 0.82F},
                                          Rgb{0.97F, 0.97F, 0.97F}, Rgb{0.93F, 0.54F, 0.4F},
                                          Rgb{0.45F, 0, 0.08F}};
  return between(kColors.data(), kColors.size(), std::isfinite(value) ? 0.5F + 0.5F * value : 0.5F);
}

}  // namespace core
