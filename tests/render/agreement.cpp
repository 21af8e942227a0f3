#include "tests/render/agreement.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <utility>

#include <gtest/gtest.h>

#include "core/layers/layers.h"
#include "core/settings/light_shares.h"
#include "tests/support/statistics.h"

namespace test_support {
namespace {

constexpr std::size_t kImage = 3 * kBlocks;

/// Differences below this fraction of the light are rounding errors of sums of floats.
constexpr double kRounding = 1e-5;

/// value_of(pixel): its colour.
template <typename Value>
BlockSums sums_of(const core::FilmSnapshot& film, Value&& value_of) {
  BlockSums sums{};
  const auto side = static_cast<std::size_t>(film.rect.width);
  for (std::size_t p = 0; p < film.pixel_count(); ++p) {
    const std::size_t block =
        p / side * kBlocksAcross / side * kBlocksAcross + p % side * kBlocksAcross / side;
    const core::Rgb v = value_of(p);
    for (std::size_t c = 0; c < 3; ++c) {
      const auto value = static_cast<double>(v[static_cast<int>(c)]);
      sums[3 * block + c] += value;
      sums[kImage + c] += value;
    }
  }
  return sums;
}

BlockSums image_sums(const core::FilmSnapshot& film) {
  return sums_of(film, [&film](std::size_t p) { return core::pixel_value(film, p).mean; });
}

Moments column(const Blocks& rows, std::size_t k) {
  Moments out;
  for (const BlockSums& row : rows) {
    out.add(row[k]);
  }
  return out;
}

double welch_p(const Moments& a, const Moments& b) {
  const double va = a.variance() / a.n;
  const double vb = b.variance() / b.n;
  const double error = std::hypot(std::sqrt(va + vb), kRounding * b.mean);
  const double difference = std::fabs(a.mean - b.mean);
  if (!(va + vb > 0)) {
    return difference > error ? 0 : 1;
  }
  const double dof = (va + vb) * (va + vb) / (va * va / (a.n - 1) + vb * vb / (b.n - 1));
  return 2 * (1 - student_t_cdf(difference / error, dof));
}

/// Products of all pairs of rows, summed over the blocks, of which each has mean 0 and variance 1.
/// The sum of squared z of a group of rows, up to a factor, is the sum over its pairs.
std::vector<std::vector<double>> products(Blocks rows) {
  for (std::size_t k = 0; k < kImage; ++k) {
    const Moments all = column(rows, k);
    const double scale = std::hypot(std::sqrt(all.variance()), kRounding * all.mean);
    for (BlockSums& row : rows) {
      row[k] = scale > 0 ? (row[k] - all.mean) / scale : 0;
    }
  }
  std::vector<std::vector<double>> out(rows.size(), std::vector<double>(rows.size()));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    for (std::size_t j = 0; j < rows.size(); ++j) {
      out[i][j] =
          std::inner_product(rows[i].begin(), rows[i].begin() + kImage, rows[j].begin(), 0.);
    }
  }
  return out;
}

/// p-values down to 2.5e-6: a test of 100 comparisons can fail.
constexpr int kPermutationsMost = 400'000;
/// Permutations with a sum as large, after which the p-value is known well enough (Besag and
/// Clifford 1991, "Sequential Monte Carlo p-values").
constexpr int kAsLargeMost = 20;

double squares_p(const Blocks& a, const Blocks& b) {
  Blocks rows = a;
  rows.insert(rows.end(), b.begin(), b.end());
  const auto pairs = products(std::move(rows));
  std::vector<std::size_t> order(pairs.size());
  std::iota(order.begin(), order.end(), 0U);
  const auto sum = [&] {
    double out = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
      const std::vector<double>& row = pairs[order[i]];
      for (std::size_t j = 0; j < i; ++j) {
        out += 2 * row[order[j]];
      }
      out += row[order[i]];
    }
    return out;
  };
  constexpr double kEqual = 1 - 1e-9;  // the same groups, added up in another order
  const double seen = kEqual * sum();
  Random random(1);
  int as_large = 0;
  for (int n = 1; n <= kPermutationsMost; ++n) {
    for (std::size_t i = 0; i < a.size(); ++i) {
      std::swap(order[i], order[i + random.bits() % (order.size() - i)]);
    }
    as_large += sum() >= seen ? 1 : 0;
    if (as_large == kAsLargeMost) {
      return static_cast<double>(as_large) / n;
    }
  }
  return (as_large + 1.0) / (kPermutationsMost + 1.0);
}

}  // namespace

std::vector<Blocks> layers_of(core::View view, int first_seed, int samples,
                              const std::vector<std::string>& layers) {
  for (const std::string& layer : layers) {
    if (layer != kSplats) {
      view.settings.film.shares.push_back(*core::light_share(layer));
    }
  }
  std::vector<Blocks> out(layers.size() + 1);
  for (int i = 0; i < kAgreementSeeds; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(first_seed + i);
    const Picture picture = render(view, samples);
    EXPECT_EQ(picture.progress.rejected_samples, 0U);
    out.back().push_back(image_sums(picture.snapshot));
    for (std::size_t k = 0; k < layers.size(); ++k) {
      if (layers[k] != kSplats) {
        out[k].push_back(image_sums(*core::share_of(picture.snapshot, layers[k])));
        continue;
      }
      core::SplatState splats = picture.film->splats();
      for (auto& tile : splats.tiles) {
        tile.clear();
      }
      picture.film->restore_splats(std::move(splats));
      const Blocks others(1, image_sums(picture.film->snapshot()));
      out[k].push_back(plus(Blocks(1, out.back().back()), -1, others).front());
    }
  }
  return out;
}

Blocks blocks_of(core::View view, int first_seed, int samples) {
  return layers_of(std::move(view), first_seed, samples, {}).front();
}

Blocks replicates_of(core::View view, int replicates, int samples) {
  view.settings.replicates = replicates;
  const core::FilmSnapshot film = render(view, replicates * samples).snapshot;
  Blocks out;
  for (int r = 0; r < replicates; ++r) {
    out.push_back(sums_of(film, [&film, replicates, r](std::size_t p) {
      const core::ReplicatePixel& pixel =
          film.pixels[p * static_cast<std::size_t>(replicates) + static_cast<std::size_t>(r)];
      return core::Rgb{pixel.mean_r, pixel.mean_g, pixel.mean_b};
    }));
  }
  return out;
}

Blocks plus(Blocks a, double factor, const Blocks& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t k = 0; k < a[i].size(); ++k) {
      a[i][k] += factor * b[i][k];
    }
  }
  return a;
}

double Agreement::p() const { return std::min(1.0, 3 * std::min({image, block, squares})); }

Agreement compare(const Blocks& a, const Blocks& b) {
  Agreement out;
  for (std::size_t k = 0; k < std::tuple_size_v<BlockSums>; ++k) {
    const Moments of_a = column(a, k);
    const Moments of_b = column(b, k);
    const double p = welch_p(of_a, of_b);
    if (k < kImage) {
      out.block = std::min(out.block, kImage * p);
      continue;
    }
    out.image = std::min(out.image, 3 * p);
    const double error = std::hypot(of_a.standard_error(), of_b.standard_error());
    out.error = std::max(out.error, error > 0 ? error / of_b.mean : 0);
  }
  if (std::min(out.image, out.block) > 1.0 / kPermutationsMost) {
    out.squares = squares_p(a, b);  // otherwise it could not be smaller
  }
  return out;
}

bool agrees(const Agreement& a, int comparisons) { return a.p() > sidak(0.001, comparisons); }

void expect_agreement(const Agreement& a, int comparisons, const std::string& name) {
  std::printf("    %s: error %.2f%%, p %.2g\n", name.c_str(), 100 * a.error, a.p());
  EXPECT_TRUE(agrees(a, comparisons))
      << name << ": image " << a.image << ", block " << a.block << ", squares " << a.squares;
  EXPECT_LT(a.error, kErrorMost) << name << " is too noisy for a decision";
}

}  // namespace test_support
