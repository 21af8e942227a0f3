#include "core/sampling/distribution.h"

#include <algorithm>
#include <cmath>

#include "core/math/numbers.h"

namespace core {
namespace {

/// Appends the n + 1 values of the weights' cdf and returns the sum of weights.
double append_cdf(const float* weights, std::size_t n, std::vector<float>& cdf) {
  std::vector<double> sums(n + 1, 0.0);
  for (std::size_t i = 0; i < n; ++i) {
    sums[i + 1] = sums[i] + static_cast<double>(weights[i]);
  }
  const double total = sums[n];
  for (std::size_t i = 0; i < n; ++i) {
    cdf.push_back(static_cast<float>(total > 0 ? sums[i] / total
                                               : static_cast<double>(i) / static_cast<double>(n)));
  }
  cdf.push_back(1);
  return total;
}

void append_guide(DistributionTable table, int size, std::vector<std::uint32_t>& guide) {
  for (int i = 0; i < size; ++i) {
    guide.push_back(static_cast<std::uint32_t>(
        table.cell_of(static_cast<float>(i) / static_cast<float>(size))));
  }
}

/// Cells for each value of the guides of an image. They are read at random, so they should fit in a
/// cache: those of a map of 1024 x 512 take 256 kB, not 2 MB. The cells between two values share
/// one or two of its lines, which the search reads.
constexpr int kCellsForGuide = 8;

}  // namespace

std::size_t DistributionTable::cell_of(float u) const noexcept {
  const auto last = static_cast<std::size_t>(size) - 1;
  if (guide == nullptr) {
    const float* after = std::upper_bound(cdf, cdf + size + 1, u);
    return std::min(static_cast<std::size_t>(std::max<std::ptrdiff_t>(after - cdf - 1, 0)), last);
  }
  const auto guides = static_cast<std::size_t>(guide_size);
  const auto start = static_cast<std::size_t>(u * static_cast<float>(guide_size));
  const std::size_t least = guide[std::min(start, guides - 1)];
  const std::size_t most = start + 1 < guides ? guide[start + 1] : last;
  std::size_t cell =
      static_cast<std::size_t>(std::upper_bound(cdf + least + 1, cdf + most + 1, u) - cdf) - 1;
  while (cell > 0 && cdf[cell] > u) {  // i was rounded
    --cell;
  }
  while (cell < last && cdf[cell + 1] <= u) {
    ++cell;
  }
  return cell;
}

DistributionTable::Sample DistributionTable::sample(float u) const noexcept {
  const std::size_t cell = cell_of(u);
  const float width = prob_cell(cell);
  const float within = width > 0 ? (u - cdf[cell]) / width : 0.5F;
  const auto n = static_cast<float>(size);
  float x = std::min((static_cast<float>(cell) + within) / n, kOneMinusEpsilon);
  while (static_cast<std::size_t>(x * n) > cell) {  // rounded up into the next cell
    x = std::nextafter(x, 0.0F);
  }
  return {x, width * n, cell};
}

float DistributionTable::pdf_unit(float x) const noexcept {
  const auto n = static_cast<float>(size);
  const auto last = static_cast<std::size_t>(size) - 1;
  return prob_cell(std::min(static_cast<std::size_t>(std::max(x, 0.0F) * n), last)) * n;
}

Distribution1D::Distribution1D(const std::vector<float>& weights) {
  cdf_.reserve(weights.size() + 1);
  append_cdf(weights.data(), weights.size(), cdf_);
}

void Distribution1D::add_guide() {
  std::vector<std::uint32_t> guide;
  append_guide(table(), static_cast<int>(size()), guide);
  guide_.swap(guide);
}

Distribution2D::Distribution2D(const std::vector<float>& weights, int width, int height)
    : width_(width), guide_size_((width + kCellsForGuide - 1) / kCellsForGuide) {
  const auto w = static_cast<std::size_t>(width);
  const auto h = static_cast<std::size_t>(height);
  cdfs_.reserve(h * (w + 1));
  guides_.reserve(h * static_cast<std::size_t>(guide_size_));
  std::vector<float> sums;
  for (std::size_t y = 0; y < h; ++y) {
    sums.push_back(static_cast<float>(append_cdf(&weights[y * w], w, cdfs_)));
    append_guide({&cdfs_[y * (w + 1)], nullptr, width}, guide_size_, guides_);
  }
  marginal_ = Distribution1D(sums);
  marginal_.add_guide();
}

Distribution2D::Sample Distribution2D::sample(Vec2 u) const noexcept {
  const auto y = marginal_.sample(u.y);
  const auto x = row(y.cell).sample(u.x);
  return {{x.x, y.x}, y.pdf_unit * x.pdf_unit, x.cell, y.cell};
}

float Distribution2D::pdf_unit(Vec2 uv) const noexcept {
  const auto n = static_cast<float>(marginal_.size());
  const std::size_t y =
      std::min(static_cast<std::size_t>(std::max(uv.y, 0.0F) * n), marginal_.size() - 1);
  return marginal_.prob_cell(y) * n * row(y).pdf_unit(uv.x);
}

std::size_t Distribution2D::bytes() const noexcept {
  return cdfs_.size() * sizeof(float) + guides_.size() * sizeof(std::uint32_t);
}

}  // namespace core
