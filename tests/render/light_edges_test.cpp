// What the scene says of pixels that see lights in part, against pictures of nothing but lights.
#include <gtest/gtest.h>

#include <cmath>

#include "core/render/render_task.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;

/// Three lamps before black, one of them of a third of a pixel, and a ball before a bright sky.
core::View lamps(bool sky) {
  core::View view = test_support::view_of(
      test_support::build(test_support::scene_of({test_support::emitter(Rgb(100, 50, 20)), test_support::lambert(Rgb(0.5F))},
                                                 {test_support::quad({-0.8F, 0.3F, 0}, {0.31F, 0.1F, 0}, {-0.1F, 0.25F, 0}, 0),
                                                  test_support::quad({0.3F, 0.4F, 0}, {0.03F, 0, 0}, {0, 0.03F, 0}, 0),
                                                  test_support::quad({0.2F, -0.5F, 0}, {0.5F, 0, 0}, {0, 0.05F, 0}, 0),
                                                  test_support::sphere({-0.4F, -0.4F, 0}, 0.3F, 16, false, 1)})), 40, 40);
  test_support::look_at(view, {0, 0, 3}, {0, 0, 0}, 40);
  if (sky) {
    view.environment = test_support::constant_sky(Rgb(2));
  }
  view.settings.max_depth = 0;
  return view;
}

struct Disagreement {
  int edges = 0;
  int off = 0;     ///< edges that the picture contradicts
  int missed = 0;  ///< pixels that see a light in part, noticeably, and are no edge
};

Disagreement compare(const core::View& view, const core::View& pictured) {
  constexpr int kSamples = 1024;
  const auto renderer = core::Renderer::create(view);
  const core::LightEdges edges = (*renderer)->light_edge_search()->finish({});
  const auto film = test_support::render(pictured, kSamples).snapshot;
  Disagreement out;
  out.edges = static_cast<int>(edges.size());
  std::vector<char> is_edge(film.pixel_count());
  for (const core::LightEdge& edge : edges) {
    is_edge[edge.pixel] = 1;
    const auto seen = static_cast<double>(luminance(core::pixel_value(film, edge.pixel).mean));
    const auto said = static_cast<double>(luminance(edge.mean));
    const auto spread = static_cast<double>(edge.variance);
    // Four standard deviations of independent samples, and 3 % of one sample's for the grid of the edges themselves.
    out.off += std::abs(seen - said) > 4 * std::sqrt(spread / kSamples) + 0.03 * std::sqrt(spread) ? 1 : 0;
  }
  for (std::size_t i = 0; i < film.pixel_count(); ++i) {
    const auto mean = static_cast<double>(luminance(core::pixel_value(film, i).mean));
    out.missed += is_edge[i] == 0 && core::sample_variance(film, i).of_mean * kSamples > 0.2 * (mean * mean + 0.01) ? 1 : 0;
  }
  return out;
}

TEST(LightEdges, AreWhatThePictureShows) {
  for (const bool sky : {false, true}) {
    for (const core::FilterType type : {core::FilterType::kBlackmanHarris, core::FilterType::kBox, core::FilterType::kMitchell}) {
      core::View view = lamps(sky);
      view.settings.film.filter = {type, type == core::FilterType::kMitchell ? 2.0F : 1.5F};
      const Disagreement d = compare(view, view);
      EXPECT_GT(d.edges, 60);
      EXPECT_EQ(d.off, 0);
      // Slivers are met by chance. Samples of a filter with negative lobes differ under a constant sky, too.
      EXPECT_TRUE(d.missed < 0.05 * d.edges || (sky && type == core::FilterType::kMitchell)) << d.missed << " of " << d.edges;
    }
  }
}

TEST(LightEdges, OfACropAreThoseOfItsPixels) {
  core::View view = lamps(true);
  view.settings.film.crop = core::PixelRect{4, 6, 30, 25};
  const Disagreement d = compare(view, view);
  EXPECT_GT(d.edges, 30);
  EXPECT_EQ(d.off, 0);
  EXPECT_LT(d.missed, 0.05 * d.edges);
}

TEST(LightEdges, AreWhatLightsShowWhateverTheSurfacesDo) {
  core::View view = lamps(false);
  view.settings.max_depth = 5;  // the ball is lit now
  EXPECT_EQ(compare(view, lamps(false)).off, 0);
}

TEST(LightEdges, OfAnotherFilterAreSeenToBeWrong) {
  core::View other = lamps(false);
  other.settings.film.filter = {core::FilterType::kBox, 2.0F};
  EXPECT_GT(compare(other, lamps(false)).off, 10);
}

}  // namespace
