// Importance of the camera: its directions, its normalisation, and light splatted through the lens
// against light seen through it.
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include <gtest/gtest.h>

#include "core/camera/camera.h"
#include "tests/support/statistics.h"

namespace {

using core::Camera;
using core::CameraDescription;
using core::CameraSettings;
using core::Vec2;
using core::Vec3;
using test_support::Random;

constexpr int kWidth = 12;
constexpr int kHeight = 8;

struct Kind {
  const char* name;
  bool orthographic;
  float aperture_radius_m;
  core::DistortionModel distortion = core::DistortionModel::kNone;
  bool is_fisheye() const { return distortion == core::DistortionModel::kFisheye; }
};
constexpr std::array<Kind, 7> kKinds = {
    {{"pinhole", false, 0},
     {"thin lens", false, 0.3F},
     {"orthographic", true, 0},
     {"orthographic with a lens", true, 0.3F},
     {"distorted", false, 0, core::DistortionModel::kOpencv},
     {"distorted with a lens", false, 0.3F, core::DistortionModel::kOpencv},
     {"fisheye", false, 0, core::DistortionModel::kFisheye}}};

/// Looks from (0.5, 1, 4) along -z, slightly rotated; in focus 3 m away.
Camera make(const Kind& kind) {
  CameraDescription file;
  file.orthographic = kind.orthographic;
  file.y_magnification = 1.25F;
  file.vertical_fov_rad = 1.2F;
  const float c = std::cos(0.1F);
  const float s = std::sin(0.1F);
  file.to_world = {{c, 0, -s}, {0, 1, 0}, {s, 0, c}, {0.5F, 1, 4}};
  CameraSettings settings;
  settings.aperture_radius_m = kind.aperture_radius_m;
  settings.focus_distance_m = 3;
  if (kind.distortion != core::DistortionModel::kNone) {
    settings.type = core::CameraType::kPinhole;
    settings.fx_px = 9;
    settings.fy_px = 8;
    settings.cx_px = 5.5;
    settings.cy_px = 4.25;
    settings.distortion.model = kind.distortion;
    settings.distortion.k = kind.is_fisheye() ? std::vector<double>{-0.05, 0, 0, 0}
                                              : std::vector<double>{-0.12, 0.05, 0.004, -0.006};
  }
  const auto camera = Camera::create(settings, {file}, {}, kWidth, kHeight);
  EXPECT_TRUE(camera);
  return *camera;
}

Vec2 film_at(Random& random) {
  return {(1.2F * random.uniform() - 0.1F) * kWidth, (1.2F * random.uniform() - 0.1F) * kHeight};
}

TEST(CameraImportance, ProjectsAHitToTheFilmPointOfItsRay) {
  for (const Kind& kind : kKinds) {
    const Camera camera = make(kind);
    Random random(1);
    for (int i = 0; i < 1000; ++i) {
      const Vec2 film = film_at(random);
      const Vec2 lens = random.uniform_2d();
      const core::Ray ray = camera.ray(film, lens).ray;
      const auto along = camera.importance(ray.origin, ray.direction);
      // Rounding at coordinates of about ten metres, with 8 pixels per metre.
      EXPECT_NEAR(along.film_px.x, film.x, 1e-4) << kind.name;
      EXPECT_NEAR(along.film_px.y, film.y, 1e-4) << kind.name;
      const float t = 0.5F + 5 * random.uniform();
      const Vec3 point = ray.origin + ray.direction * t;
      // The lens of an orthographic camera moves with the film point: a point out of focus is seen
      // along the direction, not through the lens point.
      const auto seen = camera.sample_wi(point, lens);
      ASSERT_GT(seen.pdf_solid_angle, 0);
      EXPECT_NEAR(length(seen.wi_world + ray.direction), 0, 1e-5) << kind.name;
      EXPECT_NEAR(length(seen.origin - ray.origin), 0, 1e-5) << kind.name;
      EXPECT_NEAR(seen.distance_m, t, 1e-5) << kind.name;
      const auto projected = camera.project(point, lens);
      ASSERT_TRUE(projected);
      EXPECT_NEAR(projected->x, film.x, 1e-4 / static_cast<double>(t) + 1e-4) << kind.name;
      EXPECT_NEAR(projected->y, film.y, 1e-4 / static_cast<double>(t) + 1e-4) << kind.name;
    }
  }
}

TEST(CameraImportance, SeesNothingBehindTheCamera) {
  for (const Kind& kind : kKinds) {
    const Camera camera = make(kind);
    const Vec3 behind = Vec3{0.5F, 1, 4} - camera.forward() * 2;
    EXPECT_FALSE(camera.project(behind, {0.3F, 0.6F})) << kind.name;
    EXPECT_EQ(camera.sample_wi(behind, {0.3F, 0.6F}).pdf_solid_angle, 0) << kind.name;
    EXPECT_EQ(camera.importance({0.5F, 1, 4}, -camera.forward()).we, 0) << kind.name;
  }
}

/// Solid angle of a triangle of unit directions. Source: van Oosterom and Strackee 1983.
double solid_angle(Vec3 a, Vec3 b, Vec3 c) {
  const double volume = std::fabs(static_cast<double>(dot(a, cross(b, c))));
  const double below = 1 + static_cast<double>(dot(a, b) + dot(b, c) + dot(c, a));
  return 2 * std::atan2(volume, below);
}

double solid_angle(const std::array<Vec3, 4>& d) {
  return solid_angle(d[0], d[1], d[2]) + solid_angle(d[2], d[1], d[3]);
}

/// Integral of we cos over the rays of one pixel, from areas and solid angles of small cells.
double mass_of_pixel(const Kind& kind, Vec2 corner_px) {
  constexpr int kCells = 16;
  constexpr float kStep = 1.0F / kCells;
  const Camera camera = make(kind);
  const auto ray = [&](Vec2 p, Vec2 lens) { return camera.ray(p, lens).ray; };
  const auto we_cos = [&](const core::Ray& r) {
    const float cosine = kind.is_fisheye() ? 1.0F : dot(r.direction, camera.forward());
    return static_cast<double>(camera.importance(r.origin, r.direction).we * cosine);
  };
  const auto cells = [](auto&& visit) {
    for (int i = 0; i < kCells * kCells; ++i) {
      const Vec2 at = {static_cast<float>(i % kCells) * kStep,
                       static_cast<float>(i / kCells) * kStep};
      visit(std::array<Vec2, 4>{at, at + Vec2{kStep, 0}, at + Vec2{0, kStep},
                                at + Vec2{kStep, kStep}},
            at + Vec2{kStep / 2, kStep / 2});
    }
  };
  const double lens_area = std::numbers::pi * static_cast<double>(kind.aperture_radius_m) *
                           static_cast<double>(kind.aperture_radius_m);
  double mass = 0;
  if (!kind.orthographic) {  // positions on the lens outside, directions inside
    for (const Vec2 lens : {Vec2{0.5F, 0.5F}, Vec2{0.1F, 0.8F}}) {
      cells([&](const std::array<Vec2, 4>& square, Vec2 middle) {
        std::array<Vec3, 4> d;
        for (std::size_t k = 0; k < 4; ++k) {
          d[k] = ray(corner_px + square[k], lens).direction;
        }
        mass += 0.5 * solid_angle(d) * we_cos(ray(corner_px + middle, lens));
      });
    }
    return kind.aperture_radius_m > 0 ? mass * lens_area : mass;
  }
  const Vec2 middle_px = corner_px + Vec2{0.5F, 0.5F};
  const Vec2 lens = {0.5F, 0.5F};
  const Vec3 across = ray(corner_px + Vec2{1, 0}, lens).origin - ray(corner_px, lens).origin;
  const Vec3 down = ray(corner_px + Vec2{0, 1}, lens).origin - ray(corner_px, lens).origin;
  const double area = static_cast<double>(length(cross(across, down)));
  if (!(kind.aperture_radius_m > 0)) {
    return area * we_cos(ray(middle_px, lens));
  }
  cells([&](const std::array<Vec2, 4>& square, Vec2 middle) {
    std::array<Vec3, 4> d;
    for (std::size_t k = 0; k < 4; ++k) {
      d[k] = ray(middle_px, square[k]).direction;
    }
    mass += area * solid_angle(d) * we_cos(ray(middle_px, middle));
  });
  return mass;
}

TEST(CameraImportance, IntegratesToOneOverEachPixel) {
  for (const Kind& kind : kKinds) {
    for (const Vec2 corner : {Vec2{0, 0}, Vec2{5, 3}, Vec2{11, 7}}) {
      // Cells are flat to second order: 1/16 of a pixel that is 0.17 rad wide. The edges of float
      // cells of the lens are exact to 1e-5 of their length.
      EXPECT_NEAR(mass_of_pixel(kind, corner), 1, 2e-3) << kind.name << ' ' << corner.x;
    }
  }
}

TEST(CameraImportance, IsTheProductOfTheDensitiesOverTheCosine) {
  for (const Kind& kind : kKinds) {
    const Camera camera = make(kind);
    const core::Ray ray = camera.ray({2, 1}, {0.3F, 0.9F}).ray;
    const auto at = camera.importance(ray.origin, ray.direction);
    const float cosine = kind.is_fisheye() ? 1.0F : dot(ray.direction, camera.forward());
    EXPECT_NEAR(at.we * cosine, at.pdf_area * at.pdf_solid_angle, 1e-5F * at.we);
  }
}

/// A point light in front of a diffuse wall, in a plane slightly behind the focus.
constexpr Vec3 kLight = {0.2F, 1.3F, 0.9F};
constexpr float kWallZ = -0.4F;

/// Radiance of the wall at a point, for albedo and intensity one.
double wall_radiance(Vec3 p) {
  const Vec3 d = kLight - p;
  const double squared = static_cast<double>(dot(d, d));
  return static_cast<double>(d.z) / std::sqrt(squared) / squared / std::numbers::pi;
}

using Pixels = std::array<test_support::Moments, kWidth * kHeight>;

void see(const Camera& camera, Pixels& pixels, int samples) {
  Random random(5);
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      for (int i = 0; i < samples; ++i) {
        const Vec2 film = Vec2{static_cast<float>(x), static_cast<float>(y)} + random.uniform_2d();
        const core::Ray ray = camera.ray(film, random.uniform_2d()).ray;
        const Vec3 hit = ray.origin + ray.direction * ((kWallZ - ray.origin.z) / ray.direction.z);
        pixels[static_cast<std::size_t>(y * kWidth + x)].add(wall_radiance(hit));
      }
    }
  }
}

/// The same by particles: from the light over the sphere, to the wall, through the lens. `bend`
/// plants a fault.
void splat(const Camera& camera, Pixels& pixels, int particles,
           const std::function<float(const Camera::ImportanceSample&)>& bend) {
  Random random(6);
  std::vector<double> sums(kWidth * kHeight, 0.0);
  std::vector<double> squares(kWidth * kHeight, 0.0);
  for (int i = 0; i < particles; ++i) {
    // Direction to the wall, uniform over the hemisphere.
    const float z = random.uniform();
    const float phi = 6.2831853F * random.uniform();
    const float r = std::sqrt(1 - z * z);
    const Vec3 direction = {r * std::cos(phi), r * std::sin(phi), -z};
    const Vec2 lens = random.uniform_2d();
    if (!(z > 0)) {
      continue;
    }
    const Vec3 hit = kLight + direction * ((kWallZ - kLight.z) / direction.z);
    const auto seen = camera.sample_wi(hit, lens);
    if (!(seen.pdf_solid_angle > 0) || !(seen.wi_world.z > 0)) {
      continue;
    }
    const double power = 2 * std::numbers::pi;  // intensity over the density of directions
    const double value = power / std::numbers::pi * static_cast<double>(seen.wi_world.z) *
                         static_cast<double>(seen.importance.we / seen.pdf_solid_angle) *
                         static_cast<double>(bend(seen));
    const Vec2 at = seen.importance.film_px;
    if (at.x >= 0 && at.x < kWidth && at.y >= 0 && at.y < kHeight) {
      const auto pixel = static_cast<std::size_t>(at.y) * kWidth + static_cast<std::size_t>(at.x);
      sums[pixel] += value;
      squares[pixel] += value * value;
    }
  }
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    pixels[i].n = particles;
    pixels[i].mean = sums[i] / particles;
    pixels[i].m2 = squares[i] - sums[i] * pixels[i].mean;
  }
}

/// p-value of the sum of squared differences, in standard errors, over all pixels.
double agreement(const Kind& kind,
                 const std::function<float(const Camera::ImportanceSample&)>& bend) {
  const Camera camera = make(kind);
  Pixels seen;
  Pixels splatted;
  see(camera, seen, 400);
  splat(camera, splatted, 300000, bend);
  double chi2 = 0;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    const double error2 = seen[i].standard_error() * seen[i].standard_error() +
                          splatted[i].standard_error() * splatted[i].standard_error();
    const double d = seen[i].mean - splatted[i].mean;
    chi2 += d * d / error2;
  }
  // Wilson and Hilferty 1931: the cube root of chi-squared over its degrees of freedom is nearly
  // normal.
  const double k = static_cast<double>(seen.size());
  const double z = (std::cbrt(chi2 / k) - (1 - 2 / (9 * k))) / std::sqrt(2 / (9 * k));
  return 0.5 * std::erfc(z / std::numbers::sqrt2);
}

TEST(CameraImportance, SplattedLightEqualsLightSeenThroughTheLens) {
  for (const Kind& kind : kKinds) {
    EXPECT_GT(agreement(kind, [](const auto&) { return 1.0F; }),
              test_support::sidak(0.001, kKinds.size()))
        << kind.name;
  }
}

TEST(CameraImportance, DetectsAnExtraCosineInASplat) {
  for (const Kind& kind : {kKinds[0], kKinds[1]}) {  // nearly one for orthographic cameras
    const Camera camera = make(kind);
    const auto cosine = [&](const auto& seen) { return -dot(seen.wi_world, camera.forward()); };
    EXPECT_LT(agreement(kind, cosine), test_support::sidak(0.001, kKinds.size())) << kind.name;
  }
}

TEST(CameraImportance, DetectsFivePercentTooMuch) {
  for (const Kind& kind : kKinds) {
    EXPECT_LT(agreement(kind, [](const auto&) { return 1.05F; }),
              test_support::sidak(0.001, kKinds.size()))
        << kind.name;
  }
}

}  // namespace
