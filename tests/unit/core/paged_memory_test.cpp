// Large arrays in files: their pages leave the process and come back as they were.
#include "core/base/paged_memory.h"

#include <cstdint>
#include <cstdio>
#include <numeric>

#include <gtest/gtest.h>
#include <unistd.h>

#include "core/image_io/image.h"
#include "core/textures/texture.h"

namespace {

using core::PagedVector;

std::size_t resident_set_bytes() {
  unsigned long all = 0;
  unsigned long resident = 0;
  std::FILE* file = std::fopen("/proc/self/statm", "r");
  EXPECT_NE(file, nullptr);
  if (file != nullptr) {
    EXPECT_EQ(std::fscanf(file, "%lu %lu", &all, &resident), 2);
    std::fclose(file);
  }
  return resident * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
}

constexpr std::size_t kLarge = 4 * core::kPagedBytes / sizeof(std::uint32_t);

/// Expects that an array keeps its values when it is set aside, and takes no memory then.
void expect_kept(bool in_file) {
  PagedVector<std::uint32_t> values(kLarge);
  EXPECT_EQ(values[kLarge / 2], 0);
  std::iota(values.begin(), values.end(), 0U);
  EXPECT_EQ(resident_bytes(values), in_file ? 0 : kLarge * sizeof(std::uint32_t));
  const std::size_t before = resident_set_bytes();
  set_aside(values);
  if (in_file) {
    EXPECT_LT(resident_set_bytes() + 3 * core::kPagedBytes, before);
  }
  for (std::size_t i = 0; i < kLarge; i += 1021) {
    ASSERT_EQ(values[i], i);
  }
}

TEST(PagedMemory, KeepsItsContents) { expect_kept(true); }

TEST(PagedMemory, IsPlainMemoryWithoutAFolder) {
  core::set_paging_folder("/nowhere/at/all");
  expect_kept(false);
  core::set_paging_folder("");  // the default
}

TEST(PagedMemory, SmallArraysAreAsOthers) {
  PagedVector<float> values(100, 1.0F);
  EXPECT_EQ(resident_bytes(values), 400);
  set_aside(values);
  EXPECT_EQ(values[99], 1);
}

// Eight sets of 2048 x 2048 texels have 179 MB with their levels.
TEST(PagedMemory, TexturesThatAreNotReadTakeLittleMemory) {
  core::Image image;
  image.width = image.height = 2048;
  image.channels = 4;
  image.bytes.resize(image.value_count());
  for (std::size_t i = 0; i < image.bytes.size(); ++i) {
    image.bytes[i] = static_cast<std::byte>(i * 2654435761U >> 24);
  }
  const std::size_t before = resident_set_bytes();
  std::vector<std::shared_ptr<const core::Texture>> textures;
  std::size_t counted = 0;
  for (int i = 0; i < 8; ++i) {
    textures.push_back(core::Texture::create(image, i % 2 == 0));
    counted += textures.back()->bytes();
  }
  EXPECT_LT(resident_set_bytes(), before + (std::size_t{70} << 20));
  EXPECT_LT(counted, std::size_t{50} << 20);
  EXPECT_FLOAT_EQ(
      textures[1]->alpha(5, 7),
      static_cast<float>(std::to_integer<int>(image.bytes[4 * (7 * 2048 + 5) + 3])) / 255);
}

}  // namespace
