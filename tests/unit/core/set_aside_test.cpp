// Fireflies: light of one half that outshines all around it.
#include "core/film/set_aside.h"

#include <gtest/gtest.h>

#include "core/layers/layer_rows.h"
#include "core/layers/layers.h"

namespace {

/// A film of halves of 1 on all pixels of a square; 16 pixels wide.
core::FilmSnapshot even_film(int replicates = 2) {
  core::FilmSnapshot film;
  film.rect = {0, 0, 16, 16};
  film.replicates = replicates;
  film.pixels.assign(film.pixel_count() * static_cast<std::size_t>(replicates), {1, 1, 1, 1, 0, 8});
  return film;
}

void put(core::FilmSnapshot& film, int x, int y, int half, core::Rgb light) {
  const auto r = static_cast<std::size_t>(film.replicates);
  for (auto k = static_cast<std::size_t>(half); k < r; k += 2) {
    core::ReplicatePixel& p = film.pixels[static_cast<std::size_t>(y * 16 + x) * r + k];
    p.mean_r = light.r;
    p.mean_g = light.g;
    p.mean_b = light.b;
  }
}

core::Rgb value(const core::FilmSnapshot& film, int x, int y) {
  return core::pixel_value(film, static_cast<std::size_t>(y * 16 + x)).mean;
}

// Its luminance 0.2126 * 400 + 0.7152 * 100 + 0.0722 * 100 is scaled to 1; the colour stays 4:1:1.
TEST(SetAside, ScalesLightOfOneHalfToItsNeighboursAndKeepsItsColour) {
  for (const int replicates : {2, 8}) {
    core::FilmSnapshot film = even_film(replicates);
    put(film, 5, 7, 0, {400, 100, 100});
    const core::SetAside taken = core::set_aside(film, film.rect);
    const double light = 0.2126 * 400 + 0.7152 * 100 + 0.0722 * 100;
    const auto seen = core::half_value(film, 7 * 16 + 5, 0).mean;
    EXPECT_NEAR(static_cast<double>(seen.r), 400 / light, 1e-4);
    EXPECT_NEAR(static_cast<double>(seen.g), 100 / light, 1e-4);
    EXPECT_NEAR(taken.taken, (light - 1) / 2, 1e-3);
    EXPECT_NEAR(taken.light, 255 + (light + 1) / 2, 1e-2);
  }
}

TEST(SetAside, KeepsWhatBothHalvesOrTwoPixelsAgreeOn) {
  core::FilmSnapshot film = even_film();
  put(film, 5, 5, 0, core::Rgb(50));  // a highlight of one pixel
  put(film, 5, 5, 1, core::Rgb(40));
  put(film, 10, 10, 0, core::Rgb(30));  // one of two pixels
  put(film, 11, 11, 1, core::Rgb(30));
  core::set_aside(film, film.rect);
  EXPECT_EQ(value(film, 5, 5).g, 40) << "scaled to the other half";
  EXPECT_EQ(value(film, 10, 10).g, 15.5F);
  EXPECT_EQ(value(film, 11, 11).g, 15.5F);
}

TEST(SetAside, LeavesAnEvenImageAndPixelsWithOneHalfAlone) {
  core::FilmSnapshot film = even_film();
  EXPECT_EQ(core::set_aside(film, film.rect).taken, 0);
  put(film, 3, 3, 0, core::Rgb(100));
  film.pixels[(3 * 16 + 3) * 2 + 1] = {};
  EXPECT_EQ(core::set_aside(film, film.rect).taken, 0) << "nothing to compare with";
}

TEST(SetAside, CountsOnlyThePartThatIsAsked) {
  core::FilmSnapshot film = even_film();
  put(film, 5, 7, 0, core::Rgb(100));
  core::FilmSnapshot copy = film;
  EXPECT_EQ(core::set_aside(film, {8, 0, 8, 16}).taken, 0);
  EXPECT_GT(core::set_aside(copy, {0, 0, 8, 16}).taken, 0);
}

// A firefly in the first column of the second tile is bounded by pixels of the first, and parts of
// an image show what the whole one does.
TEST(SetAside, RowsOfAPartAreThoseOfTheWholeImage) {
  core::FilmSettings settings;
  settings.width = 64;
  settings.height = 48;
  core::Film film(settings, 2);
  for (int t = 0; t < film.tile_count(); ++t) {
    core::TileState state = film.tile(t);
    state.samples = 2;
    for (std::size_t i = 0; i < state.pixels.size(); ++i) {
      const auto pixel = static_cast<int>(i / 2);
      const int x = state.rect.x + pixel % state.rect.width;
      const int y = state.rect.y + pixel / state.rect.width;
      const bool is_lit = x % 8 == 0 && y % 8 == 0 && i % 2 == 0;
      const float light = (is_lit ? 100.0F : 1.0F) + static_cast<float>(x % 7);
      state.pixels[i] = {light, light, light, 1, 0, 1};
    }
    film.commit(t, std::move(state));
  }
  const auto rows_of = [&](core::PixelRect rect) {
    auto rows = core::LayerRows::create(film, rect, std::string(core::kBeauty), settings,
                                        {.sets_aside = true});
    std::vector<std::vector<float>> out;
    const core::ImageRows image = rows->rows();
    for (int y = 0; y < rect.height; ++y) {
      const float* row = image.row(y);
      out.emplace_back(row, row + rect.width * 4);
    }
    EXPECT_GT(rows->set_aside().share(), 0.1);
    return out;
  };
  const auto whole = rows_of({0, 0, 64, 48});
  const auto part = rows_of({32, 16, 20, 20});
  for (std::size_t y = 0; y < part.size(); ++y) {
    for (std::size_t i = 0; i < part[y].size(); ++i) {
      ASSERT_EQ(part[y][i], whole[y + 16][i + 32 * 4]) << y << ' ' << i;
    }
  }
  EXPECT_LT(whole[0][0], 20) << "the firefly at 0, 0";
  // Tiles sent to viewers show the same.
  const core::TileState tile = core::calm_tile(film, 1);
  EXPECT_EQ(core::half_value(std::span(tile.pixels).subspan(0, 2), 0).mean.g * 0.5F +
                core::half_value(std::span(tile.pixels).subspan(0, 2), 1).mean.g * 0.5F,
            whole[0][32 * 4]);
}

}  // namespace
