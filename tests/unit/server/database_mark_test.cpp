// Losses of a database are reported: damaged, short and missing logs, and damaged databases.
#include "server/store/database_mark.h"

#include <cstdint>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sqlite3.h>

#include "server/store/database.h"
#include "tests/unit/server/failing_reads.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::Database;
using test_support::TemporaryFolder;

/// A database with committed changes in its log, as a killed process leaves it: copied from under
/// an open one.
class KilledDatabase : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = Database::open(live.file("tessera.db"));
    ASSERT_TRUE(opened);
    for (int i = 0; i < 20; ++i) {
      ASSERT_TRUE((*opened)->session().execute(
          "CREATE TABLE IF NOT EXISTS facts(a); INSERT INTO facts VALUES(hex(randomblob(2000)))"));
    }
    for (const char* suffix : {"", "-wal", "-mark"}) {
      std::filesystem::copy_file(live.file("tessera.db") + suffix, path() + suffix);
    }
  }
  std::string path() const { return folder.file("tessera.db"); }
  std::string damage() const {
    auto opened = Database::open(path());
    return opened ? (*opened)->damage() : "refused: " + opened.error().message;
  }

  TemporaryFolder live;
  TemporaryFolder folder;
};

TEST_F(KilledDatabase, IsWhole) { EXPECT_EQ(damage(), ""); }

// SQLite calls a page that the disk cannot read damaged; nothing must be restored for it.
TEST_F(KilledDatabase, AFailedReadIsNoDamage) {
  int failures = 0;
  for (bool more = true; more; ++failures) {
    auto opened = Database::open(path());
    ASSERT_TRUE(opened);
    test_support::fail_read_after(failures);
    const core::Status read =
        (*opened)->session().execute("SELECT count(*) FROM facts WHERE a LIKE '%1'");
    more = test_support::end_failing_reads();
    EXPECT_EQ(read.has_value(), !more) << failures;
    if (more) {
      EXPECT_EQ(read.error().message, "database error: the disk could not read it") << failures;
    }
  }
  EXPECT_GT(failures, 20) << "a page of each row";
}

// A power failure while the file was made, before it had its log: its last sectors are missing, and
// the journal of its first change is there.
TEST(NewDatabase, IsWholeAfterAPowerFailure) {
  const TemporaryFolder live;
  const TemporaryFolder folder;
  sqlite3* handle = nullptr;
  ASSERT_EQ(sqlite3_open(live.file("tessera.db").c_str(), &handle), SQLITE_OK);
  ASSERT_EQ(sqlite3_exec(handle,
                         "PRAGMA cache_size=1; BEGIN; CREATE TABLE facts(a);"
                         "INSERT INTO facts VALUES(randomblob(200000))",
                         nullptr, nullptr, nullptr),
            SQLITE_OK);
  const std::string path = folder.file("tessera.db");
  for (const char* suffix : {"", "-journal"}) {
    std::filesystem::copy_file(live.file("tessera.db") + suffix, path + suffix);
  }
  sqlite3_close(handle);
  ASSERT_GT(std::filesystem::file_size(path), 3072U);
  std::filesystem::resize_file(path, 3072);
  // The size of a page, 4096, and their number, which are written last.
  std::string head = test_support::read_file(path);
  head[16] = 0x10;
  head[17] = 0;
  head[31] = 1;
  test_support::write_file(path, head);
  EXPECT_TRUE(Database::open(path));
  std::filesystem::remove(path + "-journal");
  test_support::write_file(path, head);
  for (const char* suffix : {"-wal", "-shm", "-mark"}) {
    std::filesystem::remove(path + suffix);
  }
  const auto without_journal = Database::open(path);
  ASSERT_FALSE(without_journal);
  EXPECT_NE(without_journal.error().message.find("cut short"), std::string::npos);
}

// A power failure soon after the mark was made, before anything of it was synced.
TEST_F(KilledDatabase, IsWholeWithAnEmptyMark) {
  test_support::write_file(path() + "-mark", "");
  EXPECT_EQ(damage(), "");
}

TEST_F(KilledDatabase, ReportedWhereverABitOfTheLogFlips) {
  const std::uint64_t bytes = std::filesystem::file_size(path() + "-wal");
  const std::string log = test_support::read_file(path() + "-wal");
  const std::string base = test_support::read_file(path());
  const std::string mark = test_support::read_file(path() + "-mark");
  for (const std::uint64_t at : {std::uint64_t{3}, std::uint64_t{17}, std::uint64_t{40},
                                 std::uint64_t{200}, bytes / 2, bytes - 9}) {
    test_support::damage_file(path() + "-wal", at);
    EXPECT_NE(damage().find("write-ahead log"), std::string::npos) << at;
    EXPECT_TRUE(std::filesystem::exists(path() + "-wal-damaged")) << at;
    for (const char* suffix : {"-shm", "-damage", "-wal-damaged"}) {
      std::filesystem::remove(path() + suffix);
    }
    test_support::write_file(path(), base);
    test_support::write_file(path() + "-wal", log);
    test_support::write_file(path() + "-mark", mark);
  }
  EXPECT_EQ(damage(), "");
}

TEST_F(KilledDatabase, ReportedIfTheLogIsShortOrMissing) {
  const std::string log = test_support::read_file(path() + "-wal");
  test_support::write_file(path() + "-wal", std::string_view(log).substr(0, log.size() / 2));
  EXPECT_NE(damage().find("cut short"), std::string::npos);
  EXPECT_NE(damage().find("cut short"), std::string::npos) << "until it is accepted";
  std::filesystem::remove(path() + "-damage");
  EXPECT_EQ(damage(), "");
}

TEST_F(KilledDatabase, ReportedIfTheLogIsGone) {
  std::filesystem::remove(path() + "-wal");
  EXPECT_NE(damage().find("is missing"), std::string::npos);
}

TEST_F(KilledDatabase, ReportedIfItsMarkIsDamaged) {
  test_support::damage_file(path() + "-mark", 6);
  EXPECT_NE(damage().find("cannot be noticed"), std::string::npos);
}

TEST_F(KilledDatabase, ChangesAfterTheMarkAreNoLoss) {
  test_support::write_file(path() + "-mark", "");  // As after a power failure.
  std::filesystem::remove(path() + "-mark");
  EXPECT_EQ(damage(), "");
}

TEST(ClosedDatabase, ReportedIfABitFlips) {
  const TemporaryFolder folder;
  const std::string path = folder.file("tessera.db");
  ASSERT_TRUE(Database::open(path));
  EXPECT_EQ((*Database::open(path))->damage(), "");
  test_support::damage_file(path, std::filesystem::file_size(path) - 100);
  const auto opened = Database::open(path);
  ASSERT_TRUE(opened);
  EXPECT_NE((*opened)->damage().find("damaged, or replaced"), std::string::npos);
}

TEST(OpenDatabase, AnotherProcessFindsNoLoss) {
  const TemporaryFolder folder;
  const std::string path = folder.file("tessera.db");
  auto first = Database::open(path);
  ASSERT_TRUE(first);
  for (int i = 0; i < 10; ++i) {
    ASSERT_TRUE((*first)->session().execute("CREATE TABLE IF NOT EXISTS t(a)"));
    ASSERT_TRUE((*first)->session().execute("INSERT INTO t VALUES(1)"));
    if (i % 3 == 0) {
      ASSERT_TRUE((*first)->checkpoint());
    }
    auto second = Database::open(path);
    ASSERT_TRUE(second);
    EXPECT_EQ((*second)->damage(), "");
    ASSERT_TRUE((*second)->session().execute("INSERT INTO t VALUES(2)"));
  }
  first->reset();
  EXPECT_EQ((*Database::open(path))->damage(), "");
}

}  // namespace
