#include "core/color/wavelengths.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

#include "core/color/cie_data.h"

namespace core {
namespace {

constexpr std::size_t kNodes = kCieRows.size();

/// Interpolates linearly between the rows of the CIE tables.
struct Table {
  std::array<Rgb, kNodes> seen;             ///< colour of D65 [1/nm]; the integral is white
  std::array<float, kNodes> density{};      ///< [1/nm]
  std::array<float, kNodes> probability{};  ///< cumulative, from the shortest wavelength

  Table() {
    std::array<double, 3> white{};
    for (std::size_t i = 0; i < kNodes; ++i) {
      const CieRow& row = kCieRows[i];
      seen[i] = rgb_from_xyz(row.x, row.y, row.z) * row.d65;
      const double width = static_cast<double>(kCieStepNm) * (i == 0 || i + 1 == kNodes ? 0.5 : 1);
      for (int c = 0; c < 3; ++c) {
        white[static_cast<std::size_t>(c)] += width * static_cast<double>(seen[i][c]);
      }
    }
    double sum = 0;
    std::array<double, kNodes> length{};
    std::array<double, kNodes> below{};
    for (std::size_t i = 0; i < kNodes; ++i) {
      // The white of the table differs from that of the matrix by 1e-4.
      seen[i] = seen[i] * Rgb{static_cast<float>(1 / white[0]), static_cast<float>(1 / white[1]),
                              static_cast<float>(1 / white[2])};
      length[i] = std::hypot(static_cast<double>(seen[i].r), static_cast<double>(seen[i].g),
                             static_cast<double>(seen[i].b));
      if (i > 0) {
        sum += static_cast<double>(kCieStepNm) * (length[i - 1] + length[i]) / 2;
      }
      below[i] = sum;
    }
    for (std::size_t i = 0; i < kNodes; ++i) {
      density[i] = static_cast<float>(length[i] / sum);
      probability[i] = static_cast<float>(below[i] / sum);
    }
  }
};

const Table& table() {
  static const Table kTable;
  return kTable;
}

/// Coefficients of 1, x and x^2 with x = (nm - 580) / 200. They solve the six equations that make R
/// and B red and blue under D65, by Newton's method; G is the remainder.
constexpr std::array<float, 3> kRed = {-1.85401136F, 28.2374931F, 52.0351762F};
constexpr std::array<float, 3> kBlue = {-3.53855272F, 9.08311436F, 36.194615F};

Rgb shares_at(float nm) noexcept {
  const float x = (nm - 580) / 200;
  const float red = kRed[0] + x * (kRed[1] + x * kRed[2]);
  const float blue = kBlue[0] + x * (kBlue[1] + x * kBlue[2]);
  const float most = std::max({red, blue, 0.0F});
  const Rgb size = {std::exp(red - most), std::exp(-most), std::exp(blue - most)};
  return size / (size.r + size.g + size.b);
}

}  // namespace

Wavelengths::Wavelengths(float u) noexcept {
  const Table& t = table();
  std::array<float, 3> nm{};
  for (std::size_t k = 0; k < 3; ++k) {
    const float at = (u + static_cast<float>(2 - k)) / 3;
    const auto after = std::upper_bound(t.probability.begin(), t.probability.end(), at);
    const auto i = static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(
        after - t.probability.begin() - 1, 0, static_cast<std::ptrdiff_t>(kNodes) - 2));
    // Within a cell the density is linear (PBR 4th ed., section A.4.1).
    const float width = t.probability[i + 1] - t.probability[i];
    const float v = width > 0 ? std::clamp((at - t.probability[i]) / width, 0.0F, 1.0F) : 0.5F;
    const float a = t.density[i];
    const float b = t.density[i + 1];
    const float x = std::min(v * (a + b) / (a + std::sqrt(a * a + v * (b * b - a * a))), 1.0F);
    nm[k] = kCieFirstNm + (static_cast<float>(i) + x) * kCieStepNm;
    shares_[k] = shares_at(nm[k]);
    seen_[k] = lerp(t.seen[i], t.seen[i + 1], x) / (3 * (a + (b - a) * x));
  }
  nm_ = {nm[0], nm[1], nm[2]};
}

}  // namespace core
