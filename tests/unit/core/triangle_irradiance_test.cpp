#include "core/lights/triangle_irradiance.h"

#include <cmath>
#include <numbers>

#include <gtest/gtest.h>

#include "core/math/numbers.h"
#include "tests/support/statistics.h"

namespace {

using core::triangle_irradiance;
using core::Vec3;

constexpr double kPi = std::numbers::pi;

double quad_irradiance(Vec3 point, Vec3 normal, Vec3 corner, Vec3 u, Vec3 v) {
  return triangle_irradiance(point, normal, corner, corner + u, corner + u + v) +
         triangle_irradiance(point, normal, corner, corner + u + v, corner + v);
}

// A unit square at distance 1 gives .7522747 in closed form.
TEST(TriangleIrradiance, OfTheUnitSquareAtDistanceOneMatchesTheClosedForm) {
  EXPECT_NEAR(quad_irradiance({0, 0, 0}, {0, 1, 0}, {-0.5F, 1, -0.5F}, {1, 0, 0}, {0, 0, 1}),
              0.7522747, 1e-6);
}

TEST(TriangleIrradiance, OfAnInfinitePlaneIsPi) {
  EXPECT_NEAR(quad_irradiance({0, 0, 0}, {0, 0, 1}, {-1e4F, -1e4F, 1}, {2e4F, 0, 0}, {0, 2e4F, 0}),
              kPi, 1e-6);
}

// A plane perpendicular to the receiver covers half of the hemisphere.
TEST(TriangleIrradiance, CountsOnlyThePartAboveTheHorizon) {
  EXPECT_NEAR(
      quad_irradiance({0, 0, 0}, {0, 0, 1}, {1e-4F, -1e4F, -1e4F}, {0, 2e4F, 0}, {0, 0, 2e4F}),
      kPi / 2, 1e-4);
  EXPECT_EQ(triangle_irradiance({0, 0, 0}, {0, 0, 1}, {0, 0, -1}, {1, 0, -1}, {0, 1, -2}), 0);
}

// Small and far: E = area cos cos / r^2 to the order of (size / r)^2.
TEST(TriangleIrradiance, KeepsPrecisionForSmallLights) {
  const Vec3 a = {0, 0, 100};
  const double area = 0.5 * 1e-4;
  EXPECT_NEAR(
      triangle_irradiance({0, 0, 0}, {0, 0, 1}, a, a + Vec3{0.01F, 0, 0}, a + Vec3{0, 0.01F, 0}) /
          (area / 1e4),
      1, 1e-5);
}

TEST(TriangleIrradiance, AgreesWithQuadratureIfTheHorizonCutsIt) {
  const Vec3 point = {0.2F, 0.1F, -0.3F};
  const Vec3 normal = core::normalize({0.3F, 0.8F, 0.5F});
  const Vec3 a = {-2, 0.5F, 1};
  const Vec3 e1 = {3, -1.5F, 0.4F};
  const Vec3 e2 = {0.7F, 1.2F, 2};
  const Vec3 facing = core::normalize(core::cross(e1, e2));
  const double twice_area = static_cast<double>(core::length(core::cross(e1, e2)));
  const auto integrand = [&](double s,
                             double t) {  // the square folded onto the triangle, with its area
    const double r = std::sqrt(s);
    const Vec3 to =
        a + e1 * static_cast<float>(r * (1 - t)) + e2 * static_cast<float>(r * t) - point;
    const double d2 = static_cast<double>(core::dot(to, to));
    const double d = std::sqrt(d2);
    const double at = static_cast<double>(core::dot(to, normal)) / d;
    const double from = std::fabs(static_cast<double>(core::dot(to, facing))) / d;
    return at > 0 ? 0.5 * twice_area * at * from / d2 : 0.0;
  };
  const double x[2] = {0, 1};
  EXPECT_NEAR(triangle_irradiance(point, normal, a, a + e1, a + e2),
              test_support::integrate_2d(integrand, x, x, 1e-7, 4, 14), 2e-5);
}

}  // namespace
