#include "core/film/film_format.h"

#include <cstring>
#include <limits>

#include <gtest/gtest.h>

#include "core/base/sha256.h"
#include "core/film/tile_planes.h"
#include "tests/support/insane.h"

namespace {

using core::ErrorCode;
using core::FilmPart;
using Bytes = std::vector<std::byte>;

constexpr std::size_t kHash = 64;
constexpr std::size_t kTileHead = 40;

/// Synthetic values; a crop, so that tiles are cut on all sides.
FilmPart made_film(float first_value = 0.25F, bool aux = true) {
  core::FilmSettings settings;
  settings.width = 100;
  settings.height = 80;
  settings.crop = core::PixelRect{20, 10, 50, 30};
  settings.albedo = settings.normal = settings.depth = aux;
  auto film = std::make_shared<core::Film>(settings, 4);
  for (int tile = 0; tile < film->tile_count(); ++tile) {
    core::TileState state = film->tile(tile);
    state.samples = 12;
    state.rays = 99;
    state.rejected_samples = 1;
    state.cpu_seconds = 0.5;
    float value = first_value;
    for (core::ReplicatePixel& p : state.pixels) {
      p = {value, -value, 2 * value, 1, value * value, 3};
      value += 0.125F;
    }
    for (core::AuxPixel& p : state.aux) {
      p.depth_m = 2;
      p.hits = 12;
    }
    film->commit(tile, std::move(state));
  }
  auto ledger = core::SampleLedger{{7, 0, 2, 6}, {(std::uint64_t{1} << 53U) - 1, 4, 2, 6}};
  return {std::move(film), std::move(ledger)};
}

Bytes written(const FilmPart& part, const std::string& text = R"({"a":1})") {
  Bytes file;
  EXPECT_TRUE(core::write_film(part, text, [&](std::span<const std::byte> piece) {
    file.insert(file.end(), piece.begin(), piece.end());
    return true;
  }));
  return file;
}

TEST(FilmFormat, KeepsTimeSpentOutsideSamples) {
  const FilmPart part = made_film();
  const std::uint64_t bytes = core::film_file_bytes(*part.film, part.ledger, 7);
  const double before = part.film->cpu_seconds();
  std::const_pointer_cast<core::Film>(part.film)->add_cpu_seconds(6);
  const Bytes file = written(part);
  EXPECT_EQ(file.size(), bytes);
  const auto read = core::read_film(file, {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_NEAR(read->part.film->cpu_seconds(), before + 6, 1e-9);
  EXPECT_EQ(read->part.film->digest(), part.film->digest());
  const auto merged = core::merge_films(std::span(&part, 1), 64);
  ASSERT_TRUE(merged);
  EXPECT_NEAR(merged->film->cpu_seconds(), before + 6, 1e-9);
}

/// Recomputes the checksum, so that a forged file matches.
void seal(Bytes& file) {
  const std::string hash = core::sha256_hex(file.data(), file.size() - kHash);
  std::memcpy(file.data() + file.size() - kHash, hash.data(), kHash);
}

core::Error refusal(const Bytes& file) {
  const auto read = core::read_film(file, {});
  EXPECT_FALSE(read);
  return read ? core::Error{} : read.error();
}

template <typename Value>
void put(Bytes& file, std::size_t at, Value value) {
  std::memcpy(file.data() + at, &value, sizeof value);
}

TEST(FilmFormat, RoundTripsAFilm) {
  for (const bool aux : {false, true}) {
    const FilmPart part = made_film(0.25F, aux);
    const Bytes file = written(part);
    EXPECT_EQ(file.size(), core::film_file_bytes(*part.film, part.ledger, 7));
    const auto read = core::read_film(file, {});
    ASSERT_TRUE(read) << read.error().message;
    EXPECT_EQ(read->part.film->digest(), part.film->digest());
    EXPECT_EQ(read->part.ledger, part.ledger);
    EXPECT_EQ(read->text, R"({"a":1})");
    EXPECT_EQ(read->part.film->rays(), part.film->rays());
    EXPECT_EQ(read->part.film->rejected_samples(), part.film->rejected_samples());
    EXPECT_EQ(read->part.film->cpu_seconds(), part.film->cpu_seconds());
    EXPECT_EQ(written(read->part), file);
  }
}

TEST(FilmFormat, KeepsWhetherErrorsAreCorrelated) {
  core::FilmSettings settings;
  settings.width = settings.height = 4;
  settings.albedo = settings.normal = settings.depth = false;
  auto film = std::make_shared<core::Film>(settings, 2, core::PixelErrors::kCorrelated);
  auto ledger = core::ledger_of(*film, 0, 0);
  const auto read = core::read_film(written({std::move(film), std::move(ledger)}), {});
  ASSERT_TRUE(read) << read.error().message;
  EXPECT_EQ(read->part.film->errors(), core::PixelErrors::kCorrelated);
}

TEST(FilmFormat, LayoutMatchesTheDocumentation) {
  const FilmPart part = made_film();
  const Bytes file = written(part);
  const auto u32 = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, file.data() + at, sizeof value);
    return value;
  };
  EXPECT_EQ(std::memcmp(file.data(), "TSRFILM1", 8), 0);
  const std::uint32_t head = 128 + 2 * 24 + 8;
  EXPECT_EQ(u32(8), head);
  EXPECT_EQ(u32(24), 100U);  // full width
  EXPECT_EQ(u32(32), 20U);   // crop x
  EXPECT_EQ(u32(48), 4U);    // replicates
  EXPECT_EQ(u32(52), 6U);    // tiles: columns 0, 32, 64; rows 0, 32
  EXPECT_EQ(std::memcmp(file.data() + 64, part.film->digest().data(), 64), 0);
  EXPECT_EQ(u32(128), 7U);    // seed of the first range
  EXPECT_EQ(u32(head), 20U);  // x of the first tile
  EXPECT_EQ(u32(head + 8), 12U);
  float first = 0;
  std::memcpy(&first, file.data() + head + kTileHead, sizeof first);
  EXPECT_EQ(first, 0.25F);
  EXPECT_EQ(core::sha256_hex(file.data(), file.size() - kHash),
            std::string(reinterpret_cast<const char*>(file.data() + file.size() - kHash), kHash));
}

TEST(FilmFormat, RefusesATruncatedFilm) {
  const Bytes file = written(made_film());
  for (std::size_t length = 0; length < file.size(); length += length < 400 ? 1 : 997) {
    EXPECT_EQ(refusal(Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(length))).code,
              ErrorCode::kInvalidArgument)
        << length;
  }
  Bytes longer = file;
  longer.push_back(std::byte{0});
  EXPECT_EQ(refusal(longer).code, ErrorCode::kInvalidArgument);
}

TEST(FilmFormat, DetectsAFlippedBit) {
  const Bytes file = written(made_film());
  for (std::size_t bit = 0; bit < file.size() * 8; bit += bit < 8 * 184 ? 1 : 8191) {
    Bytes flipped = file;
    flipped[bit / 8] ^= static_cast<std::byte>(1U << (bit % 8));
    const auto read = core::read_film(flipped, {});
    EXPECT_FALSE(read) << bit;
  }
}

TEST(FilmFormat, RefusesAForgedHeaderWithAValidChecksum) {
  const Bytes file = written(made_film());
  // Replaces every word of head and ledger by values that overflow, are negative or large.
  for (std::size_t at = 8; at < 64; at += 4) {
    for (const std::uint32_t value :
         {0U, 1U, 0x7fffffffU, 0x80000000U, 0xffffffffU, 0x40000000U, 5U}) {
      Bytes changed = file;
      std::uint32_t before = 0;
      std::memcpy(&before, file.data() + at, sizeof before);
      if (before == value) {
        continue;
      }
      put(changed, at, value);
      seal(changed);
      const auto read = core::read_film(changed, {});
      EXPECT_FALSE(read) << at << " " << value;
    }
  }
}

TEST(FilmFormat, RefusesALargeFilmBeforeAllocatingMemory) {
  Bytes file = written(made_film());
  put(file, 24, std::int32_t{16384});
  put(file, 28, std::int32_t{16384});
  EXPECT_EQ(core::check_film_head(file, std::uint64_t{1} << 40U, {}).error().code,
            ErrorCode::kTooLarge);
  file = written(made_film());
  core::FilmFormatLimits limits;
  limits.file_bytes_max = 1000;
  EXPECT_EQ(core::check_film_head(file, file.size(), limits).error().code, ErrorCode::kTooLarge);
}

TEST(FilmFormat, DetectsAWrongDigestWithAValidChecksum) {
  Bytes file = written(made_film());
  file[64] = file[64] == std::byte{'0'} ? std::byte{'1'} : std::byte{'0'};
  seal(file);
  EXPECT_NE(refusal(file).message.find("digest"), std::string::npos);
}

TEST(FilmFormat, RefusesInvalidPixelValues) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(refusal(written(made_film(nan))).message.find("tile 0"), std::string::npos);
  // More samples than in the ledger.
  FilmPart part = made_film();
  part.ledger[0].samples = 5;
  EXPECT_NE(refusal(written(part)).message.find("ledger"), std::string::npos);
  // Ranges whose sum differs from the replicates.
  part.ledger = {{7, 0, 2, 6}};
  EXPECT_NE(refusal(written(part)).message.find("add up"), std::string::npos);
  // An odd replicate belongs to the other half.
  part.ledger = {{7, 1, 4, 12}};
  EXPECT_NE(refusal(written(part)).message.find("range 0"), std::string::npos);
  // Overlapping ranges within one film.
  part.ledger = {{7, 0, 2, 6}, {7, 0, 2, 6}};
  EXPECT_NE(refusal(written(part)).message.find("range 1"), std::string::npos);
}

/// A film of one tile that records everything. change(state): before the tile is committed.
template <typename Change>
Bytes everything(const Change& change) {
  core::FilmSettings settings;
  settings.width = settings.height = 8;
  settings.object = settings.object_mattes = settings.z_depth = true;
  settings.shares.resize(1);
  auto film = std::make_shared<core::Film>(settings, 2);
  core::TileState state = film->tile(0);
  state.samples = 2;
  for (core::ReplicatePixel& p : state.pixels) {
    p.count = 1;
  }
  change(state);
  film->commit(0, std::move(state));
  auto ledger = core::ledger_of(*film, 0, 0);
  return written({std::move(film), std::move(ledger)});
}

TEST(FilmFormat, RefusesAnInsaneValueOfEveryArray) {
  const auto read = [](const Bytes& file) {
    return core::read_film(file, {},
                           [](const std::string&) { return std::vector<core::LightShare>(1); });
  };
  const auto sane = read(everything([](core::TileState&) {}));
  EXPECT_TRUE(sane) << sane.error().message;
  core::for_each_kept_plane([&](const auto& plane) {
    const auto spoilt = read(everything([&](core::TileState& state) {
      ASSERT_FALSE((state.*plane.values).empty());
      test_support::make_insane((state.*plane.values).back());
    }));
    ASSERT_FALSE(spoilt) << core::value_bytes(plane) << " bytes";
    EXPECT_NE(spoilt.error().message.find("tile 0 contains invalid values"), std::string::npos);
  });
}

}  // namespace
