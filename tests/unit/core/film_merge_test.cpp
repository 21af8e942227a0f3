#include "core/film/film_merge.h"

#include <cmath>

#include <gtest/gtest.h>

#include "tests/support/scenes.h"

namespace {

using core::ErrorCode;
using core::FilmPart;
using core::SamplerType;

constexpr int kReplicatesMax = 64;

struct Ask {
  std::uint64_t seed = 0;
  int first_replicate = 0;
  int replicates = 2;
  int samples = 8;
  SamplerType sampler = SamplerType::kSobol;
  int width = 40;
  bool aux = false;
};

FilmPart part_of(const Ask& ask) {
  static const auto scene = test_support::build(test_support::cornell());
  core::View view = test_support::view_of(scene, ask.width, 34);
  test_support::look_at(view, {0.5F, 0.5F, 2}, {0.5F, 0.5F, 0}, 40);
  view.settings.seed = ask.seed;
  view.settings.replicates = ask.replicates;
  view.settings.sampler = ask.sampler;
  view.settings.max_depth = 3;
  view.settings.film.albedo = ask.aux;
  auto film = test_support::render(view, ask.samples).film;
  auto ledger = core::ledger_of(*film, ask.seed, ask.first_replicate);
  return {std::move(film), std::move(ledger)};
}

FilmPart merged(const std::vector<FilmPart>& parts) {
  auto result = core::merge_films(parts, kReplicatesMax);
  EXPECT_TRUE(result) << result.error().message;
  return *std::move(result);
}

/// The film of a job that holds only `count` of the replicates.
FilmPart cut_out(const FilmPart& whole, int first, int count) {
  core::FilmSettings settings;
  settings.width = whole.film->full_width();
  settings.height = whole.film->full_height();
  settings.albedo = settings.normal = settings.depth = false;
  auto film = std::make_shared<core::Film>(settings, count);
  const int replicates = whole.film->replicates();
  for (int tile = 0; tile < film->tile_count(); ++tile) {
    const core::TileState from = whole.film->tile(tile);
    core::TileState state = film->tile(tile);
    for (std::size_t i = 0; i < state.pixels.size(); ++i) {
      const std::size_t pixel = i / static_cast<std::size_t>(count);
      const std::size_t k = i % static_cast<std::size_t>(count) + static_cast<std::size_t>(first);
      state.pixels[i] = from.pixels[pixel * static_cast<std::size_t>(replicates) + k];
    }
    state.samples = from.samples / replicates * count;
    film->commit(tile, std::move(state));
  }
  auto ledger = core::ledger_of(*film, whole.ledger.front().seed, first);
  return {std::move(film), std::move(ledger)};
}

TEST(FilmMerge, PartsOfAJobMergeToItsFilmBitForBit) {
  for (const SamplerType sampler : {SamplerType::kSobol, SamplerType::kIndependent}) {
    const FilmPart whole = part_of({.replicates = 6, .samples = 24, .sampler = sampler});
    const FilmPart a = cut_out(whole, 0, 2);
    const FilmPart b = cut_out(whole, 2, 4);
    const FilmPart sum = merged({b, a});
    EXPECT_EQ(sum.film->digest(), whole.film->digest());
    EXPECT_EQ(sum.ledger, whole.ledger);
    // The ledger determines the order: with other numbers the same samples are another film.
    FilmPart late = a;
    late.ledger.front().first_replicate = 6;
    EXPECT_NE(merged({b, late}).film->digest(), whole.film->digest());
  }
}

TEST(FilmMerge, OrderAndGroupingDoNotMatter) {
  const FilmPart a = part_of({.seed = 0});
  const FilmPart b = part_of({.seed = 5, .samples = 16});
  const FilmPart c = part_of({.seed = 3, .replicates = 4});
  const std::string digest = merged({a, b, c}).film->digest();
  EXPECT_EQ(merged({c, a, b}).film->digest(), digest);
  EXPECT_EQ(merged({merged({b, a}), c}).film->digest(), digest);
  EXPECT_EQ(merged({merged({b, a}), c}).ledger, merged({a, b, c}).ledger);
}

TEST(FilmMerge, ReplicatesOfUnequalCountsRemainSeparateRanges) {
  const FilmPart a = part_of({.first_replicate = 0, .samples = 8});
  const FilmPart b = part_of({.first_replicate = 2, .samples = 16});
  const core::SampleLedger expected = {{0, 0, 2, 8}, {0, 2, 2, 16}};
  EXPECT_EQ(merged({a, b}).ledger, expected);
}

TEST(FilmMerge, ImageIsTheMeanWeightedByCounts) {
  const FilmPart a = part_of({.seed = 1, .samples = 8});
  const FilmPart b = part_of({.seed = 2, .samples = 24});
  const auto sum = merged({a, b}).film->snapshot();
  const auto left = a.film->snapshot();
  const auto right = b.film->snapshot();
  for (std::size_t i = 0; i < sum.pixel_count(); ++i) {
    const core::HalfValue value = core::pixel_value(sum, i);
    const core::Rgb expected =
        core::pixel_value(left, i).mean * 0.25F + core::pixel_value(right, i).mean * 0.75F;
    ASSERT_EQ(value.count, 32U);
    for (int c = 0; c < 3; ++c) {
      // A few roundings of single precision apart.
      ASSERT_NEAR(value.mean[c], expected[c], 1e-6F * (1 + std::abs(expected[c])));
    }
  }
}

TEST(FilmMerge, AuxiliaryMeansAreWeightedByTheirHits) {
  const FilmPart a = part_of({.seed = 1, .aux = true});
  const FilmPart b = part_of({.seed = 2, .samples = 24, .aux = true});
  const auto sum = merged({a, b}).film->snapshot();
  const auto left = a.film->snapshot();
  const auto right = b.film->snapshot();
  ASSERT_EQ(sum.aux.size(), sum.pixel_count());
  for (std::size_t i = 0; i < sum.aux.size(); ++i) {
    const auto m = static_cast<float>(left.aux[i].hits);
    const auto n = static_cast<float>(right.aux[i].hits);
    ASSERT_EQ(sum.aux[i].hits, left.aux[i].hits + right.aux[i].hits);
    if (m + n > 0) {
      // A few roundings of single precision apart.
      ASSERT_NEAR(sum.aux[i].albedo.r,
                  (m * left.aux[i].albedo.r + n * right.aux[i].albedo.r) / (m + n), 1e-6F);
      ASSERT_NEAR(sum.aux[i].depth_m,
                  (m * left.aux[i].depth_m + n * right.aux[i].depth_m) / (m + n), 1e-5F);
    }
  }
}

TEST(FilmMerge, CommonSamplesAreAConflict) {
  const FilmPart a = part_of({.seed = 7, .replicates = 4});
  for (const FilmPart& b :
       {part_of({.seed = 7, .samples = 16}), part_of({.seed = 7, .first_replicate = 2})}) {
    const auto result = core::merge_films(std::vector{part_of({.seed = 1}), a, b}, kReplicatesMax);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kConflict);
    EXPECT_EQ(result.error().where, "/films/2");
  }
}

TEST(FilmMerge, RefusesIncompatibleFilms) {
  const FilmPart a = part_of({.seed = 0});
  const auto refusal = [&](const FilmPart& other, int replicates_max) {
    const auto result = core::merge_films(std::vector{a, other}, replicates_max);
    EXPECT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(result.error().where, "/films/1");
    return result.error().message;
  };
  EXPECT_NE(refusal(part_of({.seed = 1, .width = 41}), kReplicatesMax).find("size"),
            std::string::npos);
  EXPECT_NE(refusal(part_of({.seed = 1, .aux = true}), kReplicatesMax).find("layers"),
            std::string::npos);
  EXPECT_NE(refusal(part_of({.seed = 1, .replicates = 4}), 4).find("6 replicates"),
            std::string::npos);
}

}  // namespace
