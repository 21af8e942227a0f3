#include "core/film/error_estimate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/base/statistics.h"
#include "core/film/expected_values.h"
#include "core/film/moment_sums.h"

namespace core {
namespace {

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
/// Of the windows that the errors of single pixels are pooled over.
constexpr std::array<int, 7> kRadii = {1, 2, 3, 5, 8, 16, 32};
/// Degrees of freedom that the variance of a single pixel is to have, and the least that it is said to have.
constexpr double kEnough = 6;
constexpr double kFewest = 3;
/// Times the expected value that one half has, and the other less than it, where a single event made it: what the picture is off by there is
/// half of their difference, and no estimate. Fewer do where the pixel has that share of the sum over the picture.
constexpr float kStandsOut = 10;
constexpr float kStandsOutHeavy = 4;
constexpr float kHeavy = 0.02F;
/// edge_noise() of about four samples that met the light: fewer tell little of how many others do.
constexpr float kFewEvents = 0.25F;
/// Events that a half is expected to have, below which they come as if samples were independent, and halves say little of their variance.
constexpr float kRareEvents = 0.5F;
/// Relative standard error of what is foretold of all pixels together, and of each: some places in its rim are all that tells.
constexpr double kForetoldUnsure = 0.1;
constexpr double kEachForetoldUnsure = 0.5;
/// Share of the sum over the picture from which on the luck of one pixel shows: of many, it is averaged out.
constexpr float kMatters = 0.005F;
/// Of the error, that its lower bound is where few pixels decide which of two readings is right.
constexpr double kFarApart = 0.5;
/// Share of the sum over the picture from which on a pixel is worth probing, and the number of those that are.
constexpr double kDoubtful = 0.01;
constexpr std::size_t kMostDoubtful = 64;
/// What is divided by is wrong by this factor where a probe contradicts.
constexpr float kSurprising = 2;
/// Blue-noise order takes variance from the means of 2 x 2 pixels and gives it to what is left. At most all of it: a
/// quarter of the eigenvalues of the covariance is 0 then, the others are 4/3 of the variance, and the sum of their squares,
/// half of the variance of a sum of squares, is 4/3 of that of independent pixels. Differences of neighbours, whose
/// correlation is -1/3 at most, show 1 - 1/9 of the variance of one square: 4/3 / (8/9).
/// Shared light samples: two pixels d apart are in one square of side b with probability (1 - |d| / b)^2 or less, so a correlation
/// r within squares makes the variance of a sum of squares 1 + c r^2 times that of independent pixels, c being 3.5 for b = 3 and 6.6
/// for b = 4: this covers r up to 0.38 and 0.27. Under 300 lamps r is 0.05 (sampler_coverage_test.cpp).
constexpr double kDependence = 1.5;

/// The variance of single pixels, pooled over windows that hold enough distinct deviations.
///
/// Half of it is the window's, half goes with what the pixel's own samples spread: noise changes across a window, be it with the
/// light of a lantern or at an edge, and the window alone gives the brightest pixels too little. The samples alone would
/// not do: few of them know their spread badly, and it is least where light has been missed.
class PixelNoise {
 public:
  PixelNoise(const FilmSnapshot& film, const MomentSums& sums)
      : sums_(sums),
        width_(film.rect.width),
        height_(film.rect.height),
        deviations_(width_, height_),
        spreads_(width_, height_),
        roots_(width_, height_),
        own_(film.pixel_count()) {
    std::size_t i = 0;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x, ++i) {
        const Rgb d = (half_value(film, i, 0).mean - half_value(film, i, 1).mean) * 0.5F;
        own_[i] = static_cast<float>(sample_variance(film, i).of_mean);
        const auto spread = static_cast<double>(own_[i]);
        deviations_.set(x, y, std::sqrt(static_cast<double>(d.r * d.r + d.g * d.g + d.b * d.b)));
        spreads_.set(x, y, spread);
        roots_.set(x, y, std::sqrt(spread));
      }
    }
  }

  struct Value {
    Rgb variance;
    double degrees = 0;  ///< of freedom; squares of neighbours taken for independent
    PixelRect window;
    double share = 1;  ///< of the window's variance that is this pixel's
  };
  Value at(int x, int y) const {
    Value out;
    MomentSums::Values v;
    double squares = 0;
    for (const int radius : kRadii) {
      out.window = window_around(x, y, radius, width_, height_);
      v = sums_.over(out.window);
      squares = v.count * (v.variance[0] + v.variance[1] + v.variance[2]);
      out.degrees = v.count;
      if (squares > 0) {
        // (sum |e|)^2 / sum e^2 is 2 / pi of the count where errors are Gaussian and alike (Geary 1935), less where a few are
        // all of it.
        const double sum = std::max(deviations_.sum(out.window), 0.0);
        out.degrees = std::min(kHalfPi * sum * sum / squares, v.count);
      }
      if (out.degrees >= kEnough) {
        break;
      }
    }
    const double spread = std::max(spreads_.sum(out.window), 0.0) / v.count;
    const double root = std::max(roots_.sum(out.window), 0.0) / v.count;
    if (spread > 0 && root > 0) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
      out.share = 0.5 + 0.5 * static_cast<double>(own_[i]) / spread;
      // Pixels whose spreads have a relative variance of 4 u differ by u in the half that is the window's. Half of that is taken to
      // be there in truth, half to be luck of the samples; 2 / degrees is the relative variance of what is pooled.
      const double unlike = std::max(spread / (root * root) - 1, 0.0);
      out.degrees = std::max(out.degrees / (1 + 0.25 * out.degrees * unlike), kFewest);
    }
    const double share = out.share;
    out.variance = {static_cast<float>(share * v.variance[0]), static_cast<float>(share * v.variance[1]),
                    static_cast<float>(share * v.variance[2])};
    return out;
  }

 private:
  static constexpr double kHalfPi = 1.5707963267948966;
  const MomentSums& sums_;
  int width_;
  int height_;
  SummedArea deviations_;  ///< half of A - B, absolute, channels together
  SummedArea spreads_;     ///< variance of the mean by the pixel's own samples, and its root
  SummedArea roots_;
  std::vector<float> own_;
};

float regularized_square(float mu) { return mu * mu + static_cast<float>(MomentSums::kRegularizer); }

/// Mean over channels of variance / (mu^2 + 0.01).
float relative(Rgb variance, Rgb mu) {
  float ratio = 0;
  for (int c = 0; c < 3; ++c) {
    ratio += variance[c] / (mu[c] * mu[c] + static_cast<float>(MomentSums::kRegularizer)) * (1.0F / 3);
  }
  return ratio;
}

Rgb larger(Rgb a, Rgb b) { return {std::max(a.r, b.r), std::max(a.g, b.g), std::max(a.b, b.b)}; }

}  // namespace

std::size_t ErrorEstimate::index(int x, int y) const noexcept {
  return static_cast<std::size_t>(y - rect_.y) * static_cast<std::size_t>(rect_.width) +
         static_cast<std::size_t>(x - rect_.x);
}

void ErrorEstimate::weigh(const std::vector<Rgb>& variances, const std::vector<ExpectedValue>& expected) {
  const std::size_t n = variances.size();
  raw_ratio_.resize(n);
  influence_.resize(n);
  unlike_.resize(n);
  // How the sum of the ratios moves with a pixel: by its own ratio, and through the expected value that its region
  // shares. d/dmu of Var / (mu^2 + c) is -2 mu Var / (mu^2 + c)^2.
  struct Part {
    std::array<float, 3> slope{};
    float pixels = 0;
  };
  std::array<std::vector<Part>, 2> parts = {std::vector<Part>(n), std::vector<Part>(n)};
  for (std::size_t i = 0; i < n; ++i) {
    unlike_[i] = expected[i].unlike;
    float ratio = 0;
    std::array<float, 3> slope{};
    for (int c = 0; c < 3; ++c) {
      const float mu = expected[i].mean[c];
      const float scale = 1 / (mu * mu + static_cast<float>(MomentSums::kRegularizer));
      const float share = variances[i][c] * scale * (1.0F / 3);
      ratio += share;
      slope[static_cast<std::size_t>(c)] = expected[i].is_shared ? 2 * mu * scale * share : 0;
    }
    raw_ratio_[i] = ratio;
    for (std::size_t k = 0; k < parts.size(); ++k) {
      Part& part = parts[k][expected[i].shares[k].part];
      ++part.pixels;
      for (std::size_t c = 0; c < slope.size(); ++c) {
        part.slope[c] += slope[c];
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    influence_[i] = raw_ratio_[i];
    for (std::size_t k = 0; k < parts.size(); ++k) {
      const Part& part = parts[k][expected[i].shares[k].part];
      const Rgb& apart = expected[i].shares[k].apart;
      influence_[i] -= (part.slope[0] * apart.r + part.slope[1] * apart.g + part.slope[2] * apart.b) / part.pixels;
    }
  }
}

void ErrorEstimate::know(const FilmSnapshot& film, const LightEdges& edges, const std::vector<ExpectedValue>& expected) {
  known_.assign(film.pixel_count(), kNan);
  unsure_.assign(film.pixel_count(), 0);
  foretold_.assign(film.pixel_count(), kNan);
  least_.assign(film.pixel_count(), kNan);
  const float all = std::accumulate(raw_ratio_.begin(), raw_ratio_.end(), 0.0F);
  const float heavy = kHeavy * all;
  for (std::size_t i = 0; i < known_.size(); ++i) {
    const float a = luminance(half_value(film, i, 0).mean);
    const float b = luminance(half_value(film, i, 1).mean);
    const float mu = luminance(expected[i].mean);
    if (expected[i].is_shared && std::min(a, b) < mu &&
        (std::max(a, b) > kStandsOut * mu || (std::max(a, b) > kStandsOutHeavy * mu && raw_ratio_[i] > heavy))) {
      known_[i] = raw_ratio_[i];
    }
    if (raw_ratio_[i] > heavy) {
      const Rgb d = half_value(film, i, 0).mean - half_value(film, i, 1).mean;
      least_[i] = relative(d * d * 0.25F, larger(expected[i].mean, mean_[i]));
    }
  }
  for (const LightEdge& edge : edges) {
    const Rgb mu = expected[edge.pixel].mean;
    least_[edge.pixel] = kNan;
    if (edge_noise(film, edge, mu) < kFewEvents) {
      continue;
    }
    const Rgb d = mean_[edge.pixel] - mu;
    known_[edge.pixel] = relative(d * d, mu);
    const auto count = static_cast<float>(pixel_value(film, edge.pixel).count);
    const float events = edge.coverage * count / 2;
    const float seen = luminance(edge.mean);
    if (foretells_ && events < kRareEvents && seen > 0) {
      // Well-spread points meet it once or not at all: events (1 - events), where independent ones have the variance of a Poisson distribution.
      const Rgb color = edge.mean * (1 / seen);
      const float told = relative(color * color * (edge.variance / count * (1 - events)), mu);
      foretold_[edge.pixel] = told > kMatters * all ? told : kNan;
    }
  }
}

void ErrorEstimate::doubt(const FilmSnapshot& film, const LightEdges& edges, const std::vector<ExpectedValue>& expected) {
  // By the spread of a pixel's samples, over the least that its expected value may be: what the halves differ by is luck, and the mean of a
  // region may be that of brighter ones beside.
  std::vector<float> most(film.pixel_count());
  double sum = 0;
  for (std::size_t i = 0; i < most.size(); ++i) {
    const auto spread = static_cast<float>(sample_variance(film, i).of_mean);
    const float mu = luminance(expected[i].mean);
    const float least = std::min({mu, luminance(half_value(film, i, 0).mean), luminance(half_value(film, i, 1).mean)});
    const auto ratio = [&](float y) { return spread / (y * y + static_cast<float>(MomentSums::kRegularizer)); };
    sum += static_cast<double>(ratio(mu));
    most[i] = ratio(least);
  }
  const double all = std::accumulate(raw_ratio_.begin(), raw_ratio_.end(), 0.0);
  std::vector<double> share(most.size());
  for (std::size_t i = 0; i < most.size(); ++i) {
    share[i] = std::max(static_cast<double>(most[i]) / sum, static_cast<double>(std::abs(influence_[i])) / all);
  }
  for (const LightEdge& edge : edges) {
    share[edge.pixel] = 0;
  }
  for (std::size_t i = 0; i < share.size(); ++i) {
    if (share[i] > kDoubtful) {
      doubtful_.push_back(static_cast<std::uint32_t>(i));
    }
  }
  std::sort(doubtful_.begin(), doubtful_.end(),
            [&](std::uint32_t a, std::uint32_t b) { return share[a] != share[b] ? share[a] > share[b] : a < b; });
  doubtful_.resize(std::min(doubtful_.size(), kMostDoubtful));
  for (const std::uint32_t i : doubtful_) {
    doubtful_square_.push_back(regularized_square(luminance(expected[i].mean)));
  }
}

std::vector<ProbedPixel> ErrorEstimate::surprises(const std::vector<ProbedPixel>& probed) const {
  std::vector<ProbedPixel> out;
  for (const ProbedPixel& probe : probed) {
    const auto k = static_cast<std::size_t>(std::find(doubtful_.begin(), doubtful_.end(), probe.pixel) - doubtful_.begin());
    const float ratio = k < doubtful_.size() ? regularized_square(luminance(probe.mean())) / doubtful_square_[k] : 1;
    if (ratio > kSurprising || ratio < 1 / kSurprising) {
      out.push_back(probe);
    }
  }
  return out;
}

void ErrorEstimate::know(std::span<const ProbedPixel> probed) {
  for (const ProbedPixel& probe : probed) {
    const std::size_t i = probe.pixel;
    influence_[i] = raw_ratio_[i];
    foretold_[i] = least_[i] = kNan;
    // The product of what two independent probes say has no bias, the square of one has their variance in it.
    const Rgb off[2] = {mean_[i] - probe.means[0], mean_[i] - probe.means[1]};
    known_[i] = std::max(relative(off[0] * off[1], probe.mean()), 0.0F);
    const float apart = relative(off[0] * off[0], probe.means[0]) - relative(off[1] * off[1], probe.means[1]);
    unsure_[i] = apart * apart / 4;
  }
}

ErrorEstimate::ErrorEstimate(const FilmSnapshot& film, const LightEdges& edges, std::span<const ProbedPixel> probed, bool foretells)
    : rect_(film.rect), foretells_(foretells), dependence_(film.errors == PixelErrors::kCorrelated ? kDependence : 1) {
  const int w = rect_.width;
  const int h = rect_.height;
  const std::size_t n = film.pixel_count();
  mean_.resize(n);
  std::vector<Rgb> raw(n);
  valid_ = n > 0;
  for (std::size_t i = 0; i < n; ++i) {
    const HalfValue a = half_value(film, i, 0);
    const HalfValue b = half_value(film, i, 1);
    valid_ = valid_ && a.count > 0 && b.count > 0;
    mean_[i] = pixel_value(film, i).mean;
    const Rgb d = a.mean - b.mean;
    raw[i] = d * d * 0.25F;
  }
  if (!valid_) {
    return;
  }
  {
    const std::vector<ExpectedValue> expected = expected_values(film, edges, probed);
    weigh(raw, expected);
    know(film, edges, expected);
    know(probed);
    if (probed.empty()) {
      doubt(film, edges, expected);
    }
  }
  MomentSums sums(w, h);
  SummedArea ratios(w, h);
  SummedArea unknown(w, h);
  for (std::size_t i = 0; i < n; ++i) {
    const auto x = static_cast<int>(i % static_cast<std::size_t>(w));
    const auto y = static_cast<int>(i / static_cast<std::size_t>(w));
    sums.set(x, y, mean_[i], raw[i]);
    ratios.set(x, y, static_cast<double>(raw_ratio_[i]));
    unknown.set(x, y, std::isnan(known_[i]) ? static_cast<double>(raw_ratio_[i]) : 0.0);
  }
  pooled_variance_.resize(n);
  pooled_ratio_.resize(n);
  window_ratio_.resize(n);
  degrees_.resize(n);
  const PixelNoise noise(film, sums);
  for (int y = 0; y < h; ++y) {
    for (int x = 0; x < w; ++x) {
      const auto i = static_cast<std::size_t>(y) * static_cast<std::size_t>(w) + static_cast<std::size_t>(x);
      const PixelNoise::Value own_noise = noise.at(x, y);
      const auto mean_over = [](const SummedArea& area, const PixelRect& r) {
        return std::max(area.sum(r), 0.0) / (static_cast<double>(r.width) * static_cast<double>(r.height));
      };
      pooled_variance_[i] = own_noise.variance;
      pooled_ratio_[i] = static_cast<float>(own_noise.share * mean_over(ratios, own_noise.window));
      degrees_[i] = static_cast<float>(own_noise.degrees / dependence_);
      // The window grows until its mean is known to about 10 %.
      PixelRect window;
      for (const int r : kRadii) {
        window = window_around(x, y, r, w, h);
        if (sums.over(window).relative_variance() <= 0.01) {
          break;
        }
      }
      window_ratio_[i] = static_cast<float>(mean_over(unknown, window));
    }
  }
}

ErrorInterval ErrorEstimate::image(double confidence) const { return region(rect_, confidence); }

ErrorEstimate::MeanRatio ErrorEstimate::mean_ratio(PixelRect rect, Of of) const {
  MeanRatio out;
  const double n = static_cast<double>(rect.width) * static_cast<double>(rect.height);
  if (!valid_ || n < 1) {
    out.value = std::numeric_limits<double>::quiet_NaN();
    return out;
  }
  // Each of the raw ratios has one degree of freedom, or less where events are rare: the variance of their mean is
  // taken from the differences of neighbours, which share their expected value, and is never less than the 2 q^2 of a
  // Gaussian.
  double sum = 0;
  double pairs = 0;
  double gaussian = 0;
  double unlike = 0;  // what ratios may be wrong by, all together
  double unsure = 0;
  double foretold = 0;  // the same of those whose variance the scene tells
  double largest = 0;
  const auto known = [&](std::size_t i) {
    if (of == Of::kLeast && !std::isnan(least_[i])) {
      return least_[i];
    }
    return of == Of::kPicture && !std::isnan(known_[i]) ? known_[i] : foretold_[i];
  };
  const auto spread = [&](std::size_t i) { return static_cast<double>(std::isnan(known(i)) ? influence_[i] : influence_[i] - raw_ratio_[i]); };
  for (int y = rect.y; y < rect.y + rect.height; ++y) {
    for (int x = rect.x; x < rect.x + rect.width; ++x) {
      const std::size_t i = index(x, y);
      const float told = known(i);
      const bool is_known = !std::isnan(told);
      const auto q = static_cast<double>(is_known ? told : raw_ratio_[i]);
      const auto pooled = is_known ? 0 : static_cast<double>(window_ratio_[i]);
      sum += q;
      unlike += static_cast<double>(unlike_[i]) * q;
      unsure += static_cast<double>(unsure_[i]);
      const double by_scene = of == Of::kExpected && is_known ? q : 0;
      foretold += by_scene;
      unsure += kEachForetoldUnsure * kEachForetoldUnsure * by_scene * by_scene;
      largest = std::max(largest, q - by_scene);
      gaussian += 2 * pooled * pooled;
      const int column = x - rect.x;
      if (column % 2 == 1) {
        const double d = spread(i) - spread(i - 1);
        pairs += d * d;
      } else if (column + 1 == rect.width) {
        pairs += 2 * pooled * pooled;
      }
    }
  }
  out.value = sum / n;
  foretold *= kForetoldUnsure;
  const double variance = (dependence_ * std::max(pairs, gaussian) + unlike * unlike + unsure + foretold * foretold) / (n * n);
  if (out.value > 0) {
    // Gamma with the same mean and variance: chi2(k) / k with k = 2 q^2 / variance.
    out.degrees = std::max(2 * out.value * out.value / variance, 0.5);
    out.largest_share = largest / sum;
  }
  return out;
}

ErrorInterval ErrorEstimate::region(PixelRect rect, double confidence) const {
  const MeanRatio q = mean_ratio(rect, Of::kExpected);
  ErrorInterval out;
  out.relative_rmse = out.low = out.high = std::sqrt(q.value);
  if (q.value > 0) {
    const double k = q.degrees;
    const double tail = (1 - confidence) / 2;
    out.low = std::sqrt(q.value * k / chi2_quantile(1 - tail, k));
    out.high = std::sqrt(q.value * k / chi2_quantile(tail, k));
    const MeanRatio least = mean_ratio(rect, Of::kLeast);
    if (least.value > 0 && least.value < q.value) {
      const double degrees = std::max(k, least.degrees);
      out.low = std::min(out.low, std::sqrt(least.value * degrees / chi2_quantile(1 - tail, degrees)));
    }
    // Fewer than some ten events carry the whole estimate: what was not seen cannot be bounded.
    out.unreliable = k < 20 || q.largest_share > 0.25 || out.low < kFarApart * out.relative_rmse;
  }
  return out;
}

double ErrorEstimate::most(PixelRect rect, double alpha) const {
  const MeanRatio q = mean_ratio(rect, Of::kPicture);
  // What the picture is off by spreads about its expected value as the estimate does, one from (A + B) / 2 and the other
  // from (A - B) / 2: their ratio has an F distribution.
  return q.value > 0 ? std::sqrt(q.value / f_quantile(alpha, q.degrees)) : std::sqrt(q.value);
}

double ErrorEstimate::least() const { return std::sqrt(mean_ratio(rect_, Of::kLeast).value); }

PixelError ErrorEstimate::pixel(int x, int y) const {
  PixelError out;
  const std::size_t i = index(x, y);
  if (!valid_) {
    out.standard_error = out.low = out.high = Rgb(kNan);
    return out;
  }
  const Rgb v = pooled_variance_[i];
  out.standard_error = {std::sqrt(v.r), std::sqrt(v.g), std::sqrt(v.b)};
  // 97.5 % quantile of Student's t by its expansion in 1/k (Abramowitz and Stegun 26.7.5): exact to 0.003 from k = 4 on, 0.7 %
  // too low at 3, 3 % at 2.
  const float inverse = 1 / degrees_[i];
  const float quantile = 1.959964F + inverse * (2.372271F + inverse * (2.822500F + inverse * 2.555850F));
  out.low = mean_[i] - out.standard_error * quantile;
  out.high = mean_[i] + out.standard_error * quantile;
  return out;
}

float ErrorEstimate::relative_error(int x, int y) const {
  return valid_ ? std::sqrt(pooled_ratio_[index(x, y)]) : kNan;
}

}  // namespace core
