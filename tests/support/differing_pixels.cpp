#include "tests/support/differing_pixels.h"

#include <algorithm>
#include <cmath>

#include "tests/support/scenes.h"

namespace test_support {

std::size_t differing_pixels(const core::View& waves, int width, const core::View& alone,
                             int samples_per_pixel, int threads) {
  core::View many = waves;
  many.wave_width = width;
  core::View one = alone;
  one.wave_width = 0;
  const Picture a = render(many, samples_per_pixel, threads);
  const Picture b = render(one, samples_per_pixel, threads);
  if (a.progress.rejected_samples != 0 || b.progress.rejected_samples != 0) {
    return a.snapshot.pixel_count();
  }
  const auto apart = [](float x, float y) {
    return !(std::fabs(x - y) <= 1e-3F * std::max(1.0F, std::fabs(y)));
  };
  std::size_t count = 0;
  for (std::size_t p = 0; p < a.snapshot.pixel_count(); ++p) {
    const core::HalfValue x = core::pixel_value(a.snapshot, p);
    const core::HalfValue y = core::pixel_value(b.snapshot, p);
    if (x.count != y.count) {
      return a.snapshot.pixel_count();
    }
    bool differs = apart(x.mean.r, y.mean.r) || apart(x.mean.g, y.mean.g) ||
                   apart(x.mean.b, y.mean.b) || apart(x.alpha, y.alpha);
    if (a.snapshot.recorded.aux) {
      const core::AuxPixel& l = a.snapshot.aux[p];
      const core::AuxPixel& m = b.snapshot.aux[p];
      differs = differs || l.hits != m.hits || apart(l.albedo.g, m.albedo.g) ||
                apart(l.normal_world.x, m.normal_world.x) || apart(l.depth_m, m.depth_m);
    }
    const std::size_t shares = a.snapshot.shares.size() / a.snapshot.pixel_count();
    for (std::size_t i = p * shares; i < (p + 1) * shares; ++i) {
      const core::Rgb s = a.snapshot.shares[i];
      const core::Rgb t = b.snapshot.shares[i];
      differs = differs || apart(s.r, t.r) || apart(s.g, t.g) || apart(s.b, t.b);
    }
    count += differs ? 1 : 0;
  }
  return count;
}

}  // namespace test_support
