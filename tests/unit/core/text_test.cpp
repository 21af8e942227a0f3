// Text of ASCII: letters, digits and blanks.
#include "core/base/text.h"

#include <vector>

#include <gtest/gtest.h>

#include "core/base/sha256.h"

namespace {

TEST(Text, OnlyTheLettersOfAsciiHaveCase) {
  EXPECT_EQ(core::in_lower_case("@AZ[`az{ \xC4\xD6"), "@az[`az{ \xC4\xD6");  // A and O with dots
  EXPECT_TRUE(core::equal_ignoring_case("Content-TYPE", "content-type"));
  EXPECT_FALSE(core::equal_ignoring_case("a", "ab"));
  EXPECT_FALSE(core::equal_ignoring_case("@", "`"));  // differ as letters do
}

TEST(Text, WordsHaveLettersDigitsAndTheOthersThatAreNamed) {
  EXPECT_TRUE(core::is_word("azAZ09"));
  EXPECT_TRUE(core::is_word(""));
  EXPECT_TRUE(core::is_word("a-b.c", "-."));
  for (const char* text : {"a-b", "a b", "@", "[", "`", "{", "/", ":", "\xE9"}) {
    EXPECT_FALSE(core::is_word(text)) << text;
  }
}

TEST(Text, LosesItsByteOrderMark) {
  EXPECT_EQ(core::without_byte_order_mark("\xEF\xBB\xBF{}"), "{}");
  EXPECT_EQ(core::without_byte_order_mark("\xEF\xBB"), "\xEF\xBB");
}

TEST(Text, IsJoinedFromParts) {
  EXPECT_EQ(core::joined(std::vector<std::string>{"a", "b", "c"}, ", "), "a, b, c");
  EXPECT_EQ(core::joined(std::vector<std::string>(), ", "), "");
}

TEST(Text, NumbersAreShortest) {
  EXPECT_EQ(core::shortest_text(22.5), "22.5");
  EXPECT_EQ(core::shortest_text(90.0), "90");
  EXPECT_EQ(core::shortest_text(0.1F), "0.1");
  EXPECT_EQ(core::shortest_text(-2.2250738585072014e-308), "-2.2250738585072014e-308");
}

TEST(Text, IsTrimmedAtBothEnds) {
  EXPECT_EQ(core::trimmed("\t a b \r", " \t\r"), "a b");
  EXPECT_EQ(core::trimmed(" \ta", " "), "\ta");
  EXPECT_EQ(core::trimmed("  ", " "), "");
  EXPECT_EQ(core::trimmed("", " "), "");
}

TEST(Text, HexadecimalDigitsAreReadInBothCases) {
  const std::string_view digits = "0123456789abcdef";
  for (int c = -128; c < 128; ++c) {
    const auto at = digits.find(core::to_lower(static_cast<char>(c)));
    EXPECT_EQ(core::hex_digit(static_cast<char>(c)),
              at == std::string_view::npos ? -1 : static_cast<int>(at));
  }
}

// FIPS 180-2, appendix B.1.
TEST(Sha256, OfAbcIsThePublishedValue) {
  EXPECT_EQ(core::sha256_hex("abc", 3),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
}

}  // namespace
