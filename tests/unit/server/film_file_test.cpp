#include "server/store/film_file.h"

#include <csignal>
#include <cstring>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <zlib.h>

#include "tests/unit/server/failing_reads.h"
#include "tests/unit/server/film_files.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::FilmFile;
using server::FilmRecord;
using test_support::FilmFiles;
using test_support::made_tile;
using test_support::small_film;

FilmRecord record_of(int samples) {
  FilmRecord record;
  record.elapsed_seconds = samples * 0.5;
  core::ConvergencePoint point;
  point.samples_per_pixel = samples;
  point.rays = 7;
  point.error = core::error_interval(0.25, 0.5, 0.125);
  record.points.push_back(point);
  return record;
}

void fill(core::Film& film, int samples) {
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    film.commit(tile, made_tile(film, tile, samples));
  }
}

core::Result<FilmRecord> load(const std::string& path, core::Film& film) {
  auto file = FilmFile::open(path);
  if (!file) {
    return file.error();
  }
  return file->restore(film);
}

/// Writes a file with two checkpoints, of 2 and of 4 samples; returns the digest of each film.
std::pair<std::string, std::string> write_two(const std::string& path) {
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(path);
  EXPECT_TRUE(file->restore(film));
  fill(film, 2);
  EXPECT_TRUE(file->write(film, record_of(2), false));
  const std::string first = film.digest();
  fill(film, 4);
  EXPECT_TRUE(file->write(film, record_of(4), false));
  return {first, film.digest()};
}

std::uint64_t blocks_of(const std::string& path) {
  struct stat info = {};
  EXPECT_EQ(::stat(path.c_str(), &info), 0);
  return static_cast<std::uint64_t>(info.st_blocks);
}

TEST_F(FilmFiles, RestoresAFilmBitForBit) {
  const std::string digest = write_two(path).second;
  core::Film film(small_film(), 2);
  const auto record = load(path, film);
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ(film.digest(), digest);
  EXPECT_EQ(record->elapsed_seconds, 2.0);
  ASSERT_EQ(record->points.size(), 1U);
  EXPECT_EQ(record->points[0].samples_per_pixel, 4);
  EXPECT_EQ(record->points[0].rays, 7U);
  EXPECT_EQ(record->points[0].error.relative, 0.5);
  EXPECT_EQ(record->points[0].error.high, 0.875);
  EXPECT_TRUE(record->points[0].error.unreliable);
  EXPECT_EQ(film.tile(3).rays, 40U);
  EXPECT_EQ(film.tile(3).cpu_seconds, 1.0);
  EXPECT_EQ(film.tile(3).rejected_samples, 3U);
}

TEST_F(FilmFiles, RestoresErrorsFromSquares) {
  core::Film film(small_film(), 2);
  FilmRecord written = record_of(2);
  written.points[0].error = core::error_interval(0.2, 0.1, 0.01, core::ErrorForm::kSquares);
  {
    auto file = FilmFile::open(path);
    ASSERT_TRUE(file->restore(film));
    fill(film, 2);
    ASSERT_TRUE(file->write(film, written, true));
  }
  core::Film other(small_film(), 2);
  const auto record = load(path, other);
  ASSERT_TRUE(record);
  ASSERT_EQ(record->points.size(), 1U);
  EXPECT_EQ(record->points[0].error.form, core::ErrorForm::kSquares);
  EXPECT_EQ(record->points[0].error.relative, 0.2);
  EXPECT_NEAR(record->points[0].error.high, 0.25 + 0.1 + 0.01, 1e-12);
}

TEST_F(FilmFiles, RestoresSecondsSpentOutsideSamples) {
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 2);
  const double of_samples = film.cpu_seconds();
  film.add_cpu_seconds(3);
  ASSERT_TRUE(file->write(film, record_of(2), false));
  core::Film again(small_film(), 2);
  ASSERT_TRUE(load(path, again));
  EXPECT_EQ(again.cpu_seconds(), of_samples + 3);
}

TEST_F(FilmFiles, ReadsAHeaderOfTheFirstVersion) {
  const std::string digest = write_two(path).second;
  std::string data = test_support::read_file(path);
  // Checkpoint 2 is in head 0: without the eight bytes after the first 64.
  std::uint32_t bytes = 0;
  std::memcpy(&bytes, data.data() + 8, sizeof bytes);
  data.erase(64, 8).insert(bytes - 8, 8, '\0');
  bytes -= 8;
  std::memcpy(data.data() + 8, &bytes, sizeof bytes);
  data[3] = '1';
  const auto crc = static_cast<std::uint32_t>(
      crc32_z(0, reinterpret_cast<const Bytef*>(data.data()) + 8, bytes - 8));
  std::memcpy(data.data() + 4, &crc, sizeof crc);
  test_support::write_file(path, data);
  core::Film film(small_film(), 2);
  const auto record = load(path, film);
  ASSERT_TRUE(record) << record.error().message;
  EXPECT_EQ(film.digest(), digest);
  EXPECT_EQ(record->elapsed_seconds, 2.0);
}

TEST_F(FilmFiles, StoresTheArithmeticWithAnyNumberOfPoints) {
  core::Film film(small_film(), 2);
  fill(film, 2);
  server::FilmRecord record = record_of(2);
  record.points.assign(5000, record.points.front());
  for (const std::string& text :
       {std::string("embree 4, avx2"), std::string(300, 'x'), std::string()}) {
    record.arithmetic = text;
    auto file = FilmFile::open(path);
    core::Film other(small_film(), 2);
    ASSERT_TRUE(file->restore(other));
    ASSERT_TRUE(file->write(film, record, false));
    core::Film again(small_film(), 2);
    const auto read = load(path, again);
    ASSERT_TRUE(read);
    EXPECT_EQ(read->arithmetic, text.substr(0, 256));
    EXPECT_EQ(again.digest(), film.digest());
    EXPECT_LE(read->points.size(), 2048U);
  }
}

core::RenderSettings adaptive_film() {
  core::RenderSettings settings;
  settings.film = small_film();
  settings.adaptive.type = core::AdaptiveType::kPilot;
  return settings;
}

/// Pilot samples and a plan for every tile, all different.
void decide(core::Film& film, core::PlanSpan span) {
  std::vector<std::vector<core::PixelPlan>> plans;
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    core::TileState state = film.tile(tile);
    const std::size_t pixels = state.aux.size();
    state.pilot_samples = span.from / 10;
    state.pilot.resize(pixels);
    auto& plan = plans.emplace_back(pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const auto value = static_cast<float>(i) + 0.5F * static_cast<float>(tile);
      state.pilot[i] = {{value, 1, 2}, {3, value, 5}, value, 7};
      const auto count = static_cast<std::uint32_t>(i) + static_cast<std::uint32_t>(span.to);
      plan[i] = {count, count + 2};
    }
    film.keep(tile, std::move(state));
  }
  film.install_plans(span, std::move(plans));
}

std::string decisions_of(const core::Film& film) {
  std::string text;
  for (int tile = 0; tile < film.tile_count(); ++tile) {
    const core::TileState state = film.tile(tile);
    text += std::to_string(state.pilot_samples) + " " + std::to_string(state.span.from) + " " +
            std::to_string(state.span.to) + " ";
    text.append(reinterpret_cast<const char*>(state.pilot.data()),
                state.pilot.size() * sizeof(core::PilotPixel));
    text.append(reinterpret_cast<const char*>(state.plan.data()),
                state.plan.size() * sizeof(core::PixelPlan));
  }
  return text;
}

TEST_F(FilmFiles, RestoresAdaptivePlans) {
  core::Film film(adaptive_film(), core::PixelErrors::kIndependent, false);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 32);
  ASSERT_TRUE(file->write(film, record_of(32), false));
  {
    core::Film undecided(adaptive_film(), core::PixelErrors::kIndependent, false);
    ASSERT_TRUE(load(path, undecided));
    EXPECT_EQ(decisions_of(undecided), decisions_of(film));
  }
  const std::uint32_t revision = film.revision();
  decide(film, {32, 64});
  EXPECT_EQ(film.revision(), revision) << "the image has not changed";
  ASSERT_TRUE(file->write(film, record_of(32), false));
  fill(film, 64);
  decide(film, {64, 128});
  ASSERT_TRUE(file->write(film, record_of(64), false));
  core::Film loaded(adaptive_film(), core::PixelErrors::kIndependent, false);
  ASSERT_TRUE(load(path, loaded));
  EXPECT_EQ(loaded.digest(), film.digest());
  EXPECT_EQ(decisions_of(loaded), decisions_of(film));
  EXPECT_GT(decisions_of(loaded).size(), 70U * 40U * 40U);
  // A film without decisions is a different film.
  core::Film plain(small_film(), 2);
  EXPECT_EQ(load(path, plain).error().code, core::ErrorCode::kConflict);
  EXPECT_EQ(load(path, plain).error().where, "");  // clients see it
}

TEST_F(FilmFiles, RestoresFittedCoefficients) {
  core::RenderSettings settings;
  settings.film = small_film();
  settings.estimator.mis = core::MisType::kOptimal;
  core::Film film(settings, core::PixelErrors::kIndependent, false);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  const auto fits_of = [](const core::Film& of) {
    std::string text;
    for (int tile = 0; tile < of.tile_count(); ++tile) {
      const core::TileState state = of.tile(tile);
      text.append(reinterpret_cast<const char*>(state.fit.data()),
                  state.fit.size() * sizeof(core::ReplicateFit));
    }
    return text;
  };
  for (const int samples : {2, 4}) {
    for (int tile = 0; tile < film.tile_count(); ++tile) {
      core::TileState state = made_tile(film, tile, samples);
      state.fit.resize(state.pixels.size());
      for (std::size_t i = 0; i < state.fit.size(); ++i) {
        const auto value = static_cast<float>(i) + 0.5F * static_cast<float>(tile * samples);
        state.fit[i] = {value, 1, 2, {3, value, 5}, {6, 7, value}, {value, 8, 9}};
      }
      film.commit(tile, std::move(state));
    }
    ASSERT_TRUE(file->write(film, record_of(samples), false));
  }
  core::Film loaded(settings, core::PixelErrors::kIndependent, false);
  ASSERT_TRUE(load(path, loaded));
  EXPECT_EQ(loaded.digest(), film.digest());
  EXPECT_EQ(fits_of(loaded), fits_of(film));
  EXPECT_EQ(fits_of(loaded).size(), 70U * 40U * 2U * 48U);
  // A film without fitted coefficients is a different film.
  core::Film plain(small_film(), 2);
  EXPECT_EQ(load(path, plain).error().code, core::ErrorCode::kConflict);
}

TEST_F(FilmFiles, DamagedPlanRestoresThePreviousCheckpointWithItsPlans) {
  core::Film film(adaptive_film(), core::PixelErrors::kIndependent, false);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 32);
  decide(film, {32, 64});
  ASSERT_TRUE(file->write(film, record_of(32), false));
  const std::string before = film.digest() + decisions_of(film);
  fill(film, 64);
  decide(film, {64, 128});
  ASSERT_TRUE(file->write(film, record_of(64), false));
  const std::string after = film.digest() + decisions_of(film);
  const std::string whole = test_support::read_file(path);
  int went_back = 0;
  for (std::uint64_t at = 0; at < whole.size(); at += 8009) {
    test_support::damage_file(path, at);
    core::Film loaded(adaptive_film(), core::PixelErrors::kIndependent, false);
    if (load(path, loaded)) {
      const std::string seen = loaded.digest() + decisions_of(loaded);
      EXPECT_TRUE(seen == before || seen == after) << at;
      went_back += seen == before ? 1 : 0;
    }
    test_support::damage_file(path, at);  // undone
  }
  EXPECT_GT(went_back, 0);
}

TEST_F(FilmFiles, RevisionsContinueAfterARestart) {
  write_two(folder.file("a.film"));
  core::Film film(small_film(), 2);
  ASSERT_TRUE(load(folder.file("a.film"), film));
  EXPECT_EQ(film.revision(), 12U);  // Two passes over six tiles.
  EXPECT_EQ(film.commit(0, made_tile(film, 0, 6)), 13U);
}

TEST_F(FilmFiles, NewFileGivesAnEmptyFilm) {
  core::Film film(small_film(), 2);
  const auto record = load(folder.file("new.film"), film);
  ASSERT_TRUE(record);
  EXPECT_EQ(film.tile_samples(0), 0);
  EXPECT_TRUE(record->points.empty());
}

TEST_F(FilmFiles, WritesOnlyChangedTiles) {
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 2);
  ASSERT_TRUE(file->write(film, record_of(2), false));
  const std::uint64_t one_slot_each = blocks_of(path);
  film.commit(1, made_tile(film, 1, 4));
  ASSERT_TRUE(file->write(film, record_of(4), false));
  // The second slot of one tile, and the other head: less than the first checkpoint.
  EXPECT_LT(blocks_of(path) - one_slot_each, one_slot_each / 2);
  core::Film again(small_film(), 2);
  ASSERT_TRUE(load(path, again));
  EXPECT_EQ(again.digest(), film.digest());
}

TEST_F(FilmFiles, FinalFilmReleasesItsOldSlots) {
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 2);
  ASSERT_TRUE(file->write(film, record_of(2), false));
  fill(film, 4);
  ASSERT_TRUE(file->write(film, record_of(4), false));
  const std::uint64_t both = blocks_of(path);
  ASSERT_TRUE(file->write(film, record_of(4), true));
  EXPECT_LT(blocks_of(path), both * 3 / 4);
  core::Film again(small_film(), 2);
  ASSERT_TRUE(load(path, again));
  EXPECT_EQ(again.digest(), film.digest());
}

/// Tears the newer checkpoint: after a power loss every byte range of the file may be old or new,
/// but data synced before is complete.
TEST_F(FilmFiles, TornCheckpointKeepsThePreviousOne) {
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 2);
  ASSERT_TRUE(file->write(film, record_of(2), false));
  const std::string old_digest = film.digest();
  const std::string before = test_support::read_file(path);
  fill(film, 4);
  ASSERT_TRUE(file->write(film, record_of(4), false));
  const std::string new_digest = film.digest();
  const std::string after = test_support::read_file(path);
  ASSERT_GE(after.size(), before.size());
  // The head is written after a sync: while it is old, any mixture of the rest must give the old
  // film.
  const std::size_t head_bytes = 2 * 4096 * 30;  // after both heads, before the last slots
  for (std::size_t cut = head_bytes; cut < after.size(); cut += 8191) {
    std::string torn = before;
    torn.resize(after.size());
    for (std::size_t i = cut; i < after.size(); ++i) {
      torn[i] = after[i];
    }
    test_support::write_file(path, torn);
    core::Film loaded(small_film(), 2);
    ASSERT_TRUE(load(path, loaded)) << cut;
    EXPECT_EQ(loaded.digest(), old_digest) << cut;
  }
  // The head itself is truncated: its checksum does not match.
  for (std::size_t cut = 0; cut < 4096; cut += 7) {
    std::string torn = after;
    for (std::size_t i = cut; i < head_bytes && i < before.size(); ++i) {
      torn[i] = before[i];
    }
    test_support::write_file(path, torn);
    core::Film loaded(small_film(), 2);
    ASSERT_TRUE(load(path, loaded)) << cut;
    EXPECT_TRUE(loaded.digest() == old_digest || loaded.digest() == new_digest) << cut;
  }
}

TEST_F(FilmFiles, DamagedTileRevertsTheWholeFilmByOneCheckpoint) {
  const auto [old_digest, new_digest] = write_two(path);
  const std::string whole = test_support::read_file(path);
  int went_back = 0;
  for (std::uint64_t at = 0; at < whole.size(); at += 4001) {
    test_support::damage_file(path, at);
    core::Film film(small_film(), 2);
    if (load(path, film)) {
      const std::string digest = film.digest();
      EXPECT_TRUE(digest == new_digest || digest == old_digest) << at;
      went_back += digest == old_digest ? 1 : 0;
    }
    test_support::damage_file(path, at);  // undone
  }
  EXPECT_GT(went_back, 0);
}

TEST_F(FilmFiles, ReportsDamageToBothCheckpoints) {
  write_two(path);
  std::string content = test_support::read_file(path);
  for (std::size_t i = 100; i < content.size(); i += 512) {
    content[i] = static_cast<char>(content[i] ^ 1);
  }
  test_support::write_file(path, content);
  core::Film film(small_film(), 2);
  const auto record = load(path, film);
  ASSERT_FALSE(record);
  EXPECT_EQ(record.error().code, core::ErrorCode::kInternal);
}

// What cannot be read may be whole: neither an older checkpoint nor a blank film stands for it.
TEST_F(FilmFiles, AFailedReadIsNoDamage) {
  const std::string empty_digest = core::Film(small_film(), 2).digest();
  for (const int checkpoints : {1, 2}) {
    std::string digest = write_two(path).second;
    if (checkpoints == 1) {
      core::Film film(small_film(), 2);
      auto file = FilmFile::open(folder.file("one.film"));
      ASSERT_TRUE(file->restore(film));
      fill(film, 2);
      ASSERT_TRUE(file->write(film, record_of(2), false));
      digest = film.digest();
    }
    auto file = FilmFile::open(checkpoints == 1 ? folder.file("one.film") : path);
    ASSERT_TRUE(file);
    core::Film film(small_film(), 2);
    int failures = 0;
    for (bool more = true; more; ++failures) {
      test_support::fail_read_after(failures);
      const auto record = file->restore(film);
      more = test_support::end_failing_reads();
      if (more) {
        ASSERT_FALSE(record) << failures;
        EXPECT_EQ(record.error().code, core::ErrorCode::kUnavailable) << failures;
        EXPECT_EQ(film.digest(), empty_digest) << failures;
      } else {
        ASSERT_TRUE(record) << record.error().message;
        EXPECT_EQ(film.digest(), digest);
      }
    }
    EXPECT_GE(failures, 2 + film.tile_count()) << "two heads and each tile";
  }
}

TEST_F(FilmFiles, TruncatedFileNeverGivesAWrongFilm) {
  const auto [old_digest, new_digest] = write_two(path);
  const std::string whole = test_support::read_file(path);
  const std::string empty_digest = core::Film(small_film(), 2).digest();
  for (std::size_t size = 0; size < whole.size(); size += 3001) {
    test_support::write_file(path, std::string_view(whole).substr(0, size));
    core::Film film(small_film(), 2);
    if (load(path, film)) {
      const std::string digest = film.digest();
      EXPECT_TRUE(digest == new_digest || digest == old_digest || digest == empty_digest) << size;
    }
  }
}

TEST_F(FilmFiles, RefusesAFilmOfAnotherSize) {
  write_two(path);
  core::FilmSettings other = small_film();
  other.width = 71;
  core::Film film(other, 2);
  EXPECT_EQ(load(path, film).error().code, core::ErrorCode::kConflict);
  core::Film more_replicates(small_film(), 4);
  EXPECT_EQ(load(path, more_replicates).error().code, core::ErrorCode::kConflict);
}

TEST_F(FilmFiles, LastCheckpointIsValidAfterAFailedWrite) {
  const std::string digest = write_two(path).second;
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(path);
  ASSERT_TRUE(file->restore(film));
  fill(film, 6);
  // A file-size limit simulates a full disk; its signal is ignored.
  ASSERT_NE(std::signal(SIGXFSZ, SIG_IGN), SIG_ERR);
  rlimit before = {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const rlimit tight = {.rlim_cur = 4096, .rlim_max = before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &tight), 0);
  const auto written = file->write(film, record_of(6), false);
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &before), 0);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().code, core::ErrorCode::kNoSpace);
  core::Film loaded(small_film(), 2);
  ASSERT_TRUE(load(path, loaded));
  EXPECT_EQ(loaded.digest(), digest);
  EXPECT_TRUE(file->write(film, record_of(6), false));
}

TEST_F(FilmFiles, ThinsThousandsOfPointsButKeepsTheNewest) {
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(folder.file("a.film"));
  ASSERT_TRUE(file->restore(film));
  fill(film, 2);
  FilmRecord record;
  for (int i = 1; i <= 5000; ++i) {
    core::ConvergencePoint point;
    point.samples_per_pixel = i;
    record.points.push_back(point);
  }
  ASSERT_TRUE(file->write(film, record, false));
  core::Film again(small_film(), 2);
  const auto loaded = load(folder.file("a.film"), again);
  ASSERT_TRUE(loaded);
  EXPECT_LE(loaded->points.size(), 2048U);
  EXPECT_GE(loaded->points.size(), 1000U);
  EXPECT_EQ(loaded->points.back().samples_per_pixel, 5000);
}

}  // namespace
