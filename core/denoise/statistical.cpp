#include "core/denoise/statistical.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <memory>
#include <utility>

#include "core/base/check.h"
#include "core/denoise/feature_guides.h"
#include "core/film/half_sums.h"
#include "core/film/summed_area.h"

namespace core {
namespace {

/// Radius of the neighbourhood (the standard deviation of the weights in Sakai 2024), and radius of
/// the patches compared.
constexpr int kRadius = 10;
constexpr int kPatch = 2;
/// If two patches differ only by noise, the squared differences divided by their variance have mean
/// 1 and, over the 25 pixels of a patch, a standard deviation of sqrt(2 / 25) = 0.28. The weight is
/// 1 up to the mean, decreases above it, and is 0 from 1 + kTolerance on.
constexpr float kTolerance = 0.5F;
/// Maximum contribution of one pixel of a patch, so that a rare event that the sample variance
/// missed does not separate all of its neighbours: the 0.9999 quantile of chi^2_1.
constexpr float kMostDifference = 15;
/// A pixel with more than this fraction of the variance of its neighbourhood gets less weight, as
/// if it had this fraction: otherwise a rare event would become a disc. The lost light is part of
/// the measured bias.
constexpr double kMostShare = 0.02;
/// Variance added to every pixel, as a fraction of the floor of the error: differences of a tenth
/// of the floor's square root are invisible.
constexpr double kInvisible = 0.01;

constexpr int kTileWidth = 128;
constexpr int kTileHeight = 64;
constexpr int kMargin = kRadius + kPatch;
constexpr int kStride = kTileWidth + 2 * kMargin;
constexpr std::size_t kArea =
    static_cast<std::size_t>(kStride) * static_cast<std::size_t>(kTileHeight + 2 * kMargin);

struct Range {
  int first = 0;
  int last = 0;  ///< half-open
};
struct Area {
  Range x;
  Range y;
};

/// Light without visible emission and divided by the colour of the surfaces, if there are features:
/// edges of emitters are not noise.
struct Light {
  ColorPlanes mean;
  Plane variance;
  Plane trust;  ///< weight of a pixel in the means of others, 0 to 1
};

Plane trust_in(const Plane& variance, int width, int height) {
  SummedArea sums(width, height);
  std::size_t i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      sums.set(x, y, static_cast<double>(variance[i]));
    }
  }
  Plane out(variance.size());
  i = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x, ++i) {
      const double all = sums.sum(window_around(x, y, kRadius, width, height));
      out[i] =
          static_cast<float>(std::min(kMostShare * all / static_cast<double>(variance[i]), 1.0));
    }
  }
  return out;
}

/// features: null, or with `colors` of their surfaces.
Light light_of(const HalfPicture& half, const FeaturePicture* features, const ColorPlanes& colors) {
  Light out = {half.mean, half.variance, {}};
  double sum = 0;
  for (std::size_t i = 0; i < out.variance.size(); ++i) {
    std::array<float, 3> light = {out.mean[0][i], out.mean[1][i], out.mean[2][i]};
    if (features != nullptr) {
      float squares = 0;
      for (std::size_t c = 0; c < 3; ++c) {
        const float color = colors[c][i];
        light[c] /= color;
        out.mean[c][i] = (out.mean[c][i] - features->emission[c][i]) / color;
        squares += 1 / (color * color);
      }
      out.variance[i] *= squares / 3;
    }
    sum += static_cast<double>(luminance({light[0], light[1], light[2]}));
  }
  const double mean = sum / static_cast<double>(std::max<std::size_t>(out.variance.size(), 1));
  const double dark = error_floor(std::sqrt(std::max(mean, 0.0)));
  const auto floor = static_cast<float>(3 * kInvisible * dark * dark);
  for (float& v : out.variance) {
    v += std::max(floor, 1e-20F);
  }
  out.trust = trust_in(out.variance, half.width, half.height);
  return out;
}

/// Part of a plane around a tile, kStride values per row.
using Local = std::array<float, kArea>;

struct LocalHalf {
  std::array<Local, 3> mean;
  std::array<Local, 3> trusted;  ///< mean times trust
  Local trust;
  Local variance;
  Local difference;
  Local rows;  ///< differences summed over a patch's rows
  std::array<Local, 3> sum;
  Local weights;
};

struct Buffers {
  std::array<LocalHalf, 2> halves;
  std::array<Local, 7> scaled;
  Local guide_variance;
  Local depth;
  Local depth_tolerance;
  Local depth_slope;
  Local agreement;  ///< agreement of the features, 0 to 1
  Local count;      ///< 1 where the agreement is above 0
  Local count_rows;
  Local weight;
};

/// Filters one tile of up to two halves.
class TileFilter {
 public:
  TileFilter(PixelRect tile, int width, int height)
      : tile_(tile),
        left_(tile.x - kMargin),
        top_(tile.y - kMargin),
        width_(width),
        height_(height) {}

  void load(const Plane& from, Local& to) const {
    const int x0 = std::max(left_, 0);
    const int x1 = std::min(left_ + kStride, width_);
    const int y0 = std::max(top_, 0);
    const int y1 = std::min(top_ + kTileHeight + 2 * kMargin, height_);
    for (int y = y0; y < y1; ++y) {
      const auto row = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_);
      std::copy(from.begin() + static_cast<std::ptrdiff_t>(row) + x0,
                from.begin() + static_cast<std::ptrdiff_t>(row) + x1, &to[index(x0, y)]);
    }
  }

  void run(Buffers& b, std::size_t halves, bool has_guides) const {
    for (std::size_t h = 0; h < halves; ++h) {
      LocalHalf& half = b.halves[h];
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t i = 0; i < kArea; ++i) {
          half.trusted[c][i] = half.mean[c][i] * half.trust[i];
        }
      }
      half.sum = half.trusted;
      half.weights = half.trust;
    }
    for (int dy = 0; dy <= kRadius; ++dy) {
      for (int dx = dy == 0 ? 1 : -kRadius; dx <= kRadius; ++dx) {
        if (dx * dx + dy * dy <= kRadius * kRadius) {
          add(b, halves, has_guides, dx, dy);
        }
      }
    }
  }

  /// Stores sum / weights of the tile in the image.
  void store(const LocalHalf& half, ColorPlanes& out) const {
    for (int y = tile_.y; y < tile_.y + tile_.height; ++y) {
      for (int x = tile_.x; x < tile_.x + tile_.width; ++x) {
        const std::size_t from = index(x, y);
        const std::size_t to = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) +
                               static_cast<std::size_t>(x);
        for (std::size_t c = 0; c < 3; ++c) {
          out[c][to] = half.sum[c][from] / half.weights[from];
        }
      }
    }
  }

 private:
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y - top_) * static_cast<std::size_t>(kStride) +
           static_cast<std::size_t>(x - left_);
  }

  /// Returns the pixels p of the pairs (p, p + o): with margin 0 those whose weights the tile
  /// needs, with kPatch those that the patches around them need.
  Area pairs(int dx, int dy, int margin) const {
    Area a;
    a.x.first = std::max({tile_.x - std::max(dx, 0) - margin, 0, -dx});
    a.x.last = std::min({tile_.x + tile_.width + std::max(-dx, 0) + margin, width_, width_ - dx});
    a.y.first = std::max(tile_.y - dy - margin, 0);
    a.y.last = std::min(tile_.y + tile_.height + margin, height_ - dy);
    return a;
  }

  void add(Buffers& b, std::size_t halves, bool has_guides, int dx, int dy) const {
    const Area wanted = pairs(dx, dy, 0);
    const Area needed = pairs(dx, dy, kPatch);
    if (wanted.x.first >= wanted.x.last || wanted.y.first >= wanted.y.last) {
      return;
    }
    const std::ptrdiff_t o = static_cast<std::ptrdiff_t>(dy) * kStride + dx;
    compare_features(b, has_guides, needed, o, static_cast<float>(dx * dx + dy * dy));
    clear_around(b.count, needed);
    sum_patches(b.count, b.count_rows, wanted);
    for (std::size_t h = 0; h < halves; ++h) {
      LocalHalf& half = b.halves[h];
      compare_light(half, b.agreement, needed, o);
      clear_around(half.difference, needed);
      sum_patches(half.difference, half.rows, wanted);
      weigh(b, half, wanted);
      accumulate(b.weight, half, wanted, dx, dy);
    }
  }

  void compare_features(Buffers& b, bool has_guides, const Area& area, std::ptrdiff_t o,
                        float distance2) const {
    for (int y = area.y.first; y < area.y.last; ++y) {
      const std::size_t first = index(area.x.first, y);
      const auto n = static_cast<std::size_t>(area.x.last - area.x.first);
      float* __restrict agreement = &b.agreement[first];
      float* __restrict count = &b.count[first];
      if (!has_guides) {
        std::fill_n(agreement, n, 1.0F);
        std::fill_n(count, n, 1.0F);
        continue;
      }
      const float* v = &b.guide_variance[first];
      const float* z = &b.depth[first];
      const float* tolerance = &b.depth_tolerance[first];
      const float* slope = &b.depth_slope[first];
      std::array<const float*, 7> s{};
      for (std::size_t k = 0; k < s.size(); ++k) {
        s[k] = &b.scaled[k][first];
      }
      for (std::size_t i = 0; i < n; ++i) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        float squares = 0;
        for (std::size_t k = 0; k < 7; ++k) {
          const float d = s[k][at] - s[k][at + o];
          squares += d * d;
        }
        const float dz = z[at] - z[at + o];
        const float of_depth = tolerance[at] + tolerance[at + o] +
                               distance2 * std::max(slope[at], slope[at + o]) + 1e-20F;
        const float apart = squares / (1 + v[at] + v[at + o]) + dz * dz / of_depth;
        const float near = std::max(1 - apart * (1 / kMostDeviations2), 0.0F);
        agreement[i] = near * near;
        count[i] = near > 0 ? 1.0F : 0.0F;
      }
    }
  }

  void compare_light(LocalHalf& half, const Local& agreements, const Area& area,
                     std::ptrdiff_t o) const {
    for (int y = area.y.first; y < area.y.last; ++y) {
      const std::size_t first = index(area.x.first, y);
      const auto n = static_cast<std::size_t>(area.x.last - area.x.first);
      float* __restrict difference = &half.difference[first];
      const float* agreement = &agreements[first];
      const float* r = &half.mean[0][first];
      const float* g = &half.mean[1][first];
      const float* blue = &half.mean[2][first];
      const float* v = &half.variance[first];
      for (std::size_t i = 0; i < n; ++i) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        const float dr = r[at] - r[at + o];
        const float dg = g[at] - g[at + o];
        const float db = blue[at] - blue[at + o];
        const float d = (dr * dr + dg * dg + db * db) / (v[at] + v[at + o]);
        difference[i] = agreement[at] > 0 ? std::min(d, kMostDifference) : 0;
      }
    }
  }

  /// Sets a border of the width of a patch around `area` to 0, because nothing is known there.
  void clear_around(Local& plane, const Area& area) const {
    const auto n = static_cast<std::size_t>(area.x.last - area.x.first + 2 * kPatch);
    for (int y = area.y.first - kPatch; y < area.y.last + kPatch; ++y) {
      if (y < top_ || y >= top_ + kTileHeight + 2 * kMargin) {
        continue;
      }
      if (y < area.y.first || y >= area.y.last) {
        for (std::size_t i = 0; i < n; ++i) {
          set_if_inside(plane, area.x.first - kPatch + static_cast<int>(i), y);
        }
        continue;
      }
      for (int i = 1; i <= kPatch; ++i) {
        set_if_inside(plane, area.x.first - i, y);
        set_if_inside(plane, area.x.last - 1 + i, y);
      }
    }
  }
  void set_if_inside(Local& plane, int x, int y) const {
    if (x >= left_ && x < left_ + kStride) {
      plane[index(x, y)] = 0;
    }
  }

  /// Replaces the values in `area` by their sums over patches.
  void sum_patches(Local& plane, Local& rows, const Area& area) const {
    for (int y = area.y.first; y < area.y.last; ++y) {
      const std::size_t first = index(area.x.first - kPatch, y);
      const auto n = static_cast<std::size_t>(area.x.last - area.x.first + 2 * kPatch);
      const float* in = &plane[first];
      float* __restrict out = &rows[first];
      for (std::size_t i = 0; i < n; ++i) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        out[i] = in[at - 2 * kStride] + in[at - kStride] + in[at] + in[at + kStride] +
                 in[at + 2 * kStride];
      }
    }
    for (int y = area.y.first; y < area.y.last; ++y) {
      const std::size_t first = index(area.x.first, y);
      const auto n = static_cast<std::size_t>(area.x.last - area.x.first);
      const float* in = &rows[first];
      float* __restrict out = &plane[first];
      for (std::size_t i = 0; i < n; ++i) {
        const auto at = static_cast<std::ptrdiff_t>(i);
        out[i] = in[at - 2] + in[at - 1] + in[at] + in[at + 1] + in[at + 2];
      }
    }
  }
  static_assert(kPatch == 2, "sum_patches() is written out");

  void weigh(Buffers& b, const LocalHalf& half, const Area& area) const {
    for (int y = area.y.first; y < area.y.last; ++y) {
      const std::size_t first = index(area.x.first, y);
      const auto n = static_cast<std::size_t>(area.x.last - area.x.first);
      const float* difference = &half.difference[first];
      const float* count = &b.count[first];
      const float* agreement = &b.agreement[first];
      float* __restrict weight = &b.weight[first];
      for (std::size_t i = 0; i < n; ++i) {
        // The count around a pair without agreement may be 0; its weight is 0 anyway.
        const float mean = difference[i] / std::max(count[i], 1.0F);
        const float excess = std::max(mean - 1, 0.0F) * (1 / kTolerance);
        const float like = std::max(1 - excess, 0.0F);
        weight[i] = agreement[i] * like * like;
      }
    }
  }

  /// Adds each pixel of a pair to the other's mean.
  void accumulate(const Local& weight, LocalHalf& half, const Area& area, int dx, int dy) const {
    const std::ptrdiff_t o = static_cast<std::ptrdiff_t>(dy) * kStride + dx;
    // Adds p + o to p in the tile.
    Area own = area;
    own.x = {std::max(area.x.first, tile_.x), std::min(area.x.last, tile_.x + tile_.width)};
    own.y = {std::max(area.y.first, tile_.y), std::min(area.y.last, tile_.y + tile_.height)};
    take(weight, half, own, o, 0);
    // Adds p to q = p + o in the tile.
    Area other;
    other.x = {std::max(area.x.first + dx, tile_.x),
               std::min(area.x.last + dx, tile_.x + tile_.width)};
    other.y = {std::max(area.y.first + dy, tile_.y),
               std::min(area.y.last + dy, tile_.y + tile_.height)};
    take(weight, half, other, -o, -o);
  }

  /// Adds to the pixels of `area` those at offset `from`, with the weights at offset `weight_at`.
  void take(const Local& weight, LocalHalf& half, const Area& area, std::ptrdiff_t from,
            std::ptrdiff_t weight_at) const {
    for (int y = area.y.first; y < area.y.last; ++y) {
      if (area.x.first >= area.x.last) {
        return;
      }
      const std::size_t first = index(area.x.first, y);
      const auto n = static_cast<std::size_t>(area.x.last - area.x.first);
      const float* w = weight.data() + static_cast<std::ptrdiff_t>(first) + weight_at;
      for (std::size_t c = 0; c < 3; ++c) {
        const float* in = half.trusted[c].data() + static_cast<std::ptrdiff_t>(first) + from;
        float* __restrict sum = &half.sum[c][first];
        for (std::size_t i = 0; i < n; ++i) {
          sum[i] += w[i] * in[i];
        }
      }
      const float* trust = half.trust.data() + static_cast<std::ptrdiff_t>(first) + from;
      float* __restrict weights = &half.weights[first];
      for (std::size_t i = 0; i < n; ++i) {
        weights[i] += w[i] * trust[i];
      }
    }
  }

  PixelRect tile_;
  int left_;
  int top_;
  int width_;
  int height_;
};

}  // namespace

Result<FilteredHalves> StatisticalDenoiser::denoise(std::span<const HalfPicture> halves,
                                                    const FeaturePicture* features,
                                                    const ParallelFor& parallel) const {
  CHECK(halves.size() == 1 || halves.size() == 2);
  const int width = halves[0].width;
  const int height = halves[0].height;
  ColorPlanes colors;
  if (features != nullptr) {
    colors = surface_colors(*features);
  }
  std::vector<Light> light;
  for (const HalfPicture& half : halves) {
    light.push_back(light_of(half, features, colors));
  }
  const FeatureGuides guide = features != nullptr ? make_guides(*features) : FeatureGuides{};
  std::vector<ColorPlanes> out(halves.size());
  for (std::size_t h = 0; h < halves.size(); ++h) {
    out[h].fill(Plane(light[h].variance.size()));
  }
  const int columns = (width + kTileWidth - 1) / kTileWidth;
  const int rows = (height + kTileHeight - 1) / kTileHeight;
  parallel(columns * rows, [&](int t) {
    const int x = t % columns * kTileWidth;
    const int y = t / columns * kTileHeight;
    const TileFilter filter(
        {x, y, std::min(kTileWidth, width - x), std::min(kTileHeight, height - y)}, width, height);
    const auto b = std::make_unique<Buffers>();
    for (std::size_t h = 0; h < halves.size(); ++h) {
      for (std::size_t c = 0; c < 3; ++c) {
        filter.load(light[h].mean[c], b->halves[h].mean[c]);
      }
      filter.load(light[h].variance, b->halves[h].variance);
      filter.load(light[h].trust, b->halves[h].trust);
    }
    if (features != nullptr) {
      for (std::size_t k = 0; k < guide.scaled.size(); ++k) {
        filter.load(guide.scaled[k], b->scaled[k]);
      }
      filter.load(guide.variance, b->guide_variance);
      filter.load(guide.depth, b->depth);
      filter.load(guide.depth_tolerance, b->depth_tolerance);
      filter.load(guide.depth_slope, b->depth_slope);
    }
    filter.run(*b, halves.size(), features != nullptr);
    for (std::size_t h = 0; h < halves.size(); ++h) {
      filter.store(b->halves[h], out[h]);
    }
  });
  for (std::size_t h = 0; features != nullptr && h < halves.size(); ++h) {
    for (std::size_t c = 0; c < 3; ++c) {
      for (std::size_t i = 0; i < out[h][c].size(); ++i) {
        out[h][c][i] = out[h][c][i] * colors[c][i] + features->emission[c][i];
      }
    }
  }
  return FilteredHalves{std::move(out), {"statistical", "2", {}, {}}};
}

}  // namespace core
