#include "tests/render/agreement.h"

#include <algorithm>
#include <cmath>

namespace test_support {

using core::Rgb;

Blocks blocks_of(core::View view, int first_seed, int samples) {
  Blocks blocks(3 * kBlocks);
  const auto side = static_cast<std::size_t>(view.settings.film.width);
  for (int i = 0; i < kAgreementSeeds; ++i) {
    view.settings.seed = static_cast<std::uint64_t>(first_seed + i);
    const auto film = render(view, samples).snapshot;
    std::vector<double> sums(3 * kBlocks, 0.0);
    for (std::size_t p = 0; p < film.pixel_count(); ++p) {
      const std::size_t block =
          p / side * kBlocksAcross / side * kBlocksAcross + p % side * kBlocksAcross / side;
      const Rgb v = core::pixel_value(film, p).mean;
      for (std::size_t c = 0; c < 3; ++c) {
        sums[3 * block + c] += static_cast<double>(v[static_cast<int>(c)]);
      }
    }
    for (std::size_t k = 0; k < sums.size(); ++k) {
      blocks[k].add(sums[k]);
    }
  }
  return blocks;
}

Agreement compare(const Blocks& a, const Blocks& b, std::size_t channel) {
  std::vector<double> p_values;
  for (std::size_t k = channel; k < a.size(); k += 3) {
    const double va = a[k].variance() / kAgreementSeeds;
    const double vb = b[k].variance() / kAgreementSeeds;
    if (!(va + vb > 0)) {
      continue;
    }
    const double t = (a[k].mean - b[k].mean) / std::sqrt(va + vb);
    const double dof = (va + vb) * (va + vb) / ((va * va + vb * vb) / (kAgreementSeeds - 1));
    p_values.push_back(2 * (1 - student_t_cdf(std::fabs(t), dof)));
  }
  Agreement out;
  for (const double p : p_values) {
    out.least_p = std::min(out.least_p, p);
  }
  out.ks = ks_uniform(p_values);
  return out;
}

}  // namespace test_support
