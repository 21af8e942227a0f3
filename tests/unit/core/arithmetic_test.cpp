#include "core/accel/arithmetic.h"

#include <string>

#include <gtest/gtest.h>

namespace {

TEST(Arithmetic, NamesTheInstructionSetAndTheArchitecture) {
  const auto isa = core::resolve_isa("native");
  ASSERT_TRUE(isa);
  const std::string text = core::arithmetic_class(*isa);
  EXPECT_NE(text.find(", " + *isa + ", "), std::string::npos) << text;
#ifdef __x86_64__
  EXPECT_EQ(core::architecture_of(text), "x86-64") << text;
#else
  EXPECT_EQ(*isa, "neon");
  EXPECT_EQ(core::architecture_of(text), "arm64") << text;
#endif
}

TEST(Arithmetic, AnInstructionSetOfAnotherArchitectureIsRefused) {
#ifdef __x86_64__
  const auto isa = core::resolve_isa("neon");
#else
  const auto isa = core::resolve_isa("avx2");
#endif
  ASSERT_FALSE(isa);
  EXPECT_NE(isa.error().message.find("is not one of native, "), std::string::npos);
}

}  // namespace
