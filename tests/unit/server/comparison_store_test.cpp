#include "server/store/comparison_store.h"

#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>

#include <gtest/gtest.h>

#include "tests/unit/server/server_test_support.h"

namespace {

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
  static std::string id(int i) { return "00000000-0000-4000-8000-00000000000" + std::to_string(i); }
  bool has_maps(int i) const { return std::filesystem::exists(data->comparisons_path() + "/" + id(i)); }

  test_support::TemporaryFolder folder;
  std::optional<DataDir> data;
  std::unique_ptr<Database> database;
};

TEST_F(Comparisons, AreFoundWithTheirMaps) {
  ComparisonStore comparisons = store({});
  ASSERT_TRUE(comparisons.insert(id(1), "{\"mse\":1}", {{"z.png", "zzz"}, {"flip.png", "f"}}, 5));
  EXPECT_EQ(*comparisons.find(id(1)), "{\"mse\":1}");
  EXPECT_EQ(std::filesystem::file_size(comparisons.path_of(id(1), "z.png")), 3U);
  EXPECT_EQ(comparisons.find(id(2)).error().code, core::ErrorCode::kNotFound);
}

TEST_F(Comparisons, OfTooManyTheOldestGo) {
  ComparisonStore comparisons = store({.count = 3});
  for (int i = 1; i <= 5; ++i) {
    ASSERT_TRUE(comparisons.insert(id(i), "{}", {{"z.png", "z"}}, i));
  }
  for (int i = 1; i <= 5; ++i) {
    EXPECT_EQ(comparisons.find(id(i)).has_value(), i > 2) << i;
    EXPECT_EQ(has_maps(i), i > 2) << i;
  }
}

TEST_F(Comparisons, OfTooManyBytesTheOldestGoAndTheNewestStays) {
  ComparisonStore comparisons = store({.count = 100, .bytes = 10});
  for (int i = 1; i <= 3; ++i) {
    ASSERT_TRUE(comparisons.insert(id(i), "{}", {{"z.png", "12345"}}, i));
  }
  EXPECT_FALSE(has_maps(1));
  EXPECT_TRUE(has_maps(2));
  ASSERT_TRUE(comparisons.insert(id(4), "{}", {{"z.png", std::string(50, 'x')}}, 4));
  EXPECT_FALSE(has_maps(3));
  EXPECT_TRUE(comparisons.find(id(4)));
}

TEST_F(Comparisons, WhatCannotBeWrittenIsToldAndNotKept) {
  ComparisonStore comparisons = store({});
  std::filesystem::remove_all(data->comparisons_path());
  std::ofstream(data->comparisons_path()) << "no folder";
  EXPECT_FALSE(comparisons.insert(id(1), "{}", {{"z.png", "z"}}, 1));
  EXPECT_FALSE(comparisons.find(id(1)));
}

}  // namespace
