#include "core/color/wavelength.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace core {
namespace {

constexpr float kFirst = 390;
constexpr float kLast = 710;
constexpr std::size_t kCells = 160;
constexpr float kStep = (kLast - kFirst) / static_cast<float>(kCells);

Rgb matching(float nm) {
  const auto bell = [nm](float alpha, float mu, float below, float above) {
    const float t = (nm - mu) / (nm < mu ? below : above);
    return alpha * std::exp(-0.5F * t * t);
  };
  const float x = bell(1.056F, 599.8F, 37.9F, 31.0F) + bell(0.362F, 442.0F, 16.0F, 26.7F) +
                  bell(-0.065F, 501.1F, 20.4F, 26.2F);
  const float y = bell(0.821F, 568.8F, 46.9F, 40.5F) + bell(0.286F, 530.9F, 16.3F, 31.1F);
  const float z = bell(1.217F, 437.0F, 11.8F, 36.0F) + bell(0.681F, 459.0F, 26.0F, 13.8F);
  return {3.2404542F * x - 1.5371385F * y - 0.4985314F * z, -0.9692660F * x + 1.8760108F * y + 0.0415560F * z,
          0.0556434F * x - 0.2040259F * y + 1.0572252F * z};
}

struct Table {
  std::array<float, kCells + 1> cdf{};
  std::array<Rgb, kCells> weight;

  Table() {
    std::array<Rgb, kCells> rgb;
    std::array<double, 3> mean{};
    for (std::size_t i = 0; i < kCells; ++i) {
      rgb[i] = matching(kFirst + (static_cast<float>(i) + 0.5F) * kStep);
      for (std::size_t c = 0; c < 3; ++c) {
        mean[c] += static_cast<double>(rgb[i][static_cast<int>(c)]) / kCells;
      }
    }
    double sum = 0;
    std::array<double, kCells> size{};
    for (std::size_t i = 0; i < kCells; ++i) {
      rgb[i] = {rgb[i].r / static_cast<float>(mean[0]), rgb[i].g / static_cast<float>(mean[1]),
                rgb[i].b / static_cast<float>(mean[2])};
      size[i] = static_cast<double>(std::fabs(rgb[i].r) + std::fabs(rgb[i].g) + std::fabs(rgb[i].b)) + 1e-3;
      sum += size[i];
    }
    double at = 0;
    for (std::size_t i = 0; i < kCells; ++i) {
      const double prob = size[i] / sum;
      weight[i] = rgb[i] * static_cast<float>(1 / (prob * kCells));
      at += prob;
      cdf[i + 1] = static_cast<float>(at);
    }
    cdf[kCells] = 1;
  }
};

}  // namespace

WavelengthSample sample_wavelength(float u) noexcept {
  static const Table table;
  const auto after = std::upper_bound(table.cdf.begin(), table.cdf.end(), u);
  const auto cell = std::min<std::size_t>(
      static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - table.cdf.begin() - 1, 0)), kCells - 1);
  const float width = table.cdf[cell + 1] - table.cdf[cell];
  const float within = width > 0 ? (u - table.cdf[cell]) / width : 0.5F;
  return {kFirst + (static_cast<float>(cell) + within) * kStep, table.weight[cell]};
}

float dispersive_ior(float n_d, float dispersion, float wavelength_nm) noexcept {
  const float abbe_inverse = dispersion / 20;
  const float n = n_d + (n_d - 1) * abbe_inverse * (523655.0F / (wavelength_nm * wavelength_nm) - 1.5168F);
  return std::max(n, 1.0F);
}

}  // namespace core
