#include <gtest/gtest.h>

#include "server/store/film_file.h"
#include "tests/unit/server/film_files.h"

namespace {

using server::FilmFile;
using server::FilmRecord;
using test_support::FilmFiles;
using test_support::made_tile;
using test_support::small_film;

/// Adds the pixels of tiles without samples, as restoring a checkpoint with splats does.
void fill_missing(core::Film& film) {
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    film.restore(tile, film.tile(tile), film.tile_revision(tile));
  }
}

TEST_F(FilmFiles, RestoresSplatsWithTheirLightSamples) {
  const auto made = [] {
    return core::Film(small_film(), 2, core::PixelErrors::kCorrelated, true);
  };
  core::Film film = made();
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  core::LightBatch light;
  light.unit = 1;
  light.last_sample = 6;
  light.splats.resize(2);
  light.rays = 11;
  const core::PixelRect rect = film.tile_rect(0);
  light.add(1, {rect.x, rect.y, core::Rgb(0.5F)});
  film.commit(1, made_tile(film, 1, 6), light);
  ASSERT_TRUE(file->write(film, FilmRecord{}, false));
  core::Film again = made();
  ASSERT_TRUE(FilmFile::open(path)->restore(again));
  EXPECT_EQ(again.digest(), [&film] {
    fill_missing(film);
    return film.digest();
  }());
  EXPECT_EQ(again.light_samples(1), 6);
  EXPECT_EQ(again.light_samples(0), 0);
  EXPECT_EQ(again.splats().rays, 11U);
  core::Film other(small_film(), 2);
  EXPECT_FALSE(FilmFile::open(path)->restore(other)) << "a film without splats";
}

TEST_F(FilmFiles, RestoresAMeterFromTheNewestCompleteCheckpoint) {
  core::RenderSettings settings;
  settings.film = small_film();
  settings.meter.points.assign(20, {{0, 0, 0}, {0, 1, 0}});  // two chunks
  core::Film film(settings, core::PixelErrors::kIndependent, false);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  const auto chunk_of = [&film](int chunk, int samples) {
    core::MeterChunk made{.samples = samples, .sums = {}, .rays = 5};
    made.sums.assign(film.meter_sums(chunk), {0.5, 1, static_cast<double>(samples)});
    return made;
  };
  for (const int samples : {2, 4, 7}) {
    film.commit_meter(1, chunk_of(1, samples));
    ASSERT_TRUE(file->write(film, FilmRecord{}, false));
    core::Film again(settings, core::PixelErrors::kIndependent, false);
    ASSERT_TRUE(FilmFile::open(path)->restore(again));
    EXPECT_EQ(again.meter_chunk(0).samples, 0);
    EXPECT_EQ(again.meter_chunk(1).samples, samples);
    EXPECT_EQ(again.meter_chunk(1).sums, film.meter_chunk(1).sums);
    EXPECT_EQ(again.rays(), 5U);
  }
  core::Film other(small_film(), settings.replicates);
  EXPECT_FALSE(FilmFile::open(path)->restore(other)) << "a film without a meter";
}

TEST_F(FilmFiles, RestoresSharesOfTheLight) {
  core::FilmSettings settings = small_film();
  settings.shares = {{.layer = "bounce:1", .group = {}, .strategy = {}},
                     {.layer = "light:lamp", .group = "lamp", .strategy = {}}};
  core::Film film(settings, 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  core::TileState tile = made_tile(film, 1, 6);
  tile.shares.assign(tile.pixels.size() * 2, core::Rgb{0.25F, 0.5F, 0.75F});
  tile.shares.back() = {7, 8, 9};
  film.commit(1, std::move(tile));
  ASSERT_TRUE(file->write(film, FilmRecord{}, false));
  core::Film again(settings, 2);
  ASSERT_TRUE(FilmFile::open(path)->restore(again));
  EXPECT_EQ(again.tile(1).shares, film.tile(1).shares);
  EXPECT_EQ(again.tile(1).shares.back(), (core::Rgb{7, 8, 9}));
  core::Film other(small_film(), 2);
  EXPECT_FALSE(FilmFile::open(path)->restore(other)) << "a film without shares";
}

TEST_F(FilmFiles, RestoresLabelsAndMattes) {
  core::FilmSettings settings = small_film();
  settings.instance = settings.material_mattes = true;
  core::Film film(settings, 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  core::TileState tile = made_tile(film, 1, 6);
  tile.first_hits.back() = {3, 4, 5, 6, {1, 2, 3}, {0.5F, 0.25F}, {-1, 2}};
  tile.mattes.back()[0] = {77, {2, 1}};
  film.commit(1, std::move(tile));
  ASSERT_TRUE(file->write(film, FilmRecord{}, false));
  core::Film again(settings, 2);
  ASSERT_TRUE(FilmFile::open(path)->restore(again));
  EXPECT_EQ(again.digest(), film.digest());
  EXPECT_EQ(again.tile(1).first_hits.back().primitive, 6U);
  EXPECT_EQ(again.tile(1).mattes.back()[0].hits[0], 2U);
  settings.object_mattes = true;
  core::Film other(settings, 2);
  EXPECT_FALSE(FilmFile::open(path)->restore(other)) << "a film with other mattes";
}

}  // namespace
