// Order of writes and syncs: a crash of the machine may lose any write that no sync follows, so
// what refers to data is written after the sync of the data. This program's own pwrite(),
// fdatasync(), fsync(), rename() and unlink() record the calls of one thread and make them.
#include <algorithm>
#include <regex>
#include <string>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "server/store/blob_store.h"
#include "server/store/comparison_store.h"
#include "server/store/film_file.h"
#include "server/webhooks/webhook_secrets.h"
#include "tests/unit/server/jobs_fixture.h"
#include "tests/unit/server/server_test_support.h"

namespace {

thread_local std::string* recorded = nullptr;

void record(char call) {
  if (recorded != nullptr) {
    *recorded += call;
  }
}

bool is_directory(int fd) {
  struct stat info = {};
  return ::fstat(fd, &info) == 0 && S_ISDIR(info.st_mode);
}

/// Returns the calls of `act` in order. w: a write; s: a sync of a file; d: of a directory; r: a
/// rename; u: a removal.
template <typename Act>
std::string calls_of(const Act& act) {
  std::string calls;
  recorded = &calls;
  act();
  recorded = nullptr;
  return calls;
}

}  // namespace

extern "C" {

ssize_t pwrite(int fd, const void* bytes, size_t count, off_t offset) {
  record('w');
  return ::syscall(SYS_pwrite64, fd, bytes, count, offset);
}

int fdatasync(int fd) {
  record('s');
  return static_cast<int>(::syscall(SYS_fdatasync, fd));
}

int fsync(int fd) {
  record(is_directory(fd) ? 'd' : 's');
  return static_cast<int>(::syscall(SYS_fsync, fd));
}

int rename(const char* from, const char* to) noexcept {
  record('r');
  return static_cast<int>(::syscall(SYS_renameat2, AT_FDCWD, from, AT_FDCWD, to, 0));
}

int unlink(const char* path) noexcept {
  record('u');
  return static_cast<int>(::syscall(SYS_unlinkat, AT_FDCWD, path, 0));
}

}  // extern "C"

namespace {

using server::FilmFile;
using test_support::small_film;
using test_support::TemporaryFolder;

// The tiles, a sync, one write of the head that refers to them, and a sync before the caller says
// that the checkpoint exists. The first writes also make the file.
TEST(WriteOrder, TilesAreOnTheDiskBeforeTheHeadThatRefersToThem) {
  const TemporaryFolder folder;
  core::Film film(small_film(), 2);
  auto file = FilmFile::open(folder.file("film"));
  ASSERT_TRUE(file);
  ASSERT_TRUE(file->restore(film));
  for (const int samples : {2, 4}) {
    for (int tile = 0; tile < film.tile_count(); ++tile) {
      film.commit(tile, test_support::made_tile(film, tile, samples));
    }
    const std::string calls = calls_of([&] { EXPECT_TRUE(file->write(film, {}, false)); });
    EXPECT_TRUE(std::regex_match(calls, std::regex("w+sws"))) << calls;
    EXPECT_GE(std::count(calls.begin(), calls.end(), 'w'), film.tile_count() + 1) << calls;
  }
}

// The content is on the disk before its name, and its name before the answer.
TEST(WriteOrder, AnAssetGetsItsNameAfterItsContentIsOnTheDisk) {
  const TemporaryFolder folder;
  const auto store = server::BlobStore::open(folder.path());
  ASSERT_TRUE(store);
  const std::string calls = calls_of([&] { EXPECT_TRUE(store->put("abc")); });
  EXPECT_TRUE(std::regex_match(calls, std::regex("w+srd+"))) << calls;
}

class WriteOrderOfJobs : public test_support::JobsFixture {};

// Otherwise the file could come back after a power failure, and belong to no job, or to a later job
// with the same id.
TEST_F(WriteOrderOfJobs, AFilmIsGoneFromTheDiskBeforeTheStoreForgetsIt) {
  const auto job = submit(2);
  ASSERT_TRUE(wait_for(job, api::JobState::kFinished));
  const std::string calls = calls_of([&] { EXPECT_TRUE(jobs->remove(job)); });
  EXPECT_TRUE(std::regex_match(calls, std::regex("[^u]*u+d[^u]+"))) << calls;
}

// Each map with its content, its folder and the folder above, before the record in the database,
// whose commit ends with a sync.
TEST_F(WriteOrderOfJobs, MapsOfAComparisonAreOnTheDiskBeforeItsRecord) {
  server::ComparisonStore store(*database, *data, {});
  server::ComparisonStore::Row row;
  row.id = "00000000-0000-4000-8000-000000000001";
  row.body = "{}";
  const std::string calls = calls_of([&] {
    EXPECT_TRUE(store.insert(row, {{"z.png", "zzz"}, {"flip.png", "f"}}));
  });
  EXPECT_TRUE(std::regex_match(calls, std::regex("(w+s){2}ddw*s[ws]*"))) << calls;
}

// The head of the film's file and the file's name, before the record of the job.
TEST_F(WriteOrderOfJobs, AnImportedFilmIsOnTheDiskBeforeItsJob) {
  const auto job = submit(2);
  ASSERT_TRUE(wait_for(job, api::JobState::kFinished));
  const auto film = jobs->films().film(*job);
  ASSERT_TRUE(film);
  const api::JobView view = jobs->view(*job);
  server::JobService::FinishedFilm finished;
  finished.spec = view.spec;
  finished.film = *film;
  finished.ledger = view.ledger;
  finished.build = "{}";
  const std::string calls = calls_of([&] { EXPECT_TRUE(jobs->add_finished(finished)); });
  EXPECT_TRUE(std::regex_match(calls, std::regex("[ws]*w+swsdw*s[ws]*"))) << calls;
}

// The secret before its mark, and both names before anybody knows it.
TEST(WriteOrder, AWebhookSecretIsOnTheDiskBeforeItIsGiven) {
  const TemporaryFolder folder;
  const std::string calls =
      calls_of([&] { EXPECT_TRUE(server::stored_webhook_secret(folder.path())); });
  EXPECT_TRUE(std::regex_match(calls, std::regex("w+sw+sd"))) << calls;
}

TEST_F(WriteOrderOfJobs, ATenantsNewSecretIsOnTheDiskBeforeItIsGiven) {
  server::DeliveryTable deliveries(*database);
  server::WebhookSecrets secrets(deliveries, "operator's", false);
  const std::string calls = calls_of([&] { EXPECT_TRUE(secrets.replace("tenant")); });
  EXPECT_TRUE(std::regex_match(calls, std::regex("w*s[ws]*"))) << calls;
}

}  // namespace
