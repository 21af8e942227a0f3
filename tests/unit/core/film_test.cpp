#include "core/film/film.h"

#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/denoise/statistical.h"
#include "core/error/pixel_error.h"
#include "core/film/filter.h"
#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"
#include "core/render/picture/tile_fill.h"
#include "core/render/task/settle.h"
#include "core/settings/choices.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Film;
using core::FilmSettings;
using core::PixelRect;
using core::TileState;

FilmSettings size(int width, int height) {
  return {.width = width, .height = height, .crop = {}, .filter = {}, .shares = {}};
}

TEST(TileRects, AreAlignedWithTheFullFilmAndCoverTheCropOnce) {
  const PixelRect crop = {30, 10, 70, 60};
  int area = 0;
  for (const PixelRect& r : core::tile_rects(crop)) {
    EXPECT_EQ(r.x / core::kTileSize, (r.x + r.width - 1) / core::kTileSize);
    EXPECT_EQ(r.y / core::kTileSize, (r.y + r.height - 1) / core::kTileSize);
    EXPECT_GE(r.x, crop.x);
    EXPECT_LE(r.x + r.width, crop.x + crop.width);
    area += r.width * r.height;
  }
  EXPECT_EQ(area, crop.width * crop.height);
  EXPECT_EQ(core::tile_rects(crop).size(), 4U * 3U);
}

TEST(Film, CommitsIncreaseRevisionsAndRestoreKeepsThem) {
  Film film(size(64, 32), 2);
  EXPECT_EQ(film.commit(0, film.tile(0)), 1U);
  EXPECT_EQ(film.commit(1, film.tile(1)), 2U);
  EXPECT_EQ(film.commit(0, film.tile(0)), 3U);
  Film again(size(64, 32), 2);
  for (int t = 0; t < 2; ++t) {
    again.restore(t, film.tile(t), film.tile_revision(t));
  }
  EXPECT_EQ(again.revision(), 3U);
  EXPECT_EQ(again.commit(1, again.tile(1)), 4U);
}

TEST(Film, CountsTimeOfDiscardedSamples) {
  core::FilmSettings settings;
  settings.width = settings.height = 8;
  core::Film film(settings, 2);
  core::TileState state = film.tile(0);
  state.samples = 2;
  state.cpu_seconds = 1;
  const core::TileState before = state;
  film.commit(0, before);
  state.samples = 4;
  state.cpu_seconds = 2.5;
  film.commit(0, state);
  film.commit(0, before);
  EXPECT_EQ(film.tile(0).cpu_seconds, 1);
  EXPECT_EQ(film.cpu_seconds(), 2.5);
}

TEST(Film, DigestCoversOnlyTheContent) {
  Film a(size(40, 40), 2);
  Film b(size(40, 40), 2);
  for (Film* film : {&a, &b}) {
    for (int t = 0; t < film->tile_count(); ++t) {
      TileState state = film->tile(t);
      state.samples = 2;
      state.pixels[0].mean_g = 0.25F;
      state.cpu_seconds = film == &a ? 1 : 2;
      state.rays = film == &a ? 10 : 20;
      film->commit(t, state);
    }
  }
  EXPECT_EQ(a.digest(), b.digest());
  TileState state = b.tile(3);
  state.pixels[1].m2_luminance = 1e-30F;
  b.commit(3, state);
  EXPECT_NE(a.digest(), b.digest());
}

TEST(Film, MeanOfEqualCountsIsExact) {
  for (const int width : {33, 70, 97, 160}) {
    Film film(size(width, 90), 2);
    for (int t = 0; t < film.tile_count(); ++t) {
      TileState state = film.tile(t);
      for (core::ReplicatePixel& pixel : state.pixels) {
        pixel.count = 32;
      }
      film.commit(t, state);
    }
    EXPECT_EQ(film.sample_counts().mean, 64.0) << width;
  }
}

TEST(Film, SnapshotOfARectangleContainsItsPixels) {
  const FilmSettings settings = size(70, 50);
  Film film(settings, 2);
  for (int t = 0; t < film.tile_count(); ++t) {
    TileState state = film.tile(t);
    for (int y = 0; y < state.rect.height; ++y) {
      for (int x = 0; x < state.rect.width; ++x) {
        for (int r = 0; r < 2; ++r) {
          auto& p = state.pixels[static_cast<std::size_t>((y * state.rect.width + x) * 2 + r)];
          p.mean_r = static_cast<float>(1000 * (y + state.rect.y) + x + state.rect.x);
          p.mean_b = static_cast<float>(r);
          p.count = 1;
        }
      }
    }
    film.commit(t, state);
  }
  const auto snapshot = film.snapshot({29, 25, 10, 12});
  for (int y = 0; y < 12; ++y) {
    for (int x = 0; x < 10; ++x) {
      const auto value = core::pixel_value(snapshot, static_cast<std::size_t>(y * 10 + x));
      EXPECT_EQ(value.mean.r, static_cast<float>(1000 * (y + 25) + x + 29));
      EXPECT_EQ(value.mean.b, 0.5F);
      EXPECT_EQ(value.count, 2U);
    }
  }
}

TEST(Film, OneHalfGivesAnImageButNoError) {
  core::FilmSnapshot snapshot;
  snapshot.rect = {0, 0, 2, 1};
  snapshot.pixels.resize(4);
  snapshot.pixels[0] = {3, 2, 1, 1, 0, 1};
  snapshot.pixels[2] = {3, 2, 1, 1, 0, 1};
  EXPECT_EQ(core::pixel_value(snapshot, 0).mean.r, 3);
  const auto variance = core::layer_image(snapshot, "variance");
  const auto error = core::layer_image(snapshot, "error");
  ASSERT_TRUE(variance && error);
  EXPECT_TRUE(std::isnan(variance->values[0]));
  EXPECT_TRUE(std::isnan(error->values[0]));
}

// Samples 1 and 3 in A, 2, 2 and 5 in B: squared deviations 2 and 6 with 1 + 2 degrees of freedom.
TEST(Film, SampleVarianceIsThatOfTheMean) {
  core::FilmSnapshot film;
  film.rect = {0, 0, 1, 1};
  film.pixels = {{2, 2, 2, 1, 2, 2}, {3, 3, 3, 1, 6, 3}};
  const core::SampleVariance both = core::sample_variance(film, 0);
  EXPECT_EQ(both.degrees, 3);
  EXPECT_NEAR(both.of_mean, 0.25 * 8 / 3 * (1.0 / 2 + 1.0 / 3), 1e-12);
  film.pixels[1] = {};
  EXPECT_NEAR(core::sample_variance(film, 0).of_mean, 2.0 / 2, 1e-12);
  film.pixels[0].count = 1;
  EXPECT_EQ(core::sample_variance(film, 0).degrees, 0);
}

TEST(Film, VarianceIsAQuarterOfTheSquaredDifferenceOfTheHalves) {
  core::FilmSnapshot snapshot;
  snapshot.rect = {0, 0, 1, 1};
  snapshot.replicates = 4;
  snapshot.pixels = {
      {1, 0, 0, 1, 0, 2}, {3, 0, 0, 1, 0, 2}, {2, 0, 0, 1, 0, 2}, {6, 0, 0, 1, 0, 2}};
  EXPECT_FLOAT_EQ(core::half_value(snapshot, 0, 0).mean.r, 1.5F);
  EXPECT_FLOAT_EQ(core::half_value(snapshot, 0, 1).mean.r, 4.5F);
  EXPECT_FLOAT_EQ(core::pixel_value(snapshot, 0).mean.r, 3);
  EXPECT_FLOAT_EQ(core::layer_image(snapshot, "variance")->values[0], 9.0F / 4);
}

// A value of 1e38 in one half: its square overflows float.
TEST(Film, NoLayerIsInfiniteIfTheVarianceOverflows) {
  core::FilmSnapshot snapshot;
  snapshot.rect = {0, 0, 2, 1};
  snapshot.pixels.resize(4);
  core::PathSample sample;
  for (int s = 0; s < 4; ++s) {
    sample.radiance = core::Rgb(s == 0 ? 1e38F : 0.0F);
    core::add_sample(snapshot.pixels[static_cast<std::size_t>(s % 2)], sample);
    sample.radiance = core::Rgb(1);
    core::add_sample(snapshot.pixels[static_cast<std::size_t>(2 + s % 2)], sample);
  }
  EXPECT_TRUE(std::isfinite(snapshot.pixels[0].m2_luminance));
  for (const char* layer : {"beauty", "variance", "error"}) {
    const auto image = core::layer_image(snapshot, layer);
    ASSERT_TRUE(image);
    for (const float value : image->values) {
      EXPECT_TRUE(std::isfinite(value)) << layer;
    }
  }
  EXPECT_EQ(core::layer_image(snapshot, "variance")->values[0], std::numeric_limits<float>::max());
  const core::PixelError error = core::pixel_error(snapshot, 0, 0);
  // The halves are 5e37 and 0 in one of the two pooled pixels.
  EXPECT_NEAR(static_cast<double>(error.standard_error.g) / 2.5e37, std::sqrt(0.5), 1e-6);
  for (const core::TileSums& tile : core::half_sums(snapshot)) {
    EXPECT_TRUE(std::isfinite(tile.grain));
    EXPECT_TRUE(std::isfinite(tile.doubt));
  }
}

// Layers are computed in bands of rows; the error pools pixels across adjacent bands.
core::DenoisedInput denoised_input(const core::Film& film) {
  auto made =
      core::denoise(film.snapshot(), nullptr, core::StatisticalDenoiser(), core::parallel_for(1));
  EXPECT_TRUE(made);
  return {std::make_shared<const core::DenoisedPicture>(std::move(made->picture)),
          core::DenoiseMode::kMixed};
}

void record_all(core::FilmSettings& film) {
  for (const auto& layer : core::layers()) {
    if (layer.recorded != nullptr) {
      film.*layer.recorded = true;
    }
  }
}

TEST(Film, LayersComputedByRowsEqualThoseOfTheWholeImage) {
  core::View view = test_support::cornell_view(40, 75, 35);
  record_all(view.settings.film);
  const auto picture = test_support::render(view, 4);
  const core::PixelRect rect = {3, 5, 30, 70};
  core::FilmSnapshot snapshot = picture.film->snapshot(rect);
  snapshot.error_floor = picture.film->error_floor();
  std::vector<std::optional<std::string>> layers = {std::nullopt};
  for (const auto& layer : core::layers()) {
    layers.emplace_back(std::string(layer.name));
  }
  const core::DenoisedInput denoised = denoised_input(*picture.film);
  for (const auto& layer : layers) {
    const auto whole =
        layer
            ? core::layer_image(snapshot, *layer, &denoised)
            : core::Result<core::FloatImage>(core::all_layers_image(snapshot, view.settings.film));
    auto made = core::LayerRows::create(*picture.film, rect, layer, view.settings.film,
                                        {.denoised = denoised});
    ASSERT_TRUE(whole && made) << layer.value_or("all");
    const core::ImageRows rows = made->rows();
    ASSERT_EQ(rows.channel_names, whole->channel_names);
    ASSERT_EQ(rows.height, 70);
    for (const int y : {0, 31, 32, 33, 69, 1, 64}) {
      const float* row = rows.row(y);
      for (std::size_t i = 0; i < whole->index(0, 1, 0); ++i) {
        const float expected = whole->values[whole->index(0, y, 0) + i];
        ASSERT_NEAR(row[i], expected, 1e-5F * std::abs(expected)) << layer.value_or("all") << y;
      }
    }
  }
  EXPECT_FALSE(core::LayerRows::create(*picture.film, rect, "no such layer", view.settings.film));
}

TEST(Film, EveryRegisteredLayerIsAnImage) {
  core::View view = test_support::cornell_view(8, 8, 35);
  record_all(view.settings.film);
  const auto picture = test_support::render(view, 2);
  for (const auto& layer : core::layers()) {
    const core::DenoisedInput denoised = denoised_input(*picture.film);
    const auto image = core::layer_image(picture.snapshot, std::string(layer.name), &denoised);
    ASSERT_TRUE(image) << layer.name;
    EXPECT_EQ(!core::layer_image(picture.snapshot, std::string(layer.name)),
              layer.fill_denoised != nullptr)
        << layer.name;
    EXPECT_EQ(image->channel_names.size(), layer.channels.size()) << layer.name;
  }
  EXPECT_FALSE(core::layer_image(picture.snapshot, "no such layer"));
}

// The film's running statistics equal the textbook formulas, over 500 samples of a noisy pixel.
TEST(Film, MeanAndM2MatchTheSamples) {
  core::View view = test_support::cornell_view(1, 1, 35);
  view.settings.sampler = core::SamplerType::kIndependent;
  // Compares films of n and n + 1 samples: the differences of their sums are the samples.
  test_support::Moments moments[2];
  double before[2] = {};
  const auto renderer = test_support::settled_renderer(view);
  ASSERT_TRUE(renderer);
  Film film(view.settings.film, 2);
  TileState state = film.tile(0);
  for (int s = 1; s <= 500; ++s) {
    ASSERT_TRUE((*renderer)->render(state, s, {}));
    const auto r = static_cast<std::size_t>((s - 1) % 2);
    const core::ReplicatePixel& p = state.pixels[r];
    const double luminance = static_cast<double>(core::luminance({p.mean_r, p.mean_g, p.mean_b}));
    const double total = luminance * p.count;
    moments[r].add(total - before[r]);
    before[r] = total;
  }
  for (std::size_t r = 0; r < 2; ++r) {
    EXPECT_NEAR(static_cast<double>(state.pixels[r].m2_luminance), moments[r].m2,
                1e-3 * moments[r].m2);
    EXPECT_EQ(state.pixels[r].count, 250U);
  }
}

/// Truth 17: the sampled positions, with their weights, reproduce the filter. Histogram in 64 cells
/// over the square, one axis at a time; z below 4.5 in each: false alarm 5 x 64 x 2 x 7e-6 = 0.4%.
TEST(Filter, ImpulseResponseIsTheFilter) {
  for (const auto& row : core::filters()) {
    const core::FilterSampler filter({row.value, 1.7F});
    constexpr int kCells = 64;
    constexpr int kSamples = 400000;
    double sum[2][kCells] = {};
    double squares[2][kCells] = {};
    double total = 0;
    test_support::Random random(5);
    for (int i = 0; i < kSamples; ++i) {
      const auto at = filter.sample(random.uniform_2d());
      const double w = static_cast<double>(at.weight);
      total += w;
      const float offset[2] = {at.offset_px.x, at.offset_px.y};
      for (std::size_t axis = 0; axis < 2; ++axis) {
        const int cell =
            std::clamp(static_cast<int>((offset[axis] / 1.7F + 1) / 2 * kCells), 0, kCells - 1);
        sum[axis][cell] += w;
        squares[axis][cell] += w * w;
      }
    }
    double integral = 0;
    double expected[kCells];
    for (int c = 0; c < kCells; ++c) {
      expected[c] = 0;
      for (int k = 0; k < 100; ++k) {
        const float x =
            ((static_cast<float>(c) + (static_cast<float>(k) + 0.5F) / 100) / kCells * 2 - 1) *
            1.7F;
        expected[c] += static_cast<double>(filter.evaluate(x));
      }
      integral += expected[c];
    }
    for (std::size_t axis = 0; axis < 2; ++axis) {
      for (int c = 0; c < kCells; ++c) {
        const double truth = expected[c] / integral;
        const double mean = sum[axis][c] / kSamples;
        const double error =
            std::sqrt(std::max(squares[axis][c] / kSamples - mean * mean, 1e-12) / kSamples);
        EXPECT_LT(std::fabs(mean - truth), 4.5 * error + 2e-5) << row.name << " cell " << c;
      }
    }
    if (row.value != core::FilterType::kMitchell) {
      EXPECT_EQ(total, kSamples) << "weights other than 1 add noise";
    }
  }
}

TEST(Filter, KeepsAConstantImageConstant) {
  for (const auto& row : core::filters()) {
    core::View view = test_support::view_of(core::SceneDescription(), 16, 16);
    view.environment = test_support::constant_sky({0.3F, 1, 7});
    view.settings.film.filter = {row.value, 2};
    const auto picture = test_support::render(view, 64);
    if (row.value == core::FilterType::kMitchell) {
      // Signed weights: unbiased. |z| < 4 in each channel: 0.02% false alarm.
      EXPECT_LT(std::fabs(picture.mean().g - 1), 4 * picture.standard_error().g) << row.name;
      continue;
    }
    for (std::size_t i = 0; i < picture.snapshot.pixel_count(); ++i) {
      const core::Rgb c = core::pixel_value(picture.snapshot, i).mean;
      EXPECT_NEAR(c.r, 0.3F, 1e-6);
      EXPECT_NEAR(c.g, 1, 1e-6);
      EXPECT_NEAR(c.b, 7, 7e-6);
    }
  }
}

}  // namespace
