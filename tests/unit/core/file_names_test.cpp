// Names of files as Windows and macOS compare them; areas of texels.
#include "core/base/file_names.h"

#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/math/area_cover.h"

namespace {

TEST(FileNames, AreComparedWithoutCaseSlashesAndComposition) {
  EXPECT_EQ(core::folded_name("Textures\\Ku\u0308che.PNG"),
            core::folded_name("textures/KÜCHE.png"));
  EXPECT_EQ(core::folded_name("\u30ab\u3099"),
            core::folded_name("\u30ac"));  // ga, as macOS stores it
  EXPECT_NE(core::folded_name("a.png"), core::folded_name("b.png"));
  EXPECT_EQ(core::folded_name("\xff\\a"), "\xff/a");  // not UTF-8
}

TEST(FileNames, FindTheSameNameElseTheOnlyOneAlike) {
  core::FileNames names;
  for (const char* name : {"a.png", "A.png", "B.png"}) {
    names.add(name);
  }
  EXPECT_EQ(names.find("A.png"), 1U);
  EXPECT_EQ(names.find("b.PNG"), 2U);
  EXPECT_FALSE(names.find("A.PNG").has_value());
  EXPECT_FALSE(names.find("c.png").has_value());
}

TEST(FileNames, NearNamesDifferByCaseEscapesOrFolderOnly) {
  core::FileNames names;
  for (const char* name : {"in/a.png", "A.png", "a b.png", "my%20map.png", "other.png"}) {
    names.add(name);
  }
  EXPECT_EQ(names.near("a.PNG"), "; there is \"in/a.png\", \"A.png\"");
  EXPECT_EQ(names.near("textures\\A b.png"), "; there is \"a b.png\"");
  EXPECT_EQ(names.near("my map.png"), "; there is \"my%20map.png\"");
  EXPECT_EQ(names.near("none.png"), "");
}

TEST(FileNames, PlainNamesStayInTheirFolder) {
  const std::pair<const char*, const char*> rows[] = {
      {"q.bin", "q.bin"},  {"./sub/../q.bin", "q.bin"}, {"a//b/./c", "a/b/c"},
      {"a/../b/c", "b/c"}, {"a/b/../../c", "c"},        {"", ""}};
  for (const auto& [name, plain] : rows) {
    EXPECT_EQ(core::plain_name(name), plain) << name;
  }
  for (const char* outside : {"../a.png", "a/../../b", "..", "/etc/passwd"}) {
    EXPECT_FALSE(core::plain_name(outside)) << outside;
  }
}

TEST(PercentEncode, KeepsUnreservedCharacters) {
  EXPECT_EQ(core::percent_encode("aZ0-._~ /?&=\xff"), "aZ0-._~%20%2F%3F%26%3D%FF");
}

TEST(AreaCover, SharesOfAPartAndOfATexelAreWhole) {
  for (const auto& [size, parts] : {std::pair{7, 3}, {8, 4}, {1000, 300}, {5, 5}, {3, 1}}) {
    std::vector<double> taken(static_cast<std::size_t>(size));
    for (const core::AreaCover& cover : core::area_covers(size, parts)) {
      double sum = 0;
      for (std::size_t k = 0; k < cover.shares.size(); ++k) {
        sum += static_cast<double>(cover.shares[k]);
        taken[static_cast<std::size_t>(cover.first) + k] += static_cast<double>(cover.shares[k]);
      }
      EXPECT_NEAR(sum, 1, 1e-6);
    }
    for (const double share : taken) {
      EXPECT_NEAR(share, static_cast<double>(parts) / size, 1e-6) << size << ' ' << parts;
    }
  }
}

}  // namespace
