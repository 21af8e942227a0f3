#include "server/store/blob_store.h"

#include <filesystem>

#include <gtest/gtest.h>

#include "api/json/errors.h"
#include "core/base/sha256.h"
#include "tests/support/read_bytes.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::BlobStore;
using test_support::TemporaryFolder;

/// FIPS 180-2, appendix B.1.
constexpr const char* kAbc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

std::size_t files_in(const std::string& path) {
  std::size_t count = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(path)) {
    count += entry.is_regular_file() ? 1U : 0U;
  }
  return count;
}

TEST(BlobStore, NamesContentByItsHash) {
  const TemporaryFolder folder;
  const auto store = BlobStore::open(folder.path());
  ASSERT_TRUE(store);
  const auto stored = store->put("abc");
  ASSERT_TRUE(stored);
  EXPECT_EQ(stored->id, kAbc);
  EXPECT_EQ(stored->bytes, 3U);
  EXPECT_FALSE(stored->known);
  EXPECT_TRUE(store->put("abc")->known);
  EXPECT_EQ(**store->read(kAbc), test_support::bytes_of("abc"));
  EXPECT_EQ(test_support::read_file(folder.file("ba") + "/" + kAbc), "abc");
}

TEST(BlobStore, DamagedOrLostFilesAreReportedAndReplacedByAnUpload) {
  const TemporaryFolder folder;
  const auto store = BlobStore::open(folder.path());
  ASSERT_TRUE(store->put("abc"));
  ASSERT_TRUE(store->check(kAbc));
  const std::string path = folder.file("ba") + "/" + kAbc;
  const auto is_reported = [&](const char* words) {
    for (const auto& error :
         {store->read(kAbc).error(), store->open_blob(kAbc).error(), store->check(kAbc).error()}) {
      EXPECT_NE(error.message.find(words), std::string::npos) << error.message;
      EXPECT_EQ((error.message + error.where).find(folder.path()), std::string::npos);
    }
  };
  test_support::damage_file(path, 1);
  is_reported("is damaged");
  EXPECT_FALSE(store->put("abc")->known);
  EXPECT_EQ(**store->read(kAbc), test_support::bytes_of("abc"));
  std::filesystem::remove(path);
  is_reported("is gone");
}

TEST(BlobStore, ClientsDoNotSeeItsPathWhenItsFoldersAreGone) {
  const TemporaryFolder folder;
  const auto store = BlobStore::open(folder.path());
  ASSERT_TRUE(store);
  std::filesystem::remove_all(folder.path());
  const auto upload = store->put("abc");
  ASSERT_FALSE(upload);
  const api::Problem problem = api::from_error(upload.error());
  EXPECT_EQ(problem.status, 500);
  EXPECT_EQ(problem.detail, "cannot open: No such file or directory");
  EXPECT_TRUE(problem.errors.empty());
}

TEST(BlobStore, UploadWithAnotherHashLeavesNothing) {
  const TemporaryFolder folder;
  const auto store = BlobStore::open(folder.path());
  {
    auto upload = store->start_upload();
    ASSERT_TRUE(upload);
    ASSERT_TRUE(upload->write("abd"));
    EXPECT_EQ(upload->finish(kAbc).error().code, core::ErrorCode::kInvalidArgument);
  }
  EXPECT_FALSE(store->find(kAbc));
  EXPECT_EQ(files_in(folder.path()), 0U);
}

TEST(BlobStore, AbandonedUploadLeavesNothing) {
  const TemporaryFolder folder;
  const auto store = BlobStore::open(folder.path());
  {
    auto upload = store->start_upload();
    ASSERT_TRUE(upload->write("half of it"));
    EXPECT_EQ(files_in(folder.path()), 1U);
  }
  EXPECT_EQ(files_in(folder.path()), 0U);
}

TEST(BlobStore, RemovesPartialUploadsOfADeadProcess) {
  const TemporaryFolder folder;
  ASSERT_TRUE(BlobStore::open(folder.path()));
  test_support::write_file(folder.file("tmp/1-1.part"), "half of it");
  ASSERT_TRUE(BlobStore::open(folder.path()));
  EXPECT_EQ(files_in(folder.path()), 0U);
}

TEST(BlobStore, IdsThatAreNotHashesAreNeverPaths) {
  const TemporaryFolder folder;
  const auto store = BlobStore::open(folder.path() + "/assets");
  test_support::write_file(folder.file("secret"), "x");
  for (const char* id : {"../secret", "", "abc", "..", "/etc/passwd"}) {
    EXPECT_FALSE(store->find(id)) << id;
    EXPECT_EQ(store->read(id).error().code, core::ErrorCode::kNotFound) << id;
  }
}

TEST(BlobStore, ReportsAFullDisk) {
  const auto fd = server::open_file("/dev/full", 1 /* O_WRONLY */);
  ASSERT_TRUE(fd);
  const auto bytes = test_support::bytes_of("abc");
  EXPECT_EQ(server::write_at(fd->get(), bytes, 0, "/dev/full").error().code,
            core::ErrorCode::kNoSpace);
}

}  // namespace
