#include "core/sampling/distribution.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/math/numbers.h"

namespace core {

Distribution1D::Distribution1D(const std::vector<float>& weights) {
  const std::size_t n = weights.size();
  std::vector<double> sums(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    sums[i + 1] = sums[i] + static_cast<double>(weights[i]);
  }
  total_ = sums[n];
  cdf_.resize(n + 1);
  for (std::size_t i = 0; i <= n; ++i) {
    cdf_[i] = static_cast<float>(total_ > 0 ? sums[i] / total_
                                            : static_cast<double>(i) / static_cast<double>(n));
  }
  cdf_[n] = 1;
}

void Distribution1D::add_guide() {
  std::vector<std::uint32_t> cells(size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    cells[i] = static_cast<std::uint32_t>(
        cell_of(static_cast<float>(i) / static_cast<float>(cells.size())));
  }
  guide_ = std::move(cells);
}

/// The last cell that begins at u or before.
std::size_t Distribution1D::cell_of(float u) const noexcept {
  if (guide_.empty()) {
    const auto after = std::upper_bound(cdf_.begin(), cdf_.end(), u);
    const auto cell =
        static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - cdf_.begin() - 1, 0));
    return std::min(cell, size() - 1);
  }
  const std::size_t last = size() - 1;
  std::size_t cell =
      guide_[std::min(static_cast<std::size_t>(u * static_cast<float>(size())), last)];
  while (cell > 0 && cdf_[cell] > u) {  // i was rounded up
    --cell;
  }
  while (cell < last && cdf_[cell + 1] <= u) {
    ++cell;
  }
  return cell;
}

Distribution1D::Sample Distribution1D::sample(float u) const noexcept {
  const std::size_t cell = cell_of(u);
  const float width = cdf_[cell + 1] - cdf_[cell];
  const float within = width > 0 ? (u - cdf_[cell]) / width : 0.5F;
  const auto n = static_cast<float>(size());
  float x = std::min((static_cast<float>(cell) + within) / n, kOneMinusEpsilon);
  while (static_cast<std::size_t>(x * n) > cell) {  // rounded up into the next cell
    x = std::nextafter(x, 0.0F);
  }
  return {x, width * n, cell};
}

float Distribution1D::pdf_unit(float x) const noexcept {
  const auto n = static_cast<float>(size());
  const std::size_t cell = std::min(static_cast<std::size_t>(std::max(x, 0.0F) * n), size() - 1);
  return prob_cell(cell) * n;
}

float Distribution1D::prob_cell(std::size_t cell) const noexcept {
  return cdf_[cell + 1] - cdf_[cell];
}

Distribution2D::Distribution2D(const std::vector<float>& weights, int width, int height) {
  const auto w = static_cast<std::size_t>(width);
  std::vector<float> sums;
  for (std::size_t y = 0; y < static_cast<std::size_t>(height); ++y) {
    const auto begin = weights.begin() + static_cast<std::ptrdiff_t>(y * w);
    rows_.emplace_back(std::vector<float>(begin, begin + width));
    rows_.back().add_guide();
    sums.push_back(static_cast<float>(rows_.back().total()));
  }
  marginal_ = Distribution1D(sums);
  marginal_.add_guide();
}

Distribution2D::Sample Distribution2D::sample(Vec2 u) const noexcept {
  const auto row = marginal_.sample(u.y);
  const auto column = rows_[row.cell].sample(u.x);
  return {{column.x, row.x}, row.pdf_unit * column.pdf_unit, column.cell, row.cell};
}

float Distribution2D::pdf_unit(Vec2 uv) const noexcept {
  const auto n = static_cast<float>(rows_.size());
  const std::size_t row =
      std::min(static_cast<std::size_t>(std::max(uv.y, 0.0F) * n), rows_.size() - 1);
  return marginal_.prob_cell(row) * n * rows_[row].pdf_unit(uv.x);
}

std::size_t Distribution2D::bytes() const noexcept {
  constexpr std::size_t kCell = sizeof(float) + sizeof(std::uint32_t);  // and of the guide
  return rows_.empty() ? 0 : (rows_.size() + 1) * (rows_[0].size() + 1) * kCell;
}

}  // namespace core
