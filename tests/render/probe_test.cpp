// Expected values of single pixels by samples of their own, against pictures of many samples.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "core/render/render_task.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;

core::View room(core::SamplerType sampler) {
  core::View view = test_support::view_of(test_support::build(test_support::cornell()), 24, 24);
  test_support::look_at(view, {0.5F, 0.5F, 2.2F}, {0.5F, 0.5F, 0}, 40);
  view.settings.max_depth = 4;
  view.settings.sampler = sampler;
  view.settings.film.crop = core::PixelRect{3, 5, 17, 13};
  return view;
}

std::vector<core::ProbedPixel> probe(const core::View& view, int samples) {
  std::vector<std::uint32_t> pixels;
  for (std::uint32_t i = 0; i < 17 * 13; i += 5) {
    pixels.push_back(i);
  }
  return (*core::Renderer::create(view))->probe(pixels, samples, {});
}

/// Pixels whose probe is more than 4.5 standard deviations of independent samples off the picture, by luminance: of 45 none is with
/// probability 0.9997, all the more as both converge faster.
int off(const core::FilmSnapshot& film, const std::vector<core::ProbedPixel>& probed, int samples, std::uint32_t shift = 0) {
  int out = 0;
  for (const core::ProbedPixel& p : probed) {
    const std::size_t i = (p.pixel + shift) % film.pixel_count();
    const auto d = static_cast<double>(luminance(p.mean()) - luminance(core::pixel_value(film, i).mean));
    const double of_film = core::sample_variance(film, i).of_mean;
    const double of_probe = of_film * static_cast<double>(core::pixel_value(film, i).count) / samples;
    out += std::abs(d) > 4.5 * std::sqrt(of_film + of_probe) + 1e-5 ? 1 : 0;
  }
  return out;
}

TEST(Probe, IsWhatThePictureConvergesTo) {
  for (const core::SamplerType sampler : {core::SamplerType::kSobol, core::SamplerType::kIndependent}) {
    const core::View view = room(sampler);
    const auto probed = probe(view, 1024);
    ASSERT_EQ(probed.size(), 45U);
    const auto film = test_support::render(view, 4096).snapshot;
    EXPECT_EQ(off(film, probed, 1024), 0);
    EXPECT_GT(off(film, probed, 1024, 17), 10) << "other pixels are not told apart";
  }
}

TEST(Probe, HasSamplesThatNoPictureHas) {
  const core::View view = room(core::SamplerType::kSobol);
  const auto probed = probe(view, 64);
  const auto film = test_support::render(view, 64).snapshot;
  for (const core::ProbedPixel& p : probed) {
    const float apart = std::abs(luminance(p.means[0]) - luminance(p.means[1]));
    if (apart == 0) {  // what is the same for all samples
      continue;
    }
    for (std::size_t half = 0; half < 2; ++half) {
      EXPECT_NE(luminance(p.means[half]), luminance(core::half_value(film, p.pixel, static_cast<int>(half)).mean));
    }
  }
}

TEST(Probe, IsTheSameWhenAskedAgain) {
  const core::View view = room(core::SamplerType::kSobol);
  const auto once = probe(view, 64);
  const auto again = probe(view, 64);
  for (std::size_t i = 0; i < once.size(); ++i) {
    EXPECT_EQ(once[i].means, again[i].means);
  }
}

TEST(Probe, IsNothingWhenStopped) {
  std::stop_source stop;
  stop.request_stop();
  const std::vector<std::uint32_t> pixels = {0, 1};
  EXPECT_TRUE((*core::Renderer::create(room(core::SamplerType::kSobol)))->probe(pixels, 64, stop.get_token()).empty());
}

}  // namespace
