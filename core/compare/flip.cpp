#include "core/compare/flip.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace core {
namespace {

constexpr double kPi = 3.14159265358979323846;
// Section 4.1: sums of a * sqrt(pi / b) * exp(-pi^2 d^2 / b), d in degrees, fitted to contrast
// sensitivity.
struct Gaussian {
  double a;
  double b;
};
constexpr std::array kAchromatic = {Gaussian{1, 0.0047}};
constexpr std::array kRedGreen = {Gaussian{1, 0.0053}};
constexpr std::array kBlueYellow = {Gaussian{34.1, 0.04}, Gaussian{13.5, 0.025}};
constexpr double kWidestB = 0.04;
// Sections 4.1.3 and 4.3.
constexpr double kColorExponent = 0.7;
constexpr double kKneeIn = 0.4;
constexpr double kKneeOut = 0.95;
// Section 4.2.
constexpr double kFeatureWidthDegrees = 0.082;
constexpr double kFeatureExponent = 0.5;

using Triple = std::array<double, 3>;

/// IEC 61966-2-1.
Triple xyz_from_rgb(const Triple& c) {
  return {
      0.4124 * c[0] + 0.3576 * c[1] + 0.1805 * c[2],
      kLuminance<double>[0] * c[0] + kLuminance<double>[1] * c[1] + kLuminance<double>[2] * c[2],
      0.0193 * c[0] + 0.1192 * c[1] + 0.9505 * c[2]};
}

/// Inverse of xyz_from_rgb() by Cramer's rule.
Triple rgb_from_xyz(const Triple& v) {
  static const std::array<Triple, 3> kInverse = [] {
    const std::array<Triple, 3> m = {xyz_from_rgb({1, 0, 0}), xyz_from_rgb({0, 1, 0}),
                                     xyz_from_rgb({0, 0, 1})};
    const auto cross = [](const Triple& p, const Triple& q) {
      return Triple{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2],
                    p[0] * q[1] - p[1] * q[0]};
    };
    std::array<Triple, 3> rows = {cross(m[1], m[2]), cross(m[2], m[0]), cross(m[0], m[1])};
    const double determinant = m[0][0] * rows[0][0] + m[0][1] * rows[0][1] + m[0][2] * rows[0][2];
    for (Triple& row : rows) {
      for (double& value : row) {
        value /= determinant;
      }
    }
    return rows;
  }();
  Triple c{};
  for (std::size_t i = 0; i < 3; ++i) {
    c[i] = kInverse[i][0] * v[0] + kInverse[i][1] * v[1] + kInverse[i][2] * v[2];
  }
  return c;
}

/// XYZ relative to white.
Triple relative_xyz(const Triple& rgb) {
  static const Triple kWhite = xyz_from_rgb({1, 1, 1});
  const Triple v = xyz_from_rgb(rgb);
  return {v[0] / kWhite[0], v[1] / kWhite[1], v[2] / kWhite[2]};
}

/// The linear opponent space YCxCz in which contrast sensitivity was measured.
Triple ycxcz_from_rgb(const Triple& rgb) {
  const Triple v = relative_xyz(rgb);
  return {116 * v[1] - 16, 500 * (v[0] - v[1]), 200 * (v[1] - v[2])};
}

Triple rgb_from_ycxcz(const Triple& v) {
  static const Triple kWhite = xyz_from_rgb({1, 1, 1});
  const double y = (v[0] + 16) / 116;
  return rgb_from_xyz({(v[1] / 500 + y) * kWhite[0], y * kWhite[1], (y - v[2] / 200) * kWhite[2]});
}

/// CIELAB with the Hunt effect: chroma increases with lightness.
Triple hunt_lab_from_rgb(const Triple& rgb) {
  constexpr double kDelta = 6.0 / 29;
  const auto f = [](double t) {
    return t > kDelta * kDelta * kDelta ? std::cbrt(t) : t / (3 * kDelta * kDelta) + 4.0 / 29;
  };
  const Triple v = relative_xyz(rgb);
  const double lightness = 116 * f(v[1]) - 16;
  const double scale = 0.01 * lightness;
  return {lightness, scale * 500 * (f(v[0]) - f(v[1])), scale * 200 * (f(v[1]) - f(v[2]))};
}

/// HyAB distance (Abasi, Amani Tehran, Fairchild 2020), raised to the paper's power.
double color_distance(const Triple& a, const Triple& b) {
  return std::pow(std::abs(a[0] - b[0]) + std::hypot(a[1] - b[1], a[2] - b[2]), kColorExponent);
}

/// Maps the largest distance, between green and blue, to 1; most of the range is for small
/// differences.
double redistribute(double distance) {
  static const double kMost =
      color_distance(hunt_lab_from_rgb({0, 1, 0}), hunt_lab_from_rgb({0, 0, 1}));
  const double knee = kKneeIn * kMost;
  return distance < knee ? kKneeOut / knee * distance
                         : kKneeOut + (distance - knee) / (kMost - knee) * (1 - kKneeOut);
}

class Plane {
 public:
  Plane(int width, int height)
      : width_(width),
        height_(height),
        values_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {}
  float& operator[](std::size_t i) { return values_[i]; }
  float operator[](std::size_t i) const { return values_[i]; }

  /// Convolves with across(x) * down(y), both of odd length; border values extend outside.
  Plane filtered(const std::vector<double>& across, const std::vector<double>& down) const {
    return along(across, true).along(down, false);
  }

 private:
  Plane along(const std::vector<double>& kernel, bool rows) const {
    Plane out(width_, height_);
    const int radius = static_cast<int>(kernel.size() / 2);
    const int length = rows ? width_ : height_;
    const std::size_t step = rows ? 1 : static_cast<std::size_t>(width_);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        const int at = rows ? x : y;
        const std::size_t start =
            rows ? static_cast<std::size_t>(y) * static_cast<std::size_t>(width_)
                 : static_cast<std::size_t>(x);
        double sum = 0;
        for (int k = -radius; k <= radius; ++k) {
          const auto from = static_cast<std::size_t>(std::clamp(at + k, 0, length - 1));
          sum += kernel[static_cast<std::size_t>(k + radius)] *
                 static_cast<double>(values_[start + from * step]);
        }
        out.values_[start + static_cast<std::size_t>(at) * step] = static_cast<float>(sum);
      }
    }
    return out;
  }

  int width_;
  int height_;
  std::vector<float> values_;
};

template <typename Function>
std::vector<double> sampled(int radius, const Function& f) {
  std::vector<double> kernel;
  for (int k = -radius; k <= radius; ++k) {
    kernel.push_back(f(static_cast<double>(k)));
  }
  return kernel;
}

double total(const std::vector<double>& kernel) {
  double sum = 0;
  for (const double value : kernel) {
    sum += value;
  }
  return sum;
}

void scale(std::vector<double>& kernel, double factor) {
  for (double& value : kernel) {
    value *= factor;
  }
}

/// Scales positive weights to sum to 1, negative ones to -1.
void normalise_signed(std::vector<double>& kernel) {
  double positive = 0;
  double negative = 0;
  for (const double value : kernel) {
    (value > 0 ? positive : negative) += std::abs(value);
  }
  for (double& value : kernel) {
    value /= value > 0 ? positive : negative;
  }
}

template <std::size_t N>
Plane csf_filtered(const Plane& plane, const std::array<Gaussian, N>& terms,
                   double pixels_per_degree, int width, int height) {
  const int radius =
      static_cast<int>(std::ceil(3 * std::sqrt(kWidestB / (2 * kPi * kPi)) * pixels_per_degree));
  Plane sum(width, height);
  std::array<std::vector<double>, N> kernels;
  std::array<double, N> weights{};
  double all = 0;
  for (std::size_t i = 0; i < N; ++i) {
    const Gaussian g = terms[i];
    kernels[i] = sampled(radius, [&](double k) {
      const double degrees = k / pixels_per_degree;
      return std::exp(-kPi * kPi * degrees * degrees / g.b);
    });
    const double line = total(kernels[i]);
    weights[i] = g.a * std::sqrt(kPi / g.b) * line * line;
    scale(kernels[i], 1 / line);
    all += weights[i];
  }
  for (std::size_t i = 0; i < N; ++i) {
    const Plane term = plane.filtered(kernels[i], kernels[i]);
    const auto share = static_cast<float>(weights[i] / all);
    for (std::size_t p = 0; p < static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
         ++p) {
      sum[p] += share * term[p];
    }
  }
  return sum;
}

struct Features {
  std::vector<float> edge;
  std::vector<float> point;
};

/// Returns the norms of the first and second derivative of a Gaussian, in x and y.
Features features_of(const Plane& y, double pixels_per_degree, int width, int height) {
  const double sigma = 0.5 * kFeatureWidthDegrees * pixels_per_degree;
  const int radius = static_cast<int>(std::ceil(3 * sigma));
  std::vector<double> smooth =
      sampled(radius, [&](double k) { return std::exp(-k * k / (2 * sigma * sigma)); });
  std::vector<double> edge =
      sampled(radius, [&](double k) { return -k * std::exp(-k * k / (2 * sigma * sigma)); });
  std::vector<double> point = sampled(radius, [&](double k) {
    return (k * k / (sigma * sigma) - 1) * std::exp(-k * k / (2 * sigma * sigma));
  });
  scale(smooth, 1 / total(smooth));
  normalise_signed(edge);
  normalise_signed(point);
  const auto norm = [&](const std::vector<double>& kernel) {
    const Plane across = y.filtered(kernel, smooth);
    const Plane down = y.filtered(smooth, kernel);
    std::vector<float> length(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for (std::size_t i = 0; i < length.size(); ++i) {
      length[i] = std::hypot(across[i], down[i]);
    }
    return length;
  };
  return {norm(edge), norm(point)};
}

struct PerceivedImage {
  std::vector<Triple> color;  ///< filtered by contrast sensitivity, in Hunt-adjusted CIELAB
  Features features;
};

PerceivedImage perceived(std::span<const Rgb> picture, int width, int height,
                         double pixels_per_degree) {
  Plane y(width, height);
  Plane cx(width, height);
  Plane cz(width, height);
  Plane luminance(width, height);
  for (std::size_t i = 0; i < picture.size(); ++i) {
    const auto clipped = [](float v) {
      return v > 0 ? std::min(static_cast<double>(v), 1.0) : 0.0;
    };
    const Triple v =
        ycxcz_from_rgb({clipped(picture[i].r), clipped(picture[i].g), clipped(picture[i].b)});
    y[i] = static_cast<float>(v[0]);
    cx[i] = static_cast<float>(v[1]);
    cz[i] = static_cast<float>(v[2]);
    luminance[i] = static_cast<float>((v[0] + 16) / 116);
  }
  const Plane sharp_y = csf_filtered(y, kAchromatic, pixels_per_degree, width, height);
  const Plane sharp_cx = csf_filtered(cx, kRedGreen, pixels_per_degree, width, height);
  const Plane sharp_cz = csf_filtered(cz, kBlueYellow, pixels_per_degree, width, height);
  PerceivedImage out;
  out.color.reserve(picture.size());
  for (std::size_t i = 0; i < picture.size(); ++i) {
    Triple rgb = rgb_from_ycxcz({static_cast<double>(sharp_y[i]), static_cast<double>(sharp_cx[i]),
                                 static_cast<double>(sharp_cz[i])});
    for (double& value : rgb) {
      value = std::clamp(value, 0.0, 1.0);
    }
    out.color.push_back(hunt_lab_from_rgb(rgb));
  }
  out.features = features_of(luminance, pixels_per_degree, width, height);
  return out;
}

}  // namespace

std::vector<float> flip_map(std::span<const Rgb> a, std::span<const Rgb> b, int width, int height,
                            double pixels_per_degree) {
  const PerceivedImage left = perceived(a, width, height, pixels_per_degree);
  const PerceivedImage right = perceived(b, width, height, pixels_per_degree);
  std::vector<float> map(a.size());
  for (std::size_t i = 0; i < map.size(); ++i) {
    const double color = redistribute(color_distance(left.color[i], right.color[i]));
    const double edge =
        std::abs(static_cast<double>(left.features.edge[i] - right.features.edge[i]));
    const double point =
        std::abs(static_cast<double>(left.features.point[i] - right.features.point[i]));
    const double feature =
        std::pow(std::min(std::max(edge, point) / std::sqrt(2.0), 1.0), kFeatureExponent);
    map[i] = static_cast<float>(std::pow(std::clamp(color, 0.0, 1.0), 1 - feature));
  }
  return map;
}

}  // namespace core
