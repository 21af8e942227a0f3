#include "core/film/expected_values.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/film/moment_sums.h"

namespace core {
namespace {

/// Of the windows in which events may stand out.
constexpr std::array<int, 3> kRadii = {1, 2, 3};
/// Of the window that tells how noisy the lesser half is.
constexpr int kNoiseRadius = 2;
/// Relative variance with which a pixel's own mean is known: 1 / mu^2 is too large by three times this share, and too small
/// by twice of it where rare events make noise and mean rise together.
constexpr float kKnown = 0.006F;
/// Where a pixel beside it surely is as bright, a pixel's expected value is taken for at least 1 / sqrt(1 + kRimSpread / k) of
/// its mean. At the rim of a lamp one sample may be all that met it, and any share of the pixel may be covered.
constexpr double kRimSpread = 16;
/// 1 / k with which both halves of a pixel do not meet rare events by chance.
constexpr double kSeveral = 0.34;
/// A pixel's own lower bound counts where it is this many times what its surroundings say.
constexpr float kApart = 1.5F;
/// edge_noise() below which the pixel's own mean is its expected value; stratified samples are better than what it says.
constexpr float kOwnMeanKnown = 0.01F;
/// Luminance below which pixels are alike: its square is what errors are regularized with.
constexpr float kDim = 0.1F;
/// Most that it counts for: over pictures of wholly unlike pixels Var / mean^2 was found to be wrong by some tenth (test scenes against
/// references).
constexpr float kMostUnlike = 0.12F;
/// Of the window that tells what is beside a light's rim.
constexpr int kBesideRadius = 3;
constexpr int kBesideEnough = 3;
constexpr float kHalfPi = 1.57079633F;

/// Lower bound for the mean of a Poisson distribution of which k was drawn, as a share of k (Garwood 1936), by Wilson and
/// Hilferty: 3.09 standard deviations, one in a thousand.
double events_share(double events) {
  const double inverse = 1 / std::max(events, 1e-3);
  const double root = std::max(1 - inverse / 9 - 3.09 / 3 * std::sqrt(inverse), 0.0);
  return root * root * root;
}

/// What a pixel's samples say of its mean. (s^2 / n) / mean^2 is 1 / k where k equal events made it.
struct OwnMean {
  float least_share = 0;  ///< of it that the expected value surely is
  float rim_share = 0;    ///< the same at the rim of something bright
  bool several = false;   ///< some events made it

  OwnMean() = default;
  OwnMean(const FilmSnapshot& film, std::size_t pixel, Rgb mean) {
    const SampleVariance spread = sample_variance(film, pixel);
    const double degrees = spread.degrees;
    const auto y = static_cast<double>(luminance(mean));
    if (!(degrees > 0) || !(y > 0)) {
      return;
    }
    const double inverse = spread.of_mean / (y * y);
    several = inverse <= kSeveral;
    // Few samples may agree by luck: the upper bound of the variance, one in a hundred, by the same approximation.
    const double luck = std::max(1 - 2 / (9 * degrees) - 2.33 * std::sqrt(2 / (9 * degrees)), 0.0);
    const double most = inverse / std::max(luck * luck * luck, 0.01);
    least_share = most < 1 ? static_cast<float>(events_share(1 / std::max(most, 1e-12))) : 0;
    rim_share = static_cast<float>(1 / std::sqrt(1 + kRimSpread * inverse));
  }
};

double total(const std::array<double, 3>& v) { return v[0] + v[1] + v[2]; }

/// As many equal events would spread as much as those of a window.
double events(const MomentSums::Values& v) {
  const double sum = total(v.mean);
  const double squares = 3 * total(v.variance);
  return squares > 0 ? v.count * sum * sum / squares : 0;
}

float sum_of(Rgb v) { return v.r + v.g + v.b; }

/// `region`, the mean of the pixel's region, or the mean around it where a few pixels beside each other have events and
/// others have none, which is not chance.
Rgb pooled_around(const MomentSums& excess, int x, int y, int width, int height, Rgb region) {
  for (const int radius : kRadii) {
    const MomentSums::Values v = excess.over(window_around(x, y, radius, width, height));
    if (static_cast<double>(sum_of(region)) < events_share(events(v)) * total(v.mean)) {
      return {static_cast<float>(v.mean[0]), static_cast<float>(v.mean[1]), static_cast<float>(v.mean[2])};
    }
  }
  return region;
}

/// value(channel) of all three.
template <class Value>
Rgb channels(const Value& value) {
  return {value(0), value(1), value(2)};
}

/// Luminance around a pixel.
float largest_around(const std::vector<float>& values, int x, int y, int width, int height) {
  const PixelRect r = window_around(x, y, 1, width, height);
  float out = 0;
  for (int v = r.y; v < r.y + r.height; ++v) {
    for (int u = r.x; u < r.x + r.width; ++u) {
      out = std::max(out, values[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)]);
    }
  }
  return out;
}

/// The pixel's value, at most the largest of its neighbours', per channel.
Rgb not_alone(const std::vector<Rgb>& values, int x, int y, int width, int height) {
  const PixelRect r = window_around(x, y, 1, width, height);
  Rgb most(0);
  for (int v = r.y; v < r.y + r.height; ++v) {
    for (int u = r.x; u < r.x + r.width; ++u) {
      if (u != x || v != y) {
        const Rgb& other = values[static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u)];
        most = channels([&](int c) { return std::max(most[c], other[c]); });
      }
    }
  }
  const Rgb& own = values[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  return channels([&](int c) { return std::min(most[c], own[c]); });
}

/// f of each pixel's window, averaged, per channel.
template <class F>
Rgb mean_around(const std::vector<Rgb>& values, int x, int y, int radius, int width, int height, const F& f) {
  const PixelRect r = window_around(x, y, radius, width, height);
  Rgb sum(0);
  for (int v = r.y; v < r.y + r.height; ++v) {
    const Rgb* row = &values[static_cast<std::size_t>(v) * static_cast<std::size_t>(width)];
    for (int u = r.x; u < r.x + r.width; ++u) {
      sum += f(row[u]);
    }
  }
  return sum * (1 / static_cast<float>(r.width * r.height));
}

/// Mean luminance of the bases of the pixels of each part of the excess.
std::vector<double> means_of_parts(const std::vector<MomentSums::Region>& bases, const std::vector<MomentSums::Region>& excesses) {
  std::vector<double> sums(bases.size());
  std::vector<double> counts(bases.size());
  for (std::size_t i = 0; i < bases.size(); ++i) {
    sums[excesses[i].part] += static_cast<double>(luminance(bases[i].mean));
    ++counts[excesses[i].part];
  }
  for (std::size_t i = 0; i < sums.size(); ++i) {
    sums[i] /= std::max(counts[i], 1.0);
  }
  return sums;
}

/// Luminance of the light whose rim it is.
float light_of(const LightEdge& edge) { return luminance(edge.mean) / std::max(edge.coverage, 1e-6F); }

/// What a pixel at a rim sees beside the light, if its halves tell: neither of them met it, or one. Each meeting of it is far above all else.
std::optional<Rgb> met_beside(const FilmSnapshot& film, const LightEdge& edge) {
  const Rgb a = half_value(film, edge.pixel, 0).mean;
  const Rgb b = half_value(film, edge.pixel, 1).mean;
  const auto count = static_cast<float>(pixel_value(film, edge.pixel).count);
  const float meeting = 0.5F * light_of(edge) / std::max(count / 2, 1.0F);
  const float least = std::min(luminance(a), luminance(b));
  if (edge.coverage * count > 1 || least > meeting) {
    return std::nullopt;
  }
  if (std::max(luminance(a), luminance(b)) < meeting) {
    return (a + b) * 0.5F;
  }
  return luminance(a) < luminance(b) ? a : b;
}

/// What is seen at a light's rim beside it, if it filled the pixel: the mean of the nearest pixels that are darker than the light and that no
/// rim crosses, or that tell of themselves what is beside; of all around, where none is. Black without any.
/// skip: pixels at rims that do not tell.
Rgb seen_beside(const LightEdge& edge, const std::vector<Rgb>& mean, const std::vector<char>& skip, int width, int height) {
  const auto x = static_cast<int>(edge.pixel % static_cast<std::uint32_t>(width));
  const auto y = static_cast<int>(edge.pixel / static_cast<std::uint32_t>(width));
  const float light = light_of(edge);
  struct Sum {
    Rgb value;
    int count = 0;
    void add(Rgb v) {
      value += v;
      ++count;
    }
    Rgb mean() const { return value / static_cast<float>(std::max(count, 1)); }
  };
  Sum darker;
  Sum all;
  // Light falls off from the rim: what is near tells more, as soon as it is enough to be sure.
  for (int radius = 1; radius <= kBesideRadius && darker.count < kBesideEnough; ++radius) {
    const PixelRect r = window_around(x, y, radius, width, height);
    darker = all = {};
    for (int v = r.y; v < r.y + r.height; ++v) {
      for (int u = r.x; u < r.x + r.width; ++u) {
        const std::size_t i = static_cast<std::size_t>(v) * static_cast<std::size_t>(width) + static_cast<std::size_t>(u);
        if (skip[i] != 0) {
          continue;
        }
        all.add(mean[i]);
        if (luminance(mean[i]) < 0.5F * light) {
          darker.add(mean[i]);
        }
      }
    }
  }
  return darker.count > 0 ? darker.mean() : all.mean();
}

}  // namespace

std::vector<ExpectedValue> expected_values(const FilmSnapshot& film, const LightEdges& edges, std::span<const ProbedPixel> probed) {
  const int w = film.rect.width;
  const int h = film.rect.height;
  const std::size_t n = film.pixel_count();
  std::vector<Rgb> mean(n);
  std::vector<Rgb> off(n);  // |A - B| / 2
  std::vector<OwnMean> own;
  std::vector<float> sure(n);  // luminance that a pixel surely has
  std::vector<Rgb> base(n);    // what the halves have in common
  own.reserve(n);
  std::vector<char> is_edge(n);
  std::vector<Rgb> at_edges;
  {
    std::vector<Rgb> lesser(n);
    for (std::size_t i = 0; i < n; ++i) {
      const Rgb a = half_value(film, i, 0).mean;
      const Rgb b = half_value(film, i, 1).mean;
      mean[i] = pixel_value(film, i).mean;
      off[i] = channels([&](int c) { return 0.5F * std::abs(a[c] - b[c]); });
      lesser[i] = channels([&](int c) { return std::min(a[c], b[c]); });
      own.emplace_back(film, i, mean[i]);
      sure[i] = std::max(own[i].least_share * luminance(mean[i]), own[i].several ? luminance(lesser[i]) : 0);
    }
    std::vector<char> tells_nothing(n);
    std::vector<Rgb> dark = mean;
    for (const LightEdge& edge : edges) {
      is_edge[edge.pixel] = 1;
      const std::optional<Rgb> own_dark = met_beside(film, edge);
      tells_nothing[edge.pixel] = own_dark ? 0 : 1;
      dark[edge.pixel] = own_dark.value_or(Rgb(0));
    }
    for (const LightEdge& edge : edges) {
      const std::size_t i = edge.pixel;
      const Rgb beside = seen_beside(edge, dark, tells_nothing, w, h);
      const Rgb expected = edge.mean + beside * (1 - edge.coverage);
      at_edges.push_back(edge_noise(film, edge, expected) < kOwnMeanKnown ? mean[i] : expected);
      mean[i] = lesser[i] = beside;
      off[i] = {};
      own[i] = {};
      sure[i] = 0;
    }
    for (const ProbedPixel& probe : probed) {
      lesser[probe.pixel] = probe.mean();
      off[probe.pixel] = {};
      own[probe.pixel] = {};
      sure[probe.pixel] = luminance(probe.mean());
    }
    for (std::size_t i = 0; i < n; ++i) {
      const auto x = static_cast<int>(i % static_cast<std::size_t>(w));
      const auto y = static_cast<int>(i / static_cast<std::size_t>(w));
      base[i] = not_alone(lesser, x, y, w, h);
    }
    for (const ProbedPixel& probe : probed) {
      mean[probe.pixel] = base[probe.pixel];  // it lacks nothing
    }
  }
  std::vector<MomentSums::Region> bases;
  {
    MomentSums sums(w, h);
    std::size_t i = 0;
    for (int y = 0; y < h; ++y) {
      for (int x = 0; x < w; ++x, ++i) {
        // As a Gaussian's: mean |A - B| / 2 is sqrt(2 / pi) of the standard deviation. Squares would be the rare events' alone.
        const Rgb noise = mean_around(off, x, y, kNoiseRadius, w, h, [](Rgb v) { return v; });
        sums.set(x, y, base[i], noise * noise * kHalfPi);
      }
    }
    bases = sums.regions();
  }
  MomentSums excess(w, h, MomentSums::Of::kPart);  // what the base lacks
  std::size_t i = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x, ++i) {
      const Rgb lacking = mean[i] - base[i];
      excess.set(x, y, lacking, lacking * lacking, mean[i]);
    }
  }
  std::vector<ExpectedValue> out(n);
  const std::vector<MomentSums::Region> excesses = excess.regions();
  const std::vector<double> commons = means_of_parts(bases, excesses);
  i = 0;
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x, ++i) {
      out[i].shares = {ExpectedValue::Share{bases[i].part, base[i] - bases[i].mean},
                       ExpectedValue::Share{excesses[i].part, mean[i] - base[i] - excesses[i].mean}};
      const Rgb squares = mean_around(off, x, y, 1, w, h, [](Rgb v) { return v * v; });
      const float signal = sum_of(mean[i] * mean[i]) + 3 * static_cast<float>(MomentSums::kRegularizer);
      if (sum_of(squares) <= kKnown * signal) {
        out[i].mean = mean[i];
        continue;
      }
      const Rgb mu = bases[i].mean + pooled_around(excess, x, y, w, h, excesses[i].mean);
      const bool at_rim = largest_around(sure, x, y, w, h) >= luminance(mean[i]);
      const float share = at_rim ? own[i].rim_share : own[i].least_share;
      out[i].mean = channels([&](int c) { return share * mean[i][c] > kApart * mu[c] ? share * mean[i][c] : mu[c]; });
      out[i].is_shared = out[i].mean == mu;
      const float apart = std::abs(luminance(bases[i].mean) - static_cast<float>(commons[excesses[i].part]));
      out[i].unlike = out[i].is_shared ? std::min(apart / (luminance(mu) + kDim), kMostUnlike) : 0;
    }
  }
  for (std::size_t k = 0; k < edges.size(); ++k) {
    out[edges[k].pixel].mean = at_edges[k];
    out[edges[k].pixel].is_shared = false;
  }
  for (const ProbedPixel& probe : probed) {
    out[probe.pixel].mean = probe.mean();
    out[probe.pixel].is_shared = false;
    out[probe.pixel].unlike = 0;
  }
  return out;
}

float edge_noise(const FilmSnapshot& film, const LightEdge& edge, Rgb expected) {
  const float y = luminance(expected);
  const auto count = static_cast<float>(pixel_value(film, edge.pixel).count);
  return edge.variance / (count * (y * y + static_cast<float>(MomentSums::kRegularizer)));
}

}  // namespace core
