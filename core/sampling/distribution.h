/// Piecewise-constant densities over [0,1) and [0,1)^2.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/math/generic.h"

namespace core {

/// A read-only density over equal cells of [0,1), for one path or SIMD lanes (core/math/generic.h).
struct DistributionTable {
  const float* cdf = nullptr;           ///< size + 1 values from 0 to 1
  const std::int32_t* guide = nullptr;  ///< [i]: the cell that contains i / guide_size; null: none
  int size = 0;
  int guide_size = 0;

  /// Where the tables of lanes begin in the arrays, if each has its own.
  template <typename F>
  struct First {
    IntOf<F> cdf{0};
    IntOf<F> guide{0};
  };
  template <typename F>
  struct Sample {
    F x;
    F pdf_unit;  ///< density over [0,1)
    IntOf<F> cell;
  };
  template <typename F>
  Sample<F> sample(F u, First<F> first = {}) const noexcept;
  template <typename F>
  F pdf_unit(F x, First<F> first = {}) const noexcept {
    return prob_cell(first.cdf + cell_at(x)) * static_cast<float>(size);
  }
  template <typename I>
  auto prob_cell(I cell) const noexcept {
    return gather(cdf, cell + 1) - gather(cdf, cell);
  }
  /// Returns the last cell that begins at or before u.
  template <typename F>
  IntOf<F> cell_of(F u, First<F> first = {}) const noexcept;
  /// Returns the cell that contains x.
  template <typename F>
  IntOf<F> cell_at(F x) const noexcept {
    return within(truncated(max(x, F(0)) * static_cast<float>(size)), IntOf<F>(size));
  }
};

/// Density proportional to non-negative weights of equal cells of [0,1).
class Distribution1D {
 public:
  Distribution1D() = default;
  /// weights: finite and >= 0. If all are zero, the density is uniform.
  explicit Distribution1D(const std::vector<float>& weights);
  /// Lets sample() start near its cell instead of searching, one step away on average.
  void add_guide();

  auto sample(float u) const noexcept { return table().sample(u); }
  float pdf_unit(float x) const noexcept { return table().pdf_unit(x); }
  float prob_cell(std::size_t cell) const noexcept { return cdf_[cell + 1] - cdf_[cell]; }
  std::size_t size() const noexcept { return cdf_.empty() ? 0 : cdf_.size() - 1; }
  DistributionTable table() const noexcept {
    return {cdf_.data(), guide_.empty() ? nullptr : guide_.data(), static_cast<int>(size()),
            static_cast<int>(guide_.size())};
  }

 private:
  std::vector<float> cdf_;
  std::vector<std::int32_t> guide_;
};

/// Density over the unit square: samples a row by the row sums, then a cell in the row.
class Distribution2D {
 public:
  Distribution2D() = default;
  /// weights: width * height values, row by row, >= 0.
  Distribution2D(const std::vector<float>& weights, int width, int height);

  template <typename F>
  struct Sample {
    Vec2Of<F> uv;
    F pdf_unit;       ///< density over [0,1)^2
    IntOf<F> column;  ///< of the sampled cell
    IntOf<F> row;
  };
  template <typename U = Vec2>
  [[gnu::flatten]] auto sample(U u) const noexcept {
    using F = decltype(u.x);
    const auto y = marginal_.table().sample(u.y);
    const auto x = row(0).sample(u.x, first_of<F>(y.cell));
    return Sample<F>{{x.x, y.x}, y.pdf_unit * x.pdf_unit, x.cell, y.cell};
  }
  template <typename U = Vec2>
  auto pdf_unit(U uv) const noexcept {
    using F = decltype(uv.x);
    const DistributionTable marginal = marginal_.table();
    return marginal.pdf_unit(uv.y) * row(0).pdf_unit(uv.x, first_of<F>(marginal.cell_at(uv.y)));
  }
  std::size_t bytes() const noexcept;

  /// Rows are stored one after another; each cdf has size + 1 values, each guide has guide_size.
  DistributionTable row(std::size_t row) const noexcept {
    return {&cdfs_[row * (static_cast<std::size_t>(width_) + 1)],
            &guides_[row * static_cast<std::size_t>(guide_size_)], width_, guide_size_};
  }

 private:
  template <typename F>
  DistributionTable::First<F> first_of(IntOf<F> row) const noexcept {
    return {row * (width_ + 1), row * guide_size_};
  }

  int width_ = 0;
  int guide_size_ = 0;
  std::vector<float> cdfs_;
  std::vector<std::int32_t> guides_;
  Distribution1D marginal_;
};

template <typename F>
auto DistributionTable::sample(F u, First<F> first) const noexcept -> Sample<F> {
  const IntOf<F> cell = cell_of(u, first);
  const F width = prob_cell(first.cdf + cell);
  const F inside = select(width > 0, (u - gather(cdf, first.cdf + cell)) / width, F(0.5F));
  const F n(static_cast<float>(size));
  F x = min((to_floats(cell) + inside) / n, F(kOneMinusEpsilon));
  // Rounded up into the next cell.
  for (MaskOf<F> over = cell < truncated(x * n); any(over); over = cell < truncated(x * n)) {
    x = select(over, floats_of(bits_of(x) - 1), x);
  }
  return {x, width * n, cell};
}

template <typename F>
IntOf<F> DistributionTable::cell_of(F u, First<F> first) const noexcept {
  using I = IntOf<F>;
  const I last(size - 1);
  I cell(0);
  I most = last;
  if (guide != nullptr) {
    const I last_guide(guide_size - 1);
    const I start = truncated(u * static_cast<float>(guide_size));
    const MaskOf<F> has_next = start < last_guide;
    cell = gather(guide, first.guide + select(has_next, start, last_guide));
    most = select(has_next, gather(guide, first.guide + select(has_next, start + 1, last_guide)),
                  last);
  }
  const auto begins_by = [&](I i) { return gather(cdf, first.cdf + i) <= u; };
  for (MaskOf<F> open = cell < most; any(open); open = cell < most) {
    const I middle = (cell + most + 1) >> 1;
    const MaskOf<F> is_before = begins_by(middle);
    cell = select(open & is_before, middle, cell);
    most = select(open & opposite(is_before), middle - 1, most);
  }
  const auto step = [&](MaskOf<F> wrong, int by) {  // i was rounded
    cell = select(wrong, cell + by, cell);
    return any(wrong);
  };
  while (step((I(0) < cell) & opposite(begins_by(cell)), -1)) {
  }
  while (step((cell < last) & begins_by(cell + 1), 1)) {
  }
  return cell;
}

}  // namespace core
