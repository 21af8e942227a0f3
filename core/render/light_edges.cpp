#include "core/render/light_edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

namespace core {
namespace {

/// Places that are looked at, of the whole film and of the rims alone, and those along a side of a pixel.
constexpr std::size_t kPlaces = std::size_t{1} << 21U;
constexpr int kFineSideMin = 4;
constexpr int kFineSideMax = 24;
constexpr std::size_t kAlways = 4096;
constexpr std::size_t kShare = 32;
constexpr float kDark = 0.01F;  ///< as in the error of a picture: Var / (mu^2 + 0.01)
/// Relative variance of one sample above which a pixel is at a rim: a thousandth is below all other noise.
constexpr float kContrast = 1e-3F;

/// The pixels that the filter of a pixel reaches, and their indices.
class Reach {
 public:
  Reach(const PixelRect& crop, const FilterSampler& filter)
      : crop_(crop), margin_(static_cast<int>(std::ceil(filter.radius_px() - 0.5F))) {}

  int margin() const noexcept { return margin_; }
  PixelRect cells() const noexcept {
    return {crop_.x - margin_, crop_.y - margin_, crop_.width + 2 * margin_, crop_.height + 2 * margin_};
  }
  std::size_t cell_count() const noexcept {
    return static_cast<std::size_t>(cells().width) * static_cast<std::size_t>(cells().height);
  }
  std::size_t cell(int x, int y) const noexcept {
    return static_cast<std::size_t>(y - cells().y) * static_cast<std::size_t>(cells().width) +
           static_cast<std::size_t>(x - cells().x);
  }
  /// f(x, y) for the pixels at most `radius` away that are inside `within`.
  template <class F>
  static void around(int x, int y, int radius, const PixelRect& within, const F& f) {
    const int y1 = std::min(y + radius, within.y + within.height - 1);
    const int x1 = std::min(x + radius, within.x + within.width - 1);
    for (int v = std::max(y - radius, within.y); v <= y1; ++v) {
      for (int u = std::max(x - radius, within.x); u <= x1; ++u) {
        f(u, v);
      }
    }
  }

 private:
  PixelRect crop_;
  int margin_;
};

struct Range {
  float low = 0;
  float high = 0;
};

struct Candidate {
  std::uint32_t pixel = 0;
  float contrast = 0;
};

/// Sums of filter times radiance.
struct Integral {
  double weight = 0;
  double absolute = 0;  ///< of the filter's absolute values: samples are drawn from them and weighted by their sum over `weight`
  Rgb sum;
  double squares = 0;
  double bright = 0;
};

/// Places along a side of each of `cells` pixels.
int side_of(std::size_t cells) {
  return static_cast<int>(std::sqrt(static_cast<double>(kPlaces) / static_cast<double>(std::max(cells, std::size_t{1}))));
}

std::vector<Range> coarse_look(const Reach& reach, const LightViewer& look, int side_max, const std::stop_token& stop) {
  const PixelRect cells = reach.cells();
  const int side = std::clamp(side_of(reach.cell_count()), 1, side_max);
  std::vector<Range> out(reach.cell_count());
  std::size_t i = 0;
  for (int y = cells.y; y < cells.y + cells.height && !stop.stop_requested(); ++y) {
    for (int x = cells.x; x < cells.x + cells.width; ++x, ++i) {
      for (int p = 0; p < side * side; ++p) {
        const float seen = luminance(look(x, y, p, side).radiance);
        out[i] = {p == 0 ? seen : std::min(out[i].low, seen), std::max(out[i].high, seen)};
      }
    }
  }
  return out;
}

std::vector<Candidate> candidates(const PixelRect& crop, const Reach& reach, const std::vector<Range>& ranges) {
  std::vector<Candidate> out;
  std::uint32_t pixel = 0;
  for (int y = crop.y; y < crop.y + crop.height; ++y) {
    for (int x = crop.x; x < crop.x + crop.width; ++x, ++pixel) {
      Range all = ranges[reach.cell(x, y)];
      // A pixel beside one that sees a light may see a sliver of it that no ray met.
      Reach::around(x, y, std::max(reach.margin(), 1), reach.cells(), [&](int u, int v) {
        const Range& r = ranges[reach.cell(u, v)];
        all = {std::min(all.low, r.low), std::max(all.high, r.high)};
      });
      const float spread = all.high - all.low;
      const float contrast = spread * spread / (all.low * all.low + kDark);
      if (contrast > kContrast) {
        out.push_back({pixel, contrast});
      }
    }
  }
  const std::size_t most = kAlways + static_cast<std::size_t>(pixel) / kShare;
  if (out.size() > most) {
    const auto stronger = [](const Candidate& a, const Candidate& b) {
      return a.contrast != b.contrast ? a.contrast > b.contrast : a.pixel < b.pixel;
    };
    std::nth_element(out.begin(), out.begin() + static_cast<std::ptrdiff_t>(most), out.end(), stronger);
    out.resize(most);
    std::sort(out.begin(), out.end(), [](const Candidate& a, const Candidate& b) { return a.pixel < b.pixel; });
  }
  return out;
}

}  // namespace

LightEdges find_light_edges(const PixelRect& crop, const FilterSampler& filter, const LightViewer& look, int side,
                            const std::stop_token& stop) {
  const Reach reach(crop, filter);
  const std::vector<Candidate> found = candidates(crop, reach, coarse_look(reach, look, side, stop));
  const auto width = static_cast<std::uint32_t>(crop.width);
  // Of each cell: 1 + its candidate; and is it within the reach of one?
  std::vector<std::uint32_t> slots(reach.cell_count());
  std::vector<char> is_needed(reach.cell_count());
  for (std::size_t k = 0; k < found.size(); ++k) {
    const int x = crop.x + static_cast<int>(found[k].pixel % width);
    const int y = crop.y + static_cast<int>(found[k].pixel / width);
    slots[reach.cell(x, y)] = static_cast<std::uint32_t>(k) + 1;
    Reach::around(x, y, reach.margin(), reach.cells(), [&](int u, int v) { is_needed[reach.cell(u, v)] = 1; });
  }
  const auto needed = static_cast<std::size_t>(std::count(is_needed.begin(), is_needed.end(), 1));
  const int fine = std::clamp(side_of(needed), kFineSideMin, kFineSideMax);
  std::vector<Integral> integrals(found.size());
  const PixelRect cells = reach.cells();
  for (int y = cells.y; y < cells.y + cells.height; ++y) {
    if (stop.stop_requested()) {
      return {};
    }
    for (int x = cells.x; x < cells.x + cells.width; ++x) {
      if (is_needed[reach.cell(x, y)] == 0) {
        continue;
      }
      for (int p = 0; p < fine * fine; ++p) {
        const SeenLight seen = look(x, y, p, fine);
        const auto bright = static_cast<double>(luminance(seen.radiance));
        Reach::around(x, y, reach.margin(), crop, [&](int u, int v) {
          const std::uint32_t slot = slots[reach.cell(u, v)];
          if (slot == 0) {
            return;
          }
          const float f = filter.evaluate(seen.film_px.x - static_cast<float>(u) - 0.5F) *
                          filter.evaluate(seen.film_px.y - static_cast<float>(v) - 0.5F);
          const auto weight = static_cast<double>(f);
          Integral& to = integrals[slot - 1];
          to.weight += weight;
          to.absolute += std::abs(weight);
          to.sum += seen.radiance * f;
          to.squares += std::abs(weight) * bright * bright;
          to.bright += bright > 0 ? std::abs(weight) : 0;
        });
      }
    }
  }
  LightEdges out;
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Integral& sum = integrals[k];
    LightEdge edge;
    edge.pixel = found[k].pixel;
    edge.mean = sum.sum * static_cast<float>(1 / sum.weight);
    const auto mean = static_cast<double>(luminance(edge.mean));
    const double scale = sum.absolute / sum.weight;
    edge.coverage = static_cast<float>(sum.bright / sum.absolute);
    edge.variance = static_cast<float>(std::max(scale * sum.squares / sum.weight - mean * mean, 0.0));
    if (edge.variance > kContrast * (static_cast<float>(mean * mean) + kDark)) {
      out.push_back(edge);
    }
  }
  return out;
}

}  // namespace core
