#include "core/color/wavelength.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace core {

Rgb color_matching(float nm) noexcept {
  const auto bell = [nm](float alpha, float mu, float below, float above) {
    const float t = (nm - mu) / (nm < mu ? below : above);
    return alpha * std::exp(-0.5F * t * t);
  };
  const float x = bell(1.056F, 599.8F, 37.9F, 31.0F) + bell(0.362F, 442.0F, 16.0F, 26.7F) +
                  bell(-0.065F, 501.1F, 20.4F, 26.2F);
  const float y = bell(0.821F, 568.8F, 46.9F, 40.5F) + bell(0.286F, 530.9F, 16.3F, 31.1F);
  const float z = bell(1.217F, 437.0F, 11.8F, 36.0F) + bell(0.681F, 459.0F, 26.0F, 13.8F);
  // As rgb_from_xyz(), written out: called here, the compiler rounds other products.
  return {3.2404542F * x - 1.5371385F * y - 0.4985314F * z,
          -0.9692660F * x + 1.8760108F * y + 0.0415560F * z,
          0.0556434F * x - 0.2040259F * y + 1.0572252F * z};
}

namespace {

constexpr float kFirst = 390;
constexpr float kLast = 710;
constexpr std::size_t kCells = 160;
constexpr float kStep = (kLast - kFirst) / static_cast<float>(kCells);

struct Table {
  std::array<float, kCells + 1> cdf{};
  std::array<Rgb, kCells> weight;
  std::array<double, 3> inverse_square{};  ///< mean of 1 / nm^2 for each channel

  Table() {
    std::array<Rgb, kCells> rgb;
    std::array<double, 3> mean{};
    for (std::size_t i = 0; i < kCells; ++i) {
      rgb[i] = color_matching(kFirst + (static_cast<float>(i) + 0.5F) * kStep);
      for (std::size_t c = 0; c < 3; ++c) {
        mean[c] += static_cast<double>(rgb[i][static_cast<int>(c)]) / kCells;
      }
    }
    double sum = 0;
    std::array<double, kCells> size{};
    for (std::size_t i = 0; i < kCells; ++i) {
      rgb[i] = {rgb[i].r / static_cast<float>(mean[0]), rgb[i].g / static_cast<float>(mean[1]),
                rgb[i].b / static_cast<float>(mean[2])};
      constexpr float kMost = 3.89F;  // upper bound over minus the lower bound
      const float least = std::min({rgb[i].r, rgb[i].g, rgb[i].b});
      size[i] = static_cast<double>(std::max(max_component(rgb[i]) / kMost, -least)) + 1e-3;
      sum += size[i];
      const auto nm = static_cast<double>(kFirst + (static_cast<float>(i) + 0.5F) * kStep);
      for (std::size_t c = 0; c < 3; ++c) {
        inverse_square[c] += static_cast<double>(rgb[i][static_cast<int>(c)]) / (nm * nm * kCells);
      }
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

const Table& table_of_colours() {
  static const Table kTable;
  return kTable;
}

/// inverse_square: 1 / wavelength^2 [1/nm^2].
float cauchy_ior(float n_d, float dispersion, float inverse_square) {
  const float abbe_inverse = dispersion / 20;
  return std::max(n_d + (n_d - 1) * abbe_inverse * (523655.0F * inverse_square - 1.5168F), 1.0F);
}

}  // namespace

WavelengthSample sample_wavelength(float u) noexcept {
  const Table& table = table_of_colours();
  const auto after = std::upper_bound(table.cdf.begin(), table.cdf.end(), u);
  const auto cell = std::min<std::size_t>(
      static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - table.cdf.begin() - 1, 0)),
      kCells - 1);
  const float width = table.cdf[cell + 1] - table.cdf[cell];
  const float within = width > 0 ? (u - table.cdf[cell]) / width : 0.5F;
  return {kFirst + (static_cast<float>(cell) + within) * kStep, table.weight[cell]};
}

float dispersive_ior(float n_d, float dispersion, float wavelength_nm) noexcept {
  return cauchy_ior(n_d, dispersion, 1 / (wavelength_nm * wavelength_nm));
}

Rgb mean_dispersive_ior(float n_d, float dispersion) noexcept {
  const auto at = [n_d, dispersion](double inverse_square) {
    return cauchy_ior(n_d, dispersion, static_cast<float>(inverse_square));
  };
  const auto& mean = table_of_colours().inverse_square;
  return {at(mean[0]), at(mean[1]), at(mean[2])};
}

}  // namespace core
