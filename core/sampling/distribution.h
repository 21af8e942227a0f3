/// Piecewise-constant densities over [0,1) and [0,1)^2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math/vec.h"

namespace core {

/// A read-only density over equal cells of [0,1).
struct DistributionTable {
  const float* cdf = nullptr;            ///< size + 1 values from 0 to 1
  const std::uint32_t* guide = nullptr;  ///< [i]: the cell that contains i / guide_size; null: none
  int size = 0;
  int guide_size = 0;

  struct Sample {
    float x = 0;
    float pdf_unit = 0;  ///< density over [0,1)
    std::size_t cell = 0;
  };
  Sample sample(float u) const noexcept;
  float pdf_unit(float x) const noexcept;
  float prob_cell(std::size_t cell) const noexcept { return cdf[cell + 1] - cdf[cell]; }
  /// Returns the last cell that begins at or before u.
  std::size_t cell_of(float u) const noexcept;
};

/// Density proportional to non-negative weights of equal cells of [0,1).
class Distribution1D {
 public:
  using Sample = DistributionTable::Sample;
  Distribution1D() = default;
  /// weights: finite and >= 0. If all are zero, the density is uniform.
  explicit Distribution1D(const std::vector<float>& weights);
  /// Lets sample() start near its cell instead of searching, one step away on average.
  void add_guide();

  Sample sample(float u) const noexcept { return table().sample(u); }
  float pdf_unit(float x) const noexcept { return table().pdf_unit(x); }
  float prob_cell(std::size_t cell) const noexcept { return cdf_[cell + 1] - cdf_[cell]; }
  std::size_t size() const noexcept { return cdf_.empty() ? 0 : cdf_.size() - 1; }
  DistributionTable table() const noexcept {
    return {cdf_.data(), guide_.empty() ? nullptr : guide_.data(), static_cast<int>(size()),
            static_cast<int>(guide_.size())};
  }

 private:
  std::vector<float> cdf_;
  std::vector<std::uint32_t> guide_;
};

/// Density over the unit square: samples a row by the row sums, then a cell in the row.
class Distribution2D {
 public:
  Distribution2D() = default;
  /// weights: width * height values, row by row, >= 0.
  Distribution2D(const std::vector<float>& weights, int width, int height);

  struct Sample {
    Vec2 uv;
    float pdf_unit = 0;      ///< density over [0,1)^2
    std::size_t column = 0;  ///< of the sampled cell
    std::size_t row = 0;
  };
  Sample sample(Vec2 u) const noexcept;
  float pdf_unit(Vec2 uv) const noexcept;
  std::size_t bytes() const noexcept;

  DistributionTable marginal() const noexcept { return marginal_.table(); }
  /// Rows are stored one after another; each cdf has size + 1 values, each guide has guide_size.
  DistributionTable row(std::size_t row) const noexcept {
    return {&cdfs_[row * (static_cast<std::size_t>(width_) + 1)],
            &guides_[row * static_cast<std::size_t>(guide_size_)], width_, guide_size_};
  }

 private:
  int width_ = 0;
  int guide_size_ = 0;
  std::vector<float> cdfs_;
  std::vector<std::uint32_t> guides_;
  Distribution1D marginal_;
};

}  // namespace core
