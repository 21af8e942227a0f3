#include "core/sampling/distribution.h"

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

void append_guide(DistributionTable table, int size, std::vector<std::int32_t>& guide) {
  for (int i = 0; i < size; ++i) {
    guide.push_back(table.cell_of(static_cast<float>(i) / static_cast<float>(size)));
  }
}

/// Cells for each value of the guides of an image. They are read at random, so they should fit in a
/// cache: those of a map of 1024 x 512 take 256 kB, not 2 MB. The cells between two values share
/// one or two of its lines, which the search reads.
constexpr int kCellsForGuide = 8;

}  // namespace

Distribution1D::Distribution1D(const std::vector<float>& weights) {
  cdf_.reserve(weights.size() + 1);
  append_cdf(weights.data(), weights.size(), cdf_);
}

void Distribution1D::add_guide() {
  std::vector<std::int32_t> guide;
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

std::size_t Distribution2D::bytes() const noexcept {
  return cdfs_.size() * sizeof(float) + guides_.size() * sizeof(std::int32_t);
}

}  // namespace core
