// Photon lookups: each photon in the radius once, none farther away, in the same order.
#include "core/integrators/maps/photon_map.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "tests/support/statistics.h"

namespace {

using core::Photon;
using core::PhotonMap;
using core::Vec3;
using test_support::Random;

Vec3 somewhere(Random& random, float side) {
  const auto along = [&] { return (random.uniform() - 0.5F) * side; };
  return {along(), along(), along()};
}

std::vector<std::vector<Photon>> parts_of(const std::vector<Vec3>& positions, std::size_t each) {
  std::vector<std::vector<Photon>> parts;
  for (std::size_t i = 0; i < positions.size(); ++i) {
    if (i % each == 0) {
      parts.emplace_back();
    }
    Photon photon;
    photon.position = positions[i];
    photon.power = core::Rgb(static_cast<float>(i));
    parts.back().push_back(photon);
  }
  return parts;
}

std::vector<float> found(const PhotonMap& map, Vec3 point) {
  std::vector<float> numbers;
  map.each(point, [&](const Photon& photon) { numbers.push_back(photon.power.r); });
  return numbers;
}

TEST(PhotonMap, FindsEachPhotonWithinTheRadiusOnce) {
  Random random(1);
  std::vector<Vec3> positions;
  for (int i = 0; i < 3000; ++i) {
    positions.push_back(somewhere(random, 2));
  }
  constexpr float kRadius = 0.21F;
  auto parts = parts_of(positions, 700);
  const PhotonMap map(parts, kRadius);
  EXPECT_EQ(map.size(), positions.size());
  for (int i = 0; i < 500; ++i) {
    const Vec3 point = somewhere(random, 2.4F);
    std::vector<float> expected;
    for (std::size_t k = 0; k < positions.size(); ++k) {
      const Vec3 d = positions[k] - point;
      if (core::dot(d, d) <= kRadius * kRadius) {
        expected.push_back(static_cast<float>(k));
      }
    }
    std::vector<float> seen = found(map, point);
    std::sort(seen.begin(), seen.end());
    ASSERT_EQ(seen, expected);
  }
}

TEST(PhotonMap, OrderIsIndependentOfTheParts) {
  Random random(2);
  std::vector<Vec3> positions;
  for (int i = 0; i < 2000; ++i) {
    positions.push_back(somewhere(random, 1));
  }
  auto one = parts_of(positions, positions.size());
  auto many = parts_of(positions, 37);
  const PhotonMap a(one, 0.15F);
  const PhotonMap b(many, 0.15F);
  for (int i = 0; i < 100; ++i) {
    const Vec3 point = somewhere(random, 1);
    ASSERT_EQ(found(a, point), found(b, point));
  }
}

TEST(PhotonMap, FindsNothingWithoutPhotons) {
  std::vector<std::vector<Photon>> parts(3);
  EXPECT_TRUE(found(PhotonMap(parts, 1), {}).empty());
  EXPECT_TRUE(found(PhotonMap(), {}).empty());
}

TEST(PackedDirection, IsAccurateToOneTenThousandth) {
  Random random(3);
  for (int i = 0; i < 10000; ++i) {
    const Vec3 v = core::normalize(somewhere(random, 2));
    const Vec3 w = core::PackedDirection(v).unpacked();
    ASSERT_LT(core::length(v - w), 1e-4F);
  }
  for (const Vec3 axis : {Vec3{0, 0, 1}, Vec3{0, 0, -1}, Vec3{-1, 0, 0}, Vec3{0, 1, 0}}) {
    EXPECT_LT(core::length(axis - core::PackedDirection(axis).unpacked()), 1e-6F);
  }
}

TEST(PhotonRules, RadiiDecreaseAsPublished) {
  // r_{i+1}^2 = r_i^2 (i + alpha) / (i + 1).
  EXPECT_DOUBLE_EQ(core::sppm_radius(0.5F, 0), 1);
  EXPECT_DOUBLE_EQ(core::sppm_radius(0.5F, 1), std::sqrt(1.5 / 2));
  EXPECT_DOUBLE_EQ(core::sppm_radius(0.5F, 2), std::sqrt(1.5 / 2 * 2.5 / 3));
  EXPECT_DOUBLE_EQ(core::sppm_radius(1, 1000), 1);
  // The area decreases as N^(alpha - 1): from 1000 to 8000 passes to 8^(-1/2).
  const double ratio = core::sppm_radius(0.5F, 8000) / core::sppm_radius(0.5F, 1000);
  EXPECT_NEAR(ratio * ratio, 1 / std::sqrt(8), 1e-3);
}

TEST(PhotonRules, RadiusInForceCountsTheSamplesOfAReplicate) {
  core::RenderSettings settings;
  settings.photons.alpha = 0.5F;
  settings.replicates = 2;
  EXPECT_EQ(core::radius_ratio(settings, 1), 1);
  EXPECT_EQ(core::radius_ratio(settings, 2), 1);
  // Samples 4 and 5 are the third ones of their replicates.
  for (const int samples : {5, 6}) {
    EXPECT_DOUBLE_EQ(core::radius_ratio(settings, samples), std::sqrt(1.5 / 2 * 2.5 / 3));
  }
  settings.replicates = 3;
  EXPECT_DOUBLE_EQ(core::radius_ratio(settings, 6), std::sqrt(1.5 / 2));
}

TEST(PhotonRules, NumberOfParticlesIsThatOfPixelsWithinLimits) {
  core::RenderSettings settings;
  settings.film.width = 8;
  settings.film.height = 8;
  EXPECT_EQ(core::photon_paths(settings), 4096);
  settings.film.width = settings.film.height = 100;
  EXPECT_EQ(core::photon_paths(settings), 10000);
  settings.film.width = settings.film.height = 10000;
  EXPECT_EQ(core::photon_paths(settings), 262144);
  settings.photons.paths = 7;
  EXPECT_EQ(core::photon_paths(settings), 7);
}

}  // namespace
