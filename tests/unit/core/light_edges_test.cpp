#include "core/render/light_edges.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/samplers/hash.h"

namespace {

using core::LightEdge;
using core::LightEdges;
using core::PixelRect;
using core::Rgb;
using core::Vec2;

core::FilterSampler filter(core::FilterType type, float radius_px) {
  core::FilterSettings settings;
  settings.type = type;
  settings.radius_px = radius_px;
  return core::FilterSampler(settings);
}

/// Jittered places of a picture that is bright as told.
core::LightViewer viewer(const std::function<float(Vec2)>& bright) {
  return [bright](int x, int y, int i, int side) {
    const std::uint64_t h = core::mix_bits((static_cast<std::uint64_t>(static_cast<std::uint32_t>(x)) << 40) ^
                                           (static_cast<std::uint64_t>(static_cast<std::uint32_t>(y)) << 20) ^ static_cast<std::uint64_t>(i));
    const float step = 1 / static_cast<float>(side);
    const Vec2 at = {static_cast<float>(x) + (static_cast<float>(i % side) + core::to_unit_float(static_cast<std::uint32_t>(h >> 32))) * step,
                     static_cast<float>(y) + (static_cast<float>(i / side) + core::to_unit_float(static_cast<std::uint32_t>(h))) * step};
    return core::SeenLight{at, Rgb(bright(at))};
  };
}

const LightEdge* find(const LightEdges& edges, std::uint32_t pixel) {
  const auto found = std::find_if(edges.begin(), edges.end(), [pixel](const LightEdge& e) { return e.pixel == pixel; });
  return found == edges.end() ? nullptr : &*found;
}

LightEdges find_edges(const PixelRect& crop, const core::FilterSampler& f, core::LightViewer look, const std::stop_token& stop) {
  return core::LightEdgeSearch(crop, f, std::move(look)).finish(stop);
}

constexpr PixelRect kCrop = {100, 50, 32, 16};

TEST(LightEdges, OfAHalfPlaneUnderABoxAreItsColumn) {
  // Radiance 5 left of 110.3: the pixels 110 see 0.3 of it.
  const LightEdges edges = find_edges(kCrop, filter(core::FilterType::kBox, 0.5F),
                                                  viewer([](Vec2 at) { return at.x < 110.3F ? 5.0F : 0.0F; }), {});
  ASSERT_EQ(edges.size(), 16U);
  for (std::size_t k = 0; k < edges.size(); ++k) {
    EXPECT_EQ(edges[k].pixel, 32 * k + 10);
    EXPECT_NEAR(edges[k].coverage, 0.3, 0.01);
    EXPECT_NEAR(edges[k].mean.g, 1.5, 0.05);
    EXPECT_NEAR(edges[k].variance, 25 * 0.3 * 0.7, 0.2);
  }
}

/// Share of a filter of radius 1.5 that is below `x` pixels from its middle, by the midpoint rule.
double share_below(const core::FilterSampler& f, double x) {
  double below = 0;
  double all = 0;
  constexpr int kSteps = 30000;
  for (int i = 0; i < kSteps; ++i) {
    const double at = (i + 0.5) / kSteps * 3 - 1.5;
    const auto value = static_cast<double>(f.evaluate(static_cast<float>(at)));
    all += value;
    below += at < x ? value : 0;
  }
  return below / all;
}

TEST(LightEdges, KnowHowLittleTheTailOfTheFilterSees) {
  const core::FilterSampler f = filter(core::FilterType::kBlackmanHarris, 1.5F);
  const LightEdges edges =
      find_edges(kCrop, f, viewer([](Vec2 at) { return at.x < 110.3F ? 1000.0F : 0.0F; }), {});
  for (const int x : {109, 110, 111}) {
    const double share = share_below(f, 110.3 - (x + 0.5));
    const LightEdge* edge = find(edges, static_cast<std::uint32_t>(5 * 32 + x - 100));
    ASSERT_NE(edge, nullptr) << x;
    const double odd = std::min(share, 1 - share);  // a share of the light, or of what it does not cover
    EXPECT_NEAR(edge->mean.g, 1000 * share, 1000 * 0.06 * odd) << x << ": " << share;
    EXPECT_NEAR(edge->variance, 1e6 * share * (1 - share), 1e6 * 0.06 * odd) << x;
  }
  EXPECT_EQ(find(edges, 5 * 32 + 13), nullptr) << "out of the filter's reach";
}

TEST(LightEdges, OfASmoothSkyAreNone) {
  const auto edges = find_edges(kCrop, filter(core::FilterType::kBlackmanHarris, 1.5F),
                                            viewer([](Vec2 at) { return 1 + 0.001F * at.x; }), {});
  EXPECT_TRUE(edges.empty());
}

TEST(LightEdges, AreFoundFromLightsOutsideOfTheFilm) {
  const auto edges = find_edges(kCrop, filter(core::FilterType::kBox, 1.5F),
                                            viewer([](Vec2 at) { return at.x < 99.5F ? 3.0F : 0.0F; }), {});
  ASSERT_EQ(edges.size(), 16U);
  EXPECT_EQ(edges[0].pixel, 0U);
  EXPECT_NEAR(edges[0].coverage, 0.5 / 3, 0.01);
}

TEST(LightEdges, AreBoundedInNumberStrongestFirst) {
  const PixelRect large = {0, 0, 512, 128};
  const auto edges = find_edges(large, filter(core::FilterType::kBox, 0.5F), viewer([](Vec2 at) {
    // Stripes everywhere, brighter in the right half.
    return std::fmod(at.x, 1.0F) < 0.5F ? (at.x < 256 ? 1.0F : 100.0F) : 0.0F;
  }), {});
  EXPECT_EQ(edges.size(), 4096U + 512 * 128 / 32);
  EXPECT_TRUE(std::is_sorted(edges.begin(), edges.end(), [](const LightEdge& a, const LightEdge& b) { return a.pixel < b.pixel; }));
  EXPECT_TRUE(std::all_of(edges.begin(), edges.end(), [](const LightEdge& e) { return e.pixel % 512 >= 255; }));
}

// Lamps of half a pixel's width, one in 16 x 16 pixels. The twin: a large film looks in four places of a pixel, and misses some.
TEST(LightEdges, OfSmallLampsAreFoundOnSmallFilmsAlsoSparingly) {
  const auto found = [](int size) {
    core::LightEdgeSearch search({0, 0, size, size}, filter(core::FilterType::kBox, 0.5F), viewer([](Vec2 at) {
      const float x = std::fmod(at.x, 16.0F) - 7.4F;
      const float y = std::fmod(at.y, 16.0F) - 9.55F;
      return at.x > 0 && at.y > 0 && x * x + y * y < 0.25F * 0.25F ? 1000.0F : 0.0F;
    }));
    search.be_sparing();
    while (!search.knows(core::EdgeDetail::kPlans)) {
      search.step(core::EdgeDetail::kPlans);
    }
    int lamps = 0;
    for (int y = 9; y < size; y += 16) {
      for (int x = 7; x < size; x += 16) {
        lamps += find(search.edges(core::EdgeDetail::kPlans), static_cast<std::uint32_t>(y * size + x)) != nullptr ? 1 : 0;
      }
    }
    return lamps;
  };
  EXPECT_EQ(found(48), 9);
  EXPECT_LT(found(256), 256 * 95 / 100);
}

TEST(LightEdges, AreNoneWhenStopped) {
  std::stop_source source;
  source.request_stop();
  EXPECT_TRUE(find_edges(kCrop, filter(core::FilterType::kBox, 0.5F),
                                     viewer([](Vec2 at) { return at.x < 110.3F ? 5.0F : 0.0F; }), source.get_token())
                  .empty());
}

}  // namespace
