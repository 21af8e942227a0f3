// Each array of a tile has a row, and whatever walks the rows takes each of them.
#include "core/film/tile_planes.h"

#include <cstring>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "core/film/sane_pixel.h"
#include "tests/support/insane.h"

namespace {

core::RenderSettings all_recorded() {
  core::RenderSettings settings;
  settings.film.width = settings.film.height = 8;
  settings.film.object = settings.film.object_mattes = settings.film.z_depth = true;
  settings.film.shares.resize(2);
  settings.adaptive.type = core::AdaptiveType::kPilot;
  settings.estimator.mis = core::MisType::kOptimal;  // has fits
  return settings;
}

/// A tile with all arrays, of zeros.
core::TileState tile_of(const core::Film& film) {
  core::TileState state = film.tile(0);
  core::resize_planes(state, 64, core::shape_of(film));
  state.samples = 2;
  return state;
}

TEST(TilePlanes, EveryArrayHasARow) {
  struct WithoutArrays {
    core::PixelRect rect;
    int samples;
    core::PlanSpan span;
    int pilot_samples;
    std::uint64_t rejected_samples;
    std::uint64_t rays;
    double cpu_seconds;
  };
  EXPECT_EQ((sizeof(core::TileState) - sizeof(WithoutArrays)) / sizeof(std::vector<core::Rgb>),
            core::kTilePlaneCount);
  const core::Film film(all_recorded(), core::PixelErrors::kIndependent, false);
  core::TileState state = tile_of(film);
  std::set<const void*> arrays;
  core::for_each_plane([&](const auto& plane) {
    EXPECT_FALSE((state.*plane.values).empty());
    arrays.insert(&(state.*plane.values));
  });
  EXPECT_EQ(arrays.size(), core::kTilePlaneCount) << "two rows have the same array";
}

// A changed byte of an array that is part of the film changes the digest and the snapshot; one of
// an array that serves the rendering changes neither.
TEST(TilePlanes, AChangedByteIsSeenWhereTheRowSays) {
  core::Film plain(all_recorded(), core::PixelErrors::kIndependent, false);
  plain.commit(0, tile_of(plain));
  core::for_each_plane([&](const auto& plane) {
    core::Film film(all_recorded(), core::PixelErrors::kIndependent, false);
    core::TileState state = tile_of(film);
    std::memset(static_cast<void*>(&(state.*plane.values).back()), 1, 1);
    film.commit(0, std::move(state));
    const bool is_kept = plane.in_snapshot != nullptr;
    EXPECT_EQ(film.digest() != plain.digest(), is_kept);
    if (is_kept) {
      const core::FilmSnapshot before = plain.snapshot();
      const core::FilmSnapshot after = film.snapshot();
      const auto& was = before.*plane.in_snapshot;
      const auto& is = after.*plane.in_snapshot;
      ASSERT_EQ(was.size(), is.size());
      EXPECT_NE(std::memcmp(was.data(), is.data(), is.size() * core::value_bytes(plane)), 0);
    }
  });
}

TEST(TilePlanes, AnInsaneValueOfAnyArrayIsSeen) {
  const core::Film film(all_recorded(), core::PixelErrors::kIndependent, false);
  EXPECT_TRUE(core::is_sane(tile_of(film), 2));
  core::for_each_plane([&](const auto& plane) {
    core::TileState state = tile_of(film);
    test_support::make_insane((state.*plane.values).back());
    EXPECT_FALSE(core::is_sane(state, 2)) << core::value_bytes(plane) << " bytes";
  });
}

// The sizes of the values as they are in files, summed by hand.
TEST(TilePlanes, BytesOfAPixelAreThoseOfAllArrays) {
  const core::RenderSettings settings = all_recorded();
  const core::Film film(settings, core::PixelErrors::kIndependent, false);
  const std::size_t by_hand = 2 * 24 + 32 + 8 + 32 + 2 * 48 + 2 * 2 * 12 + 44 + 72 + 4;
  EXPECT_EQ(core::pixel_bytes(core::shape_of(film),
                              [](const auto& plane) { return core::value_bytes(plane); }),
            by_hand);
}

// Each optional part alone: its settings record it and nothing else, and its flags in both kinds of
// files are its own.
TEST(RecordedParts, EveryPartHasARow) {
  EXPECT_EQ(sizeof(core::RecordedParts), core::kRecordedParts.size());  // a bool each
  std::uint32_t file_flags = 0;
  std::uint32_t checkpoint_flags = 0;
  for (const core::RecordedPart& row : core::kRecordedParts) {
    core::RecordedParts one;
    one.*row.is_recorded = true;
    core::FilmSettings settings;
    core::ask_for(one, settings);
    EXPECT_EQ(core::parts_asked_for(settings), one);
    EXPECT_EQ(core::flags_of(one, &core::RecordedPart::file_flag), row.file_flag);
    EXPECT_EQ(core::parts_in(row.file_flag, &core::RecordedPart::file_flag), one);
    EXPECT_EQ(core::parts_in(row.checkpoint_flag, &core::RecordedPart::checkpoint_flag), one);
    EXPECT_EQ(file_flags & row.file_flag, 0U);
    EXPECT_EQ(checkpoint_flags & row.checkpoint_flag, 0U);
    file_flags |= row.file_flag;
    checkpoint_flags |= row.checkpoint_flag;
  }
}

}  // namespace
