#include "core/film/splats.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/film/film_format.h"
#include "core/film/film_merge.h"
#include "core/integrators/registry.h"
#include "core/render/task/settle.h"
#include "tests/support/caustic.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"
#include "tests/support/tasks.h"

namespace {

using core::Film;
using core::LightBatch;
using core::Rgb;
using core::SplatPixel;
using test_support::samples;

constexpr int kWidth = 80;
constexpr int kHeight = 40;

core::FilmSettings settings_of(std::optional<core::PixelRect> crop = {}) {
  return {.width = kWidth, .height = kHeight, .crop = crop, .filter = {}, .shares = {}};
}

Film splat_film(std::optional<core::PixelRect> crop = {}, int replicates = 2) {
  return {settings_of(crop), replicates, core::PixelErrors::kCorrelated, true};
}

LightBatch batch_of(int unit, int samples, int replicates = 2) {
  LightBatch light;
  light.unit = unit;
  light.last_sample = samples;
  light.splats.resize(static_cast<std::size_t>(replicates));
  return light;
}

/// Adds one black camera sample in every replicate.
void fill_black(Film& film) {
  for (int t = 0; t < film.tile_count(); ++t) {
    core::TileState state = film.tile(t);
    state.samples = film.replicates();
    for (core::ReplicatePixel& p : state.pixels) {
      p.count = 1;
    }
    film.commit(t, std::move(state));
  }
}

TEST(Splats, SumsAreIndependentOfTheOrder) {
  test_support::Random random(1);
  std::vector<Rgb> values;
  for (int i = 0; i < 10000; ++i) {
    const float size = std::exp2(60 * random.uniform() - 30);
    values.push_back({size, -size * random.uniform(), random.uniform()});
  }
  SplatPixel forwards;
  SplatPixel backwards;
  std::vector<float> floats(2, 0.0F);
  for (std::size_t i = 0; i < values.size(); ++i) {
    core::add_splat(forwards, values[i]);
    core::add_splat(backwards, values[values.size() - 1 - i]);
    floats[0] += values[i].r;
    floats[1] += values[values.size() - 1 - i].r;
  }
  EXPECT_EQ(forwards.sum, backwards.sum);
  EXPECT_NE(floats[0], floats[1]) << "the order must matter for float sums";
}

TEST(Splats, LargestSumOfTheLargestFilmFits) {
  SplatPixel pixel;
  core::add_splat(pixel, Rgb(std::nextafter(core::kSplatMax, 0.0F)));
  const core::SplatSum most = std::numeric_limits<core::SplatSum>::max();
  EXPECT_LT(pixel.sum[0], most >> 52U);
}

TEST(Splats, RejectsAndCountsNonFiniteAndTooLargeValues) {
  LightBatch light = batch_of(0, 2);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), core::kSplatMax,
                          -core::kSplatMax, std::numeric_limits<float>::infinity()}) {
    light.add(0, {1, 1, {0, bad, 0}});
  }
  light.add(1, {1, 1, Rgb(1)});
  EXPECT_EQ(light.rejected_samples, 4U);
  EXPECT_TRUE(light.splats[0].empty());
  EXPECT_EQ(light.splats[1].size(), 1U);
  Film film = splat_film();
  film.commit(0, film.tile(0), light);
  EXPECT_EQ(film.rejected_samples(), 4U);
  EXPECT_TRUE(core::rejected_warning(4).starts_with("4 samples count as zero, "));
}

// 80 x 40 pixels in units of 32 x 32: unit 2 has 16 x 32 of them. 4 samples of it are 2 paths for
// each of its pixels in a replicate: 1024 of 3200 pixels, so 1 / (1024 / 3200) for each splat.
TEST(Splats, PixelValueIsTheSumOverPathsPerPixelOfTheFilm) {
  Film film = splat_film();
  fill_black(film);
  LightBatch light = batch_of(2, 4);
  light.add(0, {70, 5, {0.5F, 0, 2}});
  light.add(0, {70, 5, {0.25F, 0, 0}});
  light.add(1, {70, 5, {0.25F, 1, 0}});
  film.commit(2, film.tile(2), light);
  const core::FilmSnapshot snapshot = film.snapshot({70, 5, 1, 1});
  const Rgb a = core::half_value(snapshot, 0, 0).mean;
  const Rgb b = core::half_value(snapshot, 0, 1).mean;
  EXPECT_FLOAT_EQ(a.r, 0.75F * 3200 / 1024);
  EXPECT_FLOAT_EQ(a.b, 2.0F * 3200 / 1024);
  EXPECT_FLOAT_EQ(b.g, 1.0F * 3200 / 1024);
  EXPECT_EQ(film.shown_tile(2)->pixels[2 * (5 * 16 + 6)].mean_r, a.r);
}

TEST(Splats, UnitsCoverTheFullFilmUnderACropAndOutsideSplatsAreDropped) {
  const Film whole = splat_film();
  Film film = splat_film(core::PixelRect{40, 4, 8, 8});
  EXPECT_EQ(film.tile_count(), 1);
  EXPECT_EQ(film.unit_count(), whole.unit_count());
  EXPECT_EQ(film.unit_rect(0), whole.unit_rect(1));
  LightBatch light = batch_of(0, 2);
  for (const auto& [x, y] : {std::pair{39, 4}, {48, 4}, {40, 3}, {40, 12}, {0, 0}, {79, 39}}) {
    light.add(0, {x, y, Rgb(1)});
  }
  light.add(0, {47, 11, Rgb(1)});
  film.commit_light({&light, 1});
  const core::SplatState splats = film.splats();
  core::SplatSum sum = 0;
  for (const SplatPixel& p : splats.tiles[0]) {
    sum += p.sum[0];
  }
  EXPECT_EQ(sum, core::SplatSum{1} << 40U);
  EXPECT_EQ(splats.tiles[0].back().sum[0], 0) << "replicate 1";
  EXPECT_EQ(splats.tiles[0][splats.tiles[0].size() - 2].sum[0], sum);
  EXPECT_EQ(film.light_samples(0), 2);
}

TEST(Splats, AreKeptByFilmFilesAndMerges) {
  const auto made = [](std::uint64_t seed) {
    auto film = std::make_shared<Film>(settings_of(), 2, core::PixelErrors::kCorrelated, true);
    fill_black(*film);
    LightBatch light = batch_of(1, 2);
    light.rays = 5;
    light.add(0, {3, 3, Rgb(static_cast<float>(seed) * 1e9F)});
    light.add(1, {70, 30, {0, 0, -1e-9F}});
    film->commit(1, film->tile(1), light);
    return core::FilmPart{film, core::ledger_of(*film, seed, 0)};
  };
  const std::vector<core::FilmPart> parts = {made(1), made(2)};
  const auto merged = core::merge_films(parts, 64);
  ASSERT_TRUE(merged) << merged.error().message;
  std::vector<std::byte> file;
  ASSERT_TRUE(core::write_film(*merged, "", [&](std::span<const std::byte> piece) {
    file.insert(file.end(), piece.begin(), piece.end());
    return true;
  }));
  EXPECT_EQ(file.size(), core::film_file_bytes(*merged->film, merged->ledger, 0));
  const auto read = core::read_film(file, {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->part.film->digest(), merged->film->digest());
  EXPECT_EQ(read->part.film->rays(), 10U);
  const core::FilmSnapshot both = read->part.film->snapshot({3, 3, 1, 1});
  const core::FilmSnapshot second = parts[1].film->snapshot({3, 3, 1, 1});
  EXPECT_EQ(both.pixels[2].mean_r, second.pixels[0].mean_r);
  EXPECT_EQ(both.pixels[3].mean_r, 0);
  const auto plain = std::make_shared<Film>(settings_of(), 2);
  const std::vector<core::FilmPart> mixed = {parts[0], {plain, core::ledger_of(*plain, 3, 0)}};
  EXPECT_FALSE(core::merge_films(mixed, 64));
}

core::View light_view() {
  core::View view = test_support::caustic();
  view.settings.film.width = 72;
  view.settings.film.height = 40;
  view.settings.integrator = "light-trace";
  return view;
}

TEST(LightPaths, CropEqualsTheCropOfTheFullImage) {
  core::View view = light_view();
  view.settings.film.filter = {core::FilterType::kMitchell, 2};
  const auto full = test_support::render(view, 4).film;
  view.settings.film.crop = core::PixelRect{40, 10, 20, 25};
  const auto crop = test_support::render(view, 4).film;
  const core::FilmSnapshot a = full->snapshot(*view.settings.film.crop);
  const core::FilmSnapshot b = crop->snapshot();
  for (std::size_t i = 0; i < b.pixels.size(); ++i) {
    ASSERT_EQ(a.pixels[i].mean_r, b.pixels[i].mean_r) << i;
    ASSERT_EQ(a.pixels[i].mean_g, b.pixels[i].mean_g) << i;
  }
  EXPECT_GT(b.pixels[0].mean_r, 0);
}

/// Tiles after some slices, and splats after half as many.
struct Checkpoint {
  std::shared_ptr<Film> film;
  core::SplatState splats;
};

Checkpoint checkpoint_after(const std::shared_ptr<const core::Renderer>& renderer, int slices) {
  Checkpoint out = {make_film(renderer->view().settings), {}};
  core::NullSink sink;
  core::RenderTask task(renderer, out.film, samples(8, 1e-4), sink);
  for (int i = 0; i < slices; ++i) {
    if (i == slices / 2) {
      out.splats = out.film->splats();
    }
    if (const auto slice = task.take()) {
      task.run(*slice);
    }
  }
  return out;
}

std::string digest_resumed_from(const std::shared_ptr<const core::Renderer>& renderer,
                                const Checkpoint& from) {
  const auto film = test_support::restored(*from.film);
  film->restore_splats(from.splats);
  core::NullSink sink;
  core::RenderTask task(renderer, film, samples(8, 1e-4), sink);
  core::run_to_end(task, 3);
  return film->digest();
}

// A checkpoint suffices at any time, also if tiles and splats are from different times, as when it
// is written while slices are committed.
TEST(LightPaths, FilmsAreIndependentOfRestarts) {
  const core::View view = light_view();
  const std::string calm = test_support::render(view, 8, 1).film->digest();
  const auto renderer = test_support::settled_renderer(view);
  ASSERT_TRUE(renderer);
  for (int taken = 3; taken < 40; taken += 9) {
    const Checkpoint from = checkpoint_after(*renderer, taken);
    EXPECT_EQ(digest_resumed_from(*renderer, from), calm) << taken;
  }
  // The planted fault: the splats of one tile are lost.
  Checkpoint torn = checkpoint_after(*renderer, 30);
  for (std::vector<SplatPixel>& tile : torn.splats.tiles) {
    std::vector<SplatPixel> zeros(tile.size());
    tile.swap(zeros);
    EXPECT_NE(digest_resumed_from(*renderer, torn), calm);
    tile.swap(zeros);
  }
}

TEST(LightPaths, RevisionsIncreaseForEveryTileAtTheEndOfAPass) {
  const auto film = test_support::render(light_view(), 2).film;
  std::uint32_t least = film->tile_revision(0);
  for (int t = 0; t < film->tile_count(); ++t) {
    least = std::min(least, film->tile_revision(t));
  }
  EXPECT_GT(least, film->revision() - static_cast<std::uint32_t>(film->tile_count()));
  EXPECT_TRUE(film->publish_splats().empty());
  EXPECT_TRUE(std::isfinite(core::ErrorEstimate(*film).image(0.95).relative));
}

}  // namespace
