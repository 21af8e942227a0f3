#include "server/store/storage_quota.h"

#include <memory>

#include <gtest/gtest.h>

#include "api/json/error_codes.h"
#include "server/store/assets.h"
#include "server/store/database.h"
#include "server/store/job_table.h"
#include "tests/unit/server/server_test_support.h"

namespace {

using server::StorageQuota;
using Kind = StorageQuota::Kind;

class Quota : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = server::Database::open(folder.file("tessera.db"));
    ASSERT_TRUE(opened);
    database = std::move(*opened);
    auto store = server::BlobStore::open(folder.file("assets"));
    ASSERT_TRUE(store);
    blobs = std::make_unique<server::BlobStore>(std::move(*store));
    assets = std::make_unique<server::Assets>(*database, *blobs);
    jobs = std::make_unique<server::JobTable>(*database);
  }
  StorageQuota quota(server::StorageLimits limits) { return {*database, limits}; }
  void keep_asset(const std::string& id, std::uint64_t bytes, const std::string& tenant) {
    ASSERT_TRUE(assets->keep({.id = id, .bytes = bytes}, server::Access::of(tenant), 1));
  }
  static server::JobRow job(const std::string& tenant) {
    server::JobRow row;
    row.sequence = 1;
    row.id = "j";
    row.state = "rendering";
    row.record = R"({"spec": {}, "stop_reason": "", "samples_mean": 0})";
    row.tenant = tenant;
    row.reserved_bytes = 70;
    return row;
  }

  test_support::TemporaryFolder folder;
  std::unique_ptr<server::Database> database;
  std::unique_ptr<server::BlobStore> blobs;
  std::unique_ptr<server::Assets> assets;
  std::unique_ptr<server::JobTable> jobs;
};

TEST_F(Quota, TenantMayStoreExactlyUpToTheLimit) {
  StorageQuota quota = this->quota({.tenant_bytes = 100});
  keep_asset("a", 60, "me");
  auto room = quota.room("me", Kind::kAsset);
  EXPECT_TRUE(room.grow_to(40));
  const auto refused = room.grow_to(41);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().code, api::kOverQuota);
  EXPECT_NE(refused.error().message.find("'me' uses 60 already, and 100"), std::string::npos)
      << refused.error().message;
  EXPECT_TRUE(quota.room("other", Kind::kAsset).grow_to(100));
  EXPECT_TRUE(quota.room("", Kind::kAsset).grow_to(1000));
}

TEST_F(Quota, ReservationsCountUntilTheyAreReleased) {
  StorageQuota quota = this->quota({.tenant_bytes = 100});
  {
    auto first = quota.room("me", Kind::kAsset);
    ASSERT_TRUE(first.grow_to(30));
    ASSERT_TRUE(first.grow_to(60));
    EXPECT_FALSE(quota.room("me", Kind::kFilm).grow_to(41));
    auto moved = std::move(first);
    EXPECT_FALSE(quota.room("me", Kind::kFilm).grow_to(41));
  }
  EXPECT_TRUE(quota.room("me", Kind::kFilm).grow_to(100));
}

TEST_F(Quota, UploadOfUnknownSizeMayUseTheLastByte) {
  StorageQuota quota = this->quota({.tenant_bytes = 100});
  auto room = quota.room("me", Kind::kAsset);
  for (std::uint64_t bytes = 1; bytes <= 100; ++bytes) {
    ASSERT_TRUE(room.cover(bytes)) << bytes;
  }
  EXPECT_FALSE(room.cover(101));
}

TEST_F(Quota, AssetCountsOncePerTenantAndOnceInTotal) {
  const StorageQuota quota = this->quota({});
  keep_asset("a", 60, "first");
  keep_asset("a", 60, "second");
  keep_asset("a", 60, "second");
  EXPECT_EQ(quota.of_tenant("first")->asset_bytes, 60U);
  EXPECT_EQ(quota.of_tenant("second")->asset_bytes, 60U);
  EXPECT_EQ(quota.total()->asset_bytes, 60U);
}

TEST_F(Quota, JobCountsWithItsMaximumUntilItEnds) {
  const StorageQuota quota = this->quota({});
  server::JobRow row = job("me");
  ASSERT_TRUE(jobs->insert(row, {}, {}));
  EXPECT_EQ(quota.of_tenant("me")->film_bytes, 70U);
  row.film = server::FilmPlace::kOnDisk;
  row.film_bytes = 20;
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_EQ(quota.of_tenant("me")->film_bytes, 70U);
  row.state = "finished";
  row.finished_at = 5;
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_EQ(quota.of_tenant("me")->film_bytes, 20U);
  EXPECT_EQ(quota.total()->film_bytes, 20U);
  row.film = server::FilmPlace::kEvicted;
  ASSERT_TRUE(jobs->update(row, {}));
  EXPECT_EQ(quota.of_tenant("me")->film_bytes, 0U);
}

TEST_F(Quota, FilmsOfAnOlderStoreCountForTheirOwners) {
  server::JobRow row = job("me");
  row.state = "finished";
  row.finished_at = 5;
  row.film = server::FilmPlace::kOnDisk;
  row.film_bytes = 20;
  ASSERT_TRUE(jobs->insert(row, {}, {}));
  // The schema before there were storage quotas.
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema15));
  ASSERT_TRUE(database->session().execute(test_support::kBackToSchema7));
  constexpr const char* kBack = R"sql(
    ALTER TABLE jobs DROP COLUMN samples_by_error; ALTER TABLE jobs DROP COLUMN split_count;
    DROP INDEX assets_by_owner; ALTER TABLE assets DROP COLUMN owner;
    DROP INDEX job_owners_by_bytes; DROP INDEX jobs_by_film_bytes;
    DROP TABLE loose_films; DROP TABLE job_titles;
    ALTER TABLE job_owners DROP COLUMN reserved_bytes;
    ALTER TABLE job_owners DROP COLUMN stored_bytes;
    PRAGMA user_version=4;
  )sql";
  ASSERT_TRUE(database->session().execute(kBack));
  jobs.reset();
  assets.reset();
  database.reset();
  SetUp();
  const StorageQuota quota = this->quota({});
  EXPECT_EQ(quota.of_tenant("me")->film_bytes, 20U);
  keep_asset("a", 60, "me");
  EXPECT_EQ(quota.of_tenant("me")->asset_bytes, 60U);
}

TEST_F(Quota, TotalLimitsAssetsOfAllTenantsButNoFilms) {
  StorageQuota quota = this->quota({.total_bytes = 100});
  keep_asset("a", 60, "");
  EXPECT_TRUE(quota.room("", Kind::kFilm).grow_to(1000));
  auto room = quota.room("", Kind::kAsset);
  ASSERT_TRUE(room.grow_to(30));
  EXPECT_FALSE(quota.room("me", Kind::kAsset).grow_to(11));
  EXPECT_TRUE(quota.room("me", Kind::kAsset).grow_to(10));
}

}  // namespace
