#include <array>
#include <string>

#include <gtest/gtest.h>

#include "server/http/negotiation.h"

namespace server {
namespace {

std::string best_of(std::string_view accept) {
  constexpr std::array<std::string_view, 3> kOffers = {"image/png", "image/webp", "image/x-exr"};
  const auto best = negotiate_media_type(accept, kOffers);
  return best ? std::string(kOffers[*best]) : "";
}

TEST(HttpNegotiation, NoPreferenceGivesTheFirstOffer) {
  EXPECT_EQ(best_of(""), "image/png");
  EXPECT_EQ(best_of("*/*"), "image/png");
  EXPECT_EQ(best_of("image/*"), "image/png");
}

TEST(HttpNegotiation, HighestQualityWins) {
  EXPECT_EQ(best_of("image/png;q=0.5, image/x-exr"), "image/x-exr");
  EXPECT_EQ(best_of("image/png;q=0.501, image/webp;q=0.502"), "image/webp");
  EXPECT_EQ(best_of("IMAGE/WebP"), "image/webp");
}

TEST(HttpNegotiation, MostSpecificRangeDecides) {
  EXPECT_EQ(best_of("image/*, image/png;q=0"), "image/webp");
  EXPECT_EQ(best_of("*/*;q=0.1, image/x-exr;q=0.2"), "image/x-exr");
}

TEST(HttpNegotiation, ReportsThatNothingFits) {
  EXPECT_EQ(best_of("text/html"), "");
  EXPECT_EQ(best_of("image/png;q=0"), "");
  EXPECT_EQ(best_of("image/png;q=2, image/webp;q=x"), "");
}

TEST(HttpNegotiation, NamedTypesGoBeforeWildcardsInTheOrderOfTheirNames) {
  // As browsers ask for <img>: what they name is what they prefer.
  EXPECT_EQ(best_of("image/avif,image/webp,image/apng,image/svg+xml,image/*,*/*;q=0.8"),
            "image/webp");
  EXPECT_EQ(best_of("*/*, image/x-exr, image/webp"), "image/x-exr");
  EXPECT_EQ(best_of("image/*, image/webp;q=0.9"), "image/png");
}

TEST(HttpNegotiation, EncodingsRequireAQualityAboveZero) {
  EXPECT_TRUE(accepts_encoding("gzip, deflate, br", "gzip"));
  EXPECT_TRUE(accepts_encoding("*", "gzip"));
  EXPECT_FALSE(accepts_encoding("*, gzip;q=0", "gzip"));
  EXPECT_FALSE(accepts_encoding("br", "gzip"));
  EXPECT_FALSE(accepts_encoding("", "gzip"));
}

}  // namespace
}  // namespace server
