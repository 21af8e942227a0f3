/// Piecewise-constant densities over [0,1) and [0,1)^2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math/vec.h"

namespace core {

/// Density proportional to non-negative weights over equal cells of [0,1).
class Distribution1D {
 public:
  Distribution1D() = default;
  /// weights: finite, >= 0. All zero: uniform.
  explicit Distribution1D(const std::vector<float>& weights);
  /// sample() then starts near its cell instead of searching for it, one step away on average.
  void add_guide();

  struct Sample {
    float x = 0;
    float pdf_unit = 0;  ///< density over [0,1)
    std::size_t cell = 0;
  };
  Sample sample(float u) const noexcept;
  float pdf_unit(float x) const noexcept;
  float prob_cell(std::size_t cell) const noexcept;
  std::size_t size() const noexcept { return cdf_.empty() ? 0 : cdf_.size() - 1; }
  /// Sum of the weights.
  double total() const noexcept { return total_; }

  /// What sample() reads, for those who draw many at once; with a guide.
  struct Table {
    const float* cdf;
    const std::uint32_t* guide;
    int size;
  };
  Table table() const noexcept { return {cdf_.data(), guide_.data(), static_cast<int>(size())}; }

 private:
  std::size_t cell_of(float u) const noexcept;

  std::vector<float> cdf_;            ///< size + 1 values from 0 to 1
  std::vector<std::uint32_t> guide_;  ///< [i]: the cell of i / size; empty without
  double total_ = 0;
};

/// Density over the unit square: rows by their sums, then within the row.
class Distribution2D {
 public:
  Distribution2D() = default;
  /// weights: width * height values, row by row, >= 0.
  Distribution2D(const std::vector<float>& weights, int width, int height);

  struct Sample {
    Vec2 uv;
    float pdf_unit = 0;      ///< density over [0,1)^2
    std::size_t column = 0;  ///< of the cell that was drawn
    std::size_t row = 0;
  };
  Sample sample(Vec2 u) const noexcept;
  float pdf_unit(Vec2 uv) const noexcept;
  std::size_t bytes() const noexcept;

 private:
  std::vector<Distribution1D> rows_;
  Distribution1D marginal_;
};

}  // namespace core
