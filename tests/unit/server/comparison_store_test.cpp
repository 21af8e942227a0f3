#include "server/store/comparison_store.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include <gtest/gtest.h>

#include "tests/unit/server/server_test_support.h"

namespace {

using server::Access;
using server::ComparisonLimits;
using server::ComparisonStore;
using server::Database;
using server::DataDir;

class Comparisons : public testing::Test {
 protected:
  void SetUp() override {
    auto opened = DataDir::open(folder.file("data"));
    ASSERT_TRUE(opened) << opened.error().message;
    data.emplace(std::move(*opened));
    auto base = Database::open(data->database_path());
    ASSERT_TRUE(base) << base.error().message;
    database = std::move(*base);
  }
  ComparisonStore store(ComparisonLimits limits) { return {*database, *data, limits}; }
  static ComparisonStore::Row row(int i, std::string body) {
    return {.id = id(i), .body = std::move(body), .tenant = "me", .created_at = 1.0 * i};
  }
  static std::string id(int i) { return "00000000-0000-4000-8000-00000000000" + std::to_string(i); }
  bool has_maps(int i) const {
    return std::filesystem::exists(data->comparisons_path() + "/" + id(i));
  }

  test_support::TemporaryFolder folder;
  std::optional<DataDir> data;
  std::unique_ptr<Database> database;
};

TEST_F(Comparisons, AreFoundWithTheirMaps) {
  ComparisonStore comparisons = store({});
  ASSERT_TRUE(comparisons.insert(row(1, "{\"mse\":1}"), {{"z.png", "zzz"}, {"flip.png", "f"}}));
  EXPECT_EQ(*comparisons.find(id(1), Access::of("me")), "{\"mse\":1}");
  EXPECT_TRUE(comparisons.find(id(1), Access::operators()));
  EXPECT_EQ(comparisons.find(id(1), Access::of("other")).error().code, core::ErrorCode::kNotFound);
  EXPECT_EQ(std::filesystem::file_size(comparisons.path_of(id(1), "z.png")), 3U);
  EXPECT_EQ(comparisons.find(id(2), Access::of("me")).error().code, core::ErrorCode::kNotFound);
}

TEST_F(Comparisons, RemovesTheOldestBeyondTheMaximumCount) {
  ComparisonStore comparisons = store({.count = 3});
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(comparisons.insert(row(i, "{}"), {{"z.png", "z"}}));
  }
  for (int i = 1; i <= 5; ++i) {
    EXPECT_EQ(comparisons.find(id(i), Access::of("me")).has_value(), i > 2) << i;
    EXPECT_EQ(has_maps(i), i > 2) << i;
  }
}

TEST_F(Comparisons, RemovesTheOldestBeyondTheMaximumBytesButKeepsTheNewest) {
  ComparisonStore comparisons = store({.count = 100, .bytes = 10});
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE(comparisons.insert(row(i, "{}"), {{"z.png", "12345"}}));
  }
  EXPECT_FALSE(has_maps(1));
  EXPECT_TRUE(has_maps(2));
  ASSERT_TRUE(comparisons.insert(row(4, "{}"), {{"z.png", std::string(50, 'x')}}));
  EXPECT_FALSE(has_maps(3));
  EXPECT_TRUE(comparisons.find(id(4), Access::of("me")));
}

TEST_F(Comparisons, OfATenantThatMakesManyReplaceNoOthers) {
  ComparisonStore comparisons = store({.count = 3, .bytes = 10});
  ComparisonStore::Row of_another = row(1, "{}");
  of_another.tenant = "a";
  ASSERT_TRUE(comparisons.insert(of_another, {{"z.png", "z"}}));
  for (int i = 2; i <= 5; ++i) {
    ASSERT_TRUE(comparisons.insert(row(i, "{}"), {{"z.png", "123"}}));
  }
  for (int i = 1; i <= 5; ++i) {
    EXPECT_EQ(has_maps(i), i == 1 || i > 3) << i;
  }
}

TEST_F(Comparisons, AreNotStoredIfTheOldestCannotBeRemoved) {
  ComparisonStore comparisons = store({.count = 1});
  ASSERT_TRUE(comparisons.insert(row(1, "{}"), {{"z.png", "z"}}));
  const auto refuse = [](Database::Session& session) {
    return session
        .prepare(
            "CREATE TRIGGER full BEFORE DELETE ON comparisons "
            "BEGIN SELECT RAISE(ABORT, 'the disk is full'); END")
        .run();
  };
  ASSERT_TRUE(database->transact(refuse));
  EXPECT_FALSE(comparisons.insert(row(2, "{}"), {{"z.png", "z"}}));
  EXPECT_FALSE(comparisons.find(id(2), Access::of("me")));
  EXPECT_FALSE(has_maps(2));
  EXPECT_TRUE(comparisons.find(id(1), Access::of("me")));
  EXPECT_TRUE(has_maps(1));
}

TEST_F(Comparisons, ReportsAndDropsComparisonsThatCannotBeWritten) {
  ComparisonStore comparisons = store({});
  std::filesystem::remove_all(data->comparisons_path());
  std::ofstream(data->comparisons_path()) << "the folder does not exist";
  EXPECT_FALSE(comparisons.insert(row(1, "{}"), {{"z.png", "z"}}));
  EXPECT_FALSE(comparisons.find(id(1), Access::of("me")));
}

}  // namespace
