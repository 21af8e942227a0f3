#include "core/render/light_edges.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "core/accel/accel.h"

namespace core {
namespace {

/// Places that are looked at, of the whole film and of the rims alone, and those along a side of a pixel.
constexpr std::size_t kPlaces = std::size_t{1} << 21U;
constexpr int kCoarseSideMax = 4;
constexpr std::size_t kCoarsePlaces = kCoarseSideMax * kCoarseSideMax;
constexpr int kFineSideMin = 4;
constexpr int kFineSideMax = 24;
/// For plans, places at rims for each pixel of the film, on average: some three samples' time. Few rims are looked at as closely as for errors.
constexpr std::size_t kPlacesOfPlans = 16;
/// Small films are always looked at in so many places, at least: a lamp of a tenth of a pixel may be half of their error.
constexpr std::size_t kPlacesAlways = std::size_t{1} << 16U;
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

/// Along a side of each of `cells` pixels, so that there are so many in all.
int side_of(std::size_t places, std::size_t cells) {
  return static_cast<int>(std::sqrt(static_cast<double>(places) / static_cast<double>(std::max(cells, std::size_t{1}))));
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

struct LightEdgeSearch::Impl {
  PixelRect crop;
  FilterSampler filter;
  LightViewer look;
  Reach reach;
  std::size_t coarse_places = kCoarsePlaces;  ///< for each pixel of the film
  std::size_t places_of_plans = kPlacesOfPlans;  ///< the same
  int row = 0;  ///< of the cells, the next
  bool is_coarse_done = false;
  std::vector<Range> ranges;  ///< [cell], of the coarse look
  std::vector<Candidate> found;
  /// Of the fine look that is under way.
  EdgeDetail detail = EdgeDetail::kPlans;
  int fine = 0;                      ///< places along the side of a pixel
  std::vector<std::uint32_t> slots;  ///< [cell]: 1 + its candidate
  std::vector<char> is_needed;       ///< [cell]: is it within the reach of a candidate?
  std::vector<Integral> integrals;   ///< [candidate]
  std::array<std::optional<LightEdges>, 2> edges;  ///< [detail]
  std::array<int, 2> sides{};

  Impl(const PixelRect& rect, const FilterSampler& f, LightViewer viewer)
      : crop(rect), filter(f), look(std::move(viewer)), reach(rect, f), ranges(reach.cell_count()) {}

  std::size_t places_for(std::size_t each) const { return std::clamp(each * reach.cell_count(), kPlacesAlways, kPlaces); }
  void coarse_row(int y);
  void begin_fine(EdgeDetail of);
  void fine_row(int y);
  LightEdges conclude();
};

void LightEdgeSearch::Impl::coarse_row(int y) {
  const PixelRect cells = reach.cells();
  const int side = std::clamp(side_of(places_for(coarse_places), reach.cell_count()), 1, kCoarseSideMax);
  for (int x = cells.x; x < cells.x + cells.width; ++x) {
    Range& range = ranges[reach.cell(x, y)];
    for (int p = 0; p < side * side; ++p) {
      const float seen = luminance(look(x, y, p, side).radiance);
      range = {p == 0 ? seen : std::min(range.low, seen), std::max(range.high, seen)};
    }
  }
}

void LightEdgeSearch::Impl::begin_fine(EdgeDetail of) {
  detail = of;
  const auto width = static_cast<std::uint32_t>(crop.width);
  slots.assign(reach.cell_count(), 0);
  is_needed.assign(reach.cell_count(), 0);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const int x = crop.x + static_cast<int>(found[k].pixel % width);
    const int y = crop.y + static_cast<int>(found[k].pixel / width);
    slots[reach.cell(x, y)] = static_cast<std::uint32_t>(k) + 1;
    Reach::around(x, y, reach.margin(), reach.cells(), [&](int u, int v) { is_needed[reach.cell(u, v)] = 1; });
  }
  const auto needed = static_cast<std::size_t>(std::count(is_needed.begin(), is_needed.end(), 1));
  const std::size_t places = of == EdgeDetail::kErrors ? kPlaces : places_for(places_of_plans);
  fine = std::clamp(side_of(places, needed), kFineSideMin, kFineSideMax);
  integrals.assign(found.size(), {});
}

void LightEdgeSearch::Impl::fine_row(int y) {
  const PixelRect cells = reach.cells();
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

LightEdges LightEdgeSearch::Impl::conclude() {
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
  slots = {};
  is_needed = {};
  integrals = {};
  return out;
}

LightEdgeSearch::LightEdgeSearch(const PixelRect& crop, const FilterSampler& filter, LightViewer look)
    : impl_(std::make_unique<Impl>(crop, filter, std::move(look))) {}

LightEdgeSearch::~LightEdgeSearch() = default;

void LightEdgeSearch::be_sparing() noexcept {
  impl_->coarse_places = kCoarsePlaces / 4;
  impl_->places_of_plans = kPlacesOfPlans / 2;
}

bool LightEdgeSearch::knows(EdgeDetail detail) const noexcept { return impl_->edges[static_cast<std::size_t>(detail)].has_value(); }

const LightEdges& LightEdgeSearch::edges(EdgeDetail detail) const { return *impl_->edges[static_cast<std::size_t>(detail)]; }

int LightEdgeSearch::side(EdgeDetail detail) const noexcept { return impl_->sides[static_cast<std::size_t>(detail)]; }

void LightEdgeSearch::step(EdgeDetail detail) {
  prepare_tracing_thread();  // the steps may be of several
  Impl& m = *impl_;
  const PixelRect cells = m.reach.cells();
  if (!m.is_coarse_done) {
    m.coarse_row(cells.y + m.row);
    if (++m.row == cells.height) {
      m.row = 0;
      m.is_coarse_done = true;
      m.found = candidates(m.crop, m.reach, m.ranges);
      m.ranges = {};
    }
    return;
  }
  if (m.row == 0) {
    m.begin_fine(detail);
  }
  m.fine_row(cells.y + m.row);
  if (++m.row == cells.height) {
    m.row = 0;
    m.edges[static_cast<std::size_t>(m.detail)] = m.conclude();
    m.sides[static_cast<std::size_t>(m.detail)] = m.fine;
  }
}

LightEdges LightEdgeSearch::finish(const std::stop_token& stop) {
  while (!knows(EdgeDetail::kErrors)) {
    if (stop.stop_requested()) {
      return {};
    }
    step(EdgeDetail::kErrors);
  }
  return edges(EdgeDetail::kErrors);
}

}  // namespace core
