#include "core/base/zip_reader.h"

#include <fstream>
#include <optional>

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "tests/support/read_bytes.h"
#include "tests/support/zip_files.h"

namespace {

using core::read_zip_directory;
using core::read_zip_entry;
using test_support::bytes_of;
using test_support::make_zip;

std::string text_of(const std::vector<std::byte>& bytes) {
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

TEST(Zip, ReadsStoredAndDeflatedEntries) {
  const std::string repeated(5000, 'a');
  const auto archive = bytes_of(
      make_zip({{"a.txt", "hello"}, {"folder/b.bin", repeated, true}, {"empty", "", true}}));
  const auto entries = read_zip_directory(archive, {});
  ASSERT_TRUE(entries) << entries.error().message;
  ASSERT_EQ(entries->size(), 3U);
  EXPECT_EQ((*entries)[1].name, "folder/b.bin");
  EXPECT_EQ(text_of(*read_zip_entry(archive, (*entries)[0])), "hello");
  EXPECT_EQ(text_of(*read_zip_entry(archive, (*entries)[1])), repeated);
  EXPECT_EQ(text_of(*read_zip_entry(archive, (*entries)[2])), "");
}

TEST(Zip, SkipsFolders) {
  const auto archive = bytes_of(make_zip({{"folder/", ""}, {"folder/a", "x"}}));
  const auto entries = read_zip_directory(archive, {});
  ASSERT_TRUE(entries);
  ASSERT_EQ(entries->size(), 1U);
}

TEST(Zip, RefusesNamesThatLeaveTheArchive) {
  for (const char* name : {"../a", "/etc/passwd", "a/../../b", "a\\..\\..\\b", "\\\\a\\b", "C:/a",
                           "C:\\a", "a//b", "./a", "a\nb"}) {
    const auto archive = bytes_of(make_zip({{name, "x"}}));
    EXPECT_FALSE(read_zip_directory(archive, {})) << name;
  }
}

TEST(Zip, RefusesADuplicateName) {
  EXPECT_FALSE(read_zip_directory(bytes_of(make_zip({{"a", "x"}, {"a", "y"}})), {}));
}

TEST(Zip, EveryTruncationIsAnError) {
  const std::string whole = make_zip({{"a.txt", "hello"}, {"b.bin", std::string(300, 'b'), true}});
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto cut = bytes_of(std::string_view(whole).substr(0, size));
    const auto entries = read_zip_directory(cut, {});
    EXPECT_FALSE(entries) << size;
  }
}

TEST(Zip, EveryFlippedBitIsDetectedOrHarmless) {
  const std::string whole = make_zip({{"a.txt", "hello"}, {"b.bin", std::string(300, 'b'), true}});
  for (std::size_t at = 0; at < whole.size(); ++at) {
    std::string turned = whole;
    turned[at] = static_cast<char>(turned[at] ^ 0x10);
    const auto archive = bytes_of(turned);
    const auto entries = read_zip_directory(archive, {});
    if (!entries) {
      continue;
    }
    for (const auto& entry : *entries) {
      const auto content = read_zip_entry(archive, entry);
      if (content && !content->empty()) {
        EXPECT_TRUE(text_of(*content) == "hello" || text_of(*content) == std::string(300, 'b'));
      }
    }
  }
}

TEST(Zip, ChecksLimitsBeforeUnpacking) {
  const auto bomb = bytes_of(make_zip({{"a", std::string(1 << 20, '\0'), true}}));
  EXPECT_LT(bomb.size(), 4096U);
  EXPECT_EQ(read_zip_directory(bomb, {.entry_bytes_max = 1000}).error().code,
            core::ErrorCode::kTooLarge);
  EXPECT_EQ(read_zip_directory(bomb, {.total_bytes_max = 1000}).error().code,
            core::ErrorCode::kTooLarge);
  const auto many = bytes_of(make_zip({{"a", "x"}, {"b", "x"}, {"c", "x"}}));
  EXPECT_EQ(read_zip_directory(many, {.entries_max = 2}).error().code, core::ErrorCode::kTooLarge);
}

/// The address space of this process, bytes (proc(5), statm).
std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}

/// Allows this much more address space while it lives.
class Tight {
 public:
  explicit Tight(std::uint64_t more_bytes) {
    EXPECT_EQ(::getrlimit(RLIMIT_AS, &before_), 0);
    const rlimit tight = {address_space() + more_bytes, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_AS, &tight), 0);
  }
  ~Tight() { ::setrlimit(RLIMIT_AS, &before_); }
  Tight(const Tight&) = delete;
  Tight& operator=(const Tight&) = delete;

 private:
  rlimit before_ = {};
};

TEST(Zip, RefusesImpossibleDeflateSizesWithoutAllocatingMemory) {
  std::string archive = make_zip({{"a", std::string(100, 'x'), true}});
  const auto entries = read_zip_directory(bytes_of(archive), {});
  ASSERT_TRUE(entries);
  auto entry = entries->front();
  entry.bytes = std::uint64_t{1} << 31U;
  const auto bytes = bytes_of(archive);
  std::optional<core::Error> refused;
  {
    const Tight tight(entry.bytes / 4);
    EXPECT_THROW(std::vector<std::byte>(static_cast<std::size_t>(entry.bytes)), std::bad_alloc)
        << "the limit has no effect";
    refused = read_zip_entry(bytes, entry).error();
  }
  EXPECT_NE(refused->message.find("deflate cannot reach"), std::string::npos) << refused->message;
}

}  // namespace
