#include "clients/cli/shown.h"

#include <gtest/gtest.h>

namespace {

using cli::shown;

TEST(Shown, ControlCharactersAreTexts) {
  EXPECT_EQ(shown("\x1b]0;title\x07\x1b[31mX"), "\\u{1b}]0;title\\u{7}\\u{1b}[31mX");
  EXPECT_EQ(shown("a\rb\bc\x7f"), "a\\u{d}b\\u{8}c\\u{7f}");
  EXPECT_EQ(shown("\xc2\x9b"
                  "31m"),
            "\\u{9b}31m");  // CSI as one character of C1.
}

TEST(Shown, DirectionMarksAreTexts) {
  EXPECT_EQ(shown("gltf\xe2\x80\xaegnp.exe"), "gltf\\u{202e}gnp.exe");
  EXPECT_EQ(shown("\xe2\x81\xa6x\xe2\x81\xa9"), "\\u{2066}x\\u{2069}");
}

TEST(Shown, OtherTextsStay) {
  for (const char* text : {"", "two\nlines\tand tabs",
                           "K\xc3\xbc"
                           "che \xe5\x8f\xb0 \xf0\x9f\xab\x96"}) {
    EXPECT_EQ(shown(text), text);
  }
}

TEST(Shown, WhatIsNotUtf8IsReplaced) {
  EXPECT_EQ(shown("a\xff"
                  "b"),
            "a\xef\xbf\xbd"
            "b");
  EXPECT_EQ(shown("\xe2\x80"), "\xef\xbf\xbd\xef\xbf\xbd");
}

}  // namespace
