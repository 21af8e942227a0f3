#include "core/camera/camera.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/camera/camera_choice.h"
#include "core/camera/framing.h"
#include "core/camera/orbit.h"
#include "core/math/extreme_points.h"
#include "core/scene/drawn.h"
#include "core/scene/ground.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Bounds;
using core::Camera;
using core::CameraDescription;
using core::CameraSettings;
using core::Vec2;
using core::Vec3;

Bounds unit_box() {
  Bounds b;
  b.add(Vec3{-1, -1, -1});
  b.add(Vec3{1, 1, 1});
  return b;
}

Camera make(const CameraSettings& settings, const std::vector<CameraDescription>& cameras,
            int width, int height) {
  const auto camera = Camera::create(settings, cameras, unit_box(), width, height);
  EXPECT_TRUE(camera);
  return *camera;
}

CameraSettings posed(float fov_degrees) {
  CameraSettings s;
  s.position = Vec3{0, 0, 5};
  s.target = Vec3{0, 0, 0};
  s.vertical_fov_degrees = fov_degrees;
  return s;
}

void expect_direction(Vec3 a, Vec3 b) {
  EXPECT_NEAR(a.x, b.x, 1e-6);
  EXPECT_NEAR(a.y, b.y, 1e-6);
  EXPECT_NEAR(a.z, b.z, 1e-6);
}

TEST(Camera, VerticalFieldOfViewSpansTheHeight) {
  const Camera camera = make(posed(90), {}, 200, 100);
  const float s = std::sqrt(0.5F);
  expect_direction(camera.ray({100, 50}, {}).ray.direction, {0, 0, -1});
  expect_direction(camera.ray({100, 0}, {}).ray.direction, {0, s, -s});  // top edge
  expect_direction(camera.ray({100, 100}, {}).ray.direction, {0, -s, -s});
  expect_direction(camera.ray({200, 50}, {}).ray.direction,
                   normalize(Vec3{2, 0, -1}));  // right edge
}

CameraSettings on_orbit(core::CameraOrbit orbit, int width = 200, int height = 100) {
  return core::placed_on_orbit({}, orbit, unit_box(), width, height);
}

TEST(Camera, OrbitRotatesCounterClockwiseAboutYFromTheFront) {
  core::CameraOrbit orbit{.phi_degrees = 90, .radius_m = 3, .target = Vec3{1, 2, 3}};
  expect_direction(on_orbit(orbit).position->rounded(), {1, 2, 6});
  orbit.theta_degrees = 90;
  expect_direction(on_orbit(orbit).position->rounded(), {4, 2, 3});
  expect_direction(*on_orbit(orbit).up, {0, 1, 0});
  orbit.phi_degrees = 0;
  EXPECT_NEAR(on_orbit(orbit).position->y, 5, 1e-5F);
  // From above, the front of the scene is at the bottom of the image, which is the limit of lower
  // elevations.
  orbit.theta_degrees = 0;
  expect_direction(*on_orbit(orbit).up, {0, 0, -1});
  EXPECT_TRUE(Camera::create(on_orbit(orbit), {}, unit_box(), 200, 100));
}

std::vector<Vec3> corners_of(const core::Bounds& box) {
  std::vector<Vec3> corners;
  for (unsigned corner = 0; corner < 8; ++corner) {
    corners.push_back({(corner & 1U) != 0 ? box.max.x : box.min.x,
                       (corner & 2U) != 0 ? box.max.y : box.min.y,
                       (corner & 4U) != 0 ? box.max.z : box.min.z});
  }
  return corners;
}

TEST(Camera, FramingLeavesTheMarginAtTheNearestSide) {
  // In front of a box of 4 by 1 by 1: the nearest face is half a metre nearer than the centre, and
  // its half width of 2 takes 1 - 2 * 0.08 of half the view's width, tan(45 / 2) * width / height.
  const std::vector<Vec3> box = corners_of({.min = {-2, -0.5F, -0.5F}, .max = {2, 0.5F, 0.5F}});
  const double view = 0.84 * std::tan(45 * std::numbers::pi / 360);
  const auto distance = [&box](float theta_degrees, float phi_degrees, int width) {
    core::CameraOrbit orbit;
    orbit.theta_degrees = theta_degrees;
    orbit.phi_degrees = phi_degrees;
    return static_cast<double>(core::nearest_framing({}, orbit, box, width, 100, 0.08F).distance_m);
  };
  EXPECT_NEAR(distance(0, 90, 100), 0.5 + 2 / view, 1e-4);
  EXPECT_NEAR(distance(0, 90, 200), 0.5 + 1 / view, 1e-4);
  EXPECT_NEAR(distance(0, 90, 800), 0.5 + 0.5 / view, 1e-4);
  EXPECT_NEAR(distance(90, 90, 100), 2 + 0.5 / view, 1e-4);  // from the end
  EXPECT_NEAR(distance(0, 0, 100), 0.5 + 2 / view, 1e-4);    // from above
}

TEST(Camera, FramingTouchesTheMarginAndCentresTheModel) {
  // In units of half the image: the larger of width and height takes 1 - 2 * 0.08 on both sides.
  test_support::Random rng(7);
  for (int turn = 0; turn < 50; ++turn) {
    std::vector<Vec3> points;
    for (int i = 0; i < 12; ++i) {
      points.push_back({100 + 3 * rng.uniform(), rng.uniform() - 7, 0.5F * rng.uniform()});
    }
    core::CameraOrbit orbit;
    orbit.theta_degrees = 360 * rng.uniform();
    orbit.phi_degrees = 180 * rng.uniform();
    const int width = turn % 2 == 0 ? 200 : 60;
    const core::Framing framing = core::nearest_framing({}, orbit, points, width, 100, 0.08F);
    orbit.radius_m = framing.distance_m;
    orbit.target = framing.target;
    const Camera camera = make(on_orbit(orbit, width, 100), {}, width, 100);
    Vec2 low{1, 1};
    Vec2 high{-1, -1};
    for (const Vec3& point : points) {
      const auto at = camera.project(point, {});
      ASSERT_TRUE(at);
      const Vec2 p{2 * at->x / static_cast<float>(width) - 1, 2 * at->y / 100 - 1};
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
    const bool is_wide = high.x - low.x > high.y - low.y;
    EXPECT_NEAR(is_wide ? low.x : low.y, -0.84F, 1e-4F) << turn;
    EXPECT_NEAR(is_wide ? high.x : high.y, 0.84F, 1e-4F) << turn;
    EXPECT_NEAR(low.x, -high.x, 1e-3F) << turn;
    EXPECT_NEAR(low.y, -high.y, 1e-3F) << turn;
  }
}

TEST(Camera, TurningFramingFitsAllAnglesAndTouchesAtOne) {
  // Beside the tightest angle, the distance falls by at most r (1 + 1 / tan) (step / 2)^2 / 2.
  constexpr double kStepDegrees = 0.25;
  constexpr double kDegree = std::numbers::pi / 180;
  const core::Bounds box{.min = {-1, 2, 3}, .max = {3, 3, 3.5F}};
  const std::vector<Vec3> bar = corners_of(box);
  const double span = std::hypot(4.0, 0.5);
  for (const int width : {50, 100, 300}) {
    const double tan_y = 0.84 * std::tan(45 * kDegree / 2);
    const double tan_x = tan_y * width / 100;
    const double fall =
        span / 2 * (1 + 1 / std::min(tan_x, tan_y)) * std::pow(kStepDegrees / 2 * kDegree, 2) / 2;
    for (const float phi_degrees : {0.0F, 20.0F, 75.0F, 90.0F, 140.0F}) {
      core::CameraOrbit orbit;
      orbit.phi_degrees = phi_degrees;
      const core::Framing all = core::turning_framing({}, orbit, bar, width, 100, 0.08F);
      EXPECT_EQ(all.target, box.center());
      const double phi = static_cast<double>(phi_degrees) * kDegree;
      const double sin = std::sin(phi);
      const double cos = std::cos(phi);
      double greatest = 0;
      for (double theta = 0; theta < 360; theta += kStepDegrees) {
        orbit.theta_degrees = static_cast<float>(theta);
        EXPECT_EQ(core::turning_framing({}, orbit, bar, width, 100, 0.08F).distance_m,
                  all.distance_m);
        for (const Vec3& corner : bar) {
          const core::Place at = core::Place(corner) - core::Place(box.center());
          const double x = std::cos(theta * kDegree) * at.x - std::sin(theta * kDegree) * at.z;
          const double z = std::sin(theta * kDegree) * at.x + std::cos(theta * kDegree) * at.z;
          const double outward = z * sin + at.y * cos;
          const double up = at.y * sin - z * cos;
          greatest =
              std::max(greatest, outward + std::max(std::fabs(x) / tan_x, std::fabs(up) / tan_y));
        }
      }
      constexpr double kRounding = 1e-5;  // some units in the last place of 20 m
      EXPECT_GE(all.distance_m, greatest - kRounding) << width << " " << phi_degrees;
      EXPECT_LE(all.distance_m, greatest + fall + kRounding) << width << " " << phi_degrees;
    }
  }
}

TEST(ExtremePoints, AreTheCornersOfABox) {
  core::ExtremePoints extremes;
  EXPECT_TRUE(extremes.points().empty());
  const std::vector<Vec3> corners = corners_of({.min = {-1, -2, -3}, .max = {1, 5, 4}});
  for (const Vec3& corner : corners) {
    extremes.add({0, 0, 0});
    extremes.add(corner);
    extremes.add(corner * 0.5F);
  }
  const std::vector<Vec3> found = extremes.points();
  EXPECT_EQ(found.size(), corners.size());
  for (const Vec3& corner : corners) {
    EXPECT_EQ(std::count(found.begin(), found.end(), corner), 1);
  }
}

TEST(ExtremePoints, ReadTheExtentOfASphere) {
  test_support::Random rng(3);
  const auto direction = [&rng] {
    const float z = 2 * rng.uniform() - 1;
    const float angle = 2 * core::kPi * rng.uniform();
    return Vec3{std::sqrt(1 - z * z) * std::cos(angle), std::sqrt(1 - z * z) * std::sin(angle), z};
  };
  core::ExtremePoints extremes;
  for (int i = 0; i < 100'000; ++i) {
    extremes.add(direction());
  }
  const std::vector<Vec3> points = extremes.points();
  EXPECT_EQ(points.size(), core::ExtremePoints::kDirections);
  float least = 1;
  for (int i = 0; i < 10'000; ++i) {
    const Vec3 d = direction();
    float extent = -1;
    for (const Vec3& point : points) {
      extent = std::max(extent, dot(point, d));
    }
    least = std::min(least, extent);
  }
  EXPECT_GE(least, std::cos(10 * core::kPi / 180));
}

TEST(Camera, AutomaticOrbitContainsTheWholeBox) {
  for (const int width : {200, 50}) {
    for (const float theta : {0.0F, 35.0F, 200.0F}) {
      core::CameraOrbit orbit;
      orbit.theta_degrees = theta;
      const Camera camera = make(on_orbit(orbit, width, 100), {}, width, 100);
      for (const float x : {-1.0F, 1.0F}) {
        for (const float y : {-1.0F, 1.0F}) {
          const auto seen = camera.project({x, y, 1}, {});
          ASSERT_TRUE(seen);
          EXPECT_GE(std::min(seen->x, seen->y), 0);
          EXPECT_LE(seen->x, static_cast<float>(width));
          EXPECT_LE(seen->y, 100);
        }
      }
    }
  }
}

TEST(Camera, FileCameraLooksAlongMinusZ) {
  CameraDescription file;
  file.name = "front";
  file.vertical_fov_rad = 1.5707964F;
  file.to_world = core::translation({1, 2, 3});
  const Camera camera = make({}, {file}, 100, 100);
  EXPECT_TRUE(camera.ray({50, 50}, {}).ray.origin == (Vec3{1, 2, 3}));
  expect_direction(camera.ray({50, 50}, {}).ray.direction, {0, 0, -1});
}

// glTF 2.0, 3.10: "the local +X axis is to the right, the "lens" looks towards the local -Z axis,
// and the top of the camera is aligned with the local +Y axis".
TEST(Camera, FileCamerasKeepTheirAxesIfTheirNodeMirrors) {
  const core::Transform turned = {{0.6F, 0.8F, 0}, {-0.8F, 0.6F, 0}, {0, 0, 1}, {1, 2, 3}};
  for (const Vec3 scale : {Vec3{-1, 1, 1}, Vec3{1, -1, 1}, Vec3{1, 1, -1}, Vec3{-2, -2, -2}}) {
    for (const bool flat : {false, true}) {
      CameraDescription file;
      file.orthographic = flat;
      file.vertical_fov_rad = 1.5707964F;
      file.to_world = turned * core::scaling(scale);
      const Camera camera = make({}, {file}, 100, 100);
      const Vec3 x = normalize(file.to_world.x);
      const Vec3 y = normalize(file.to_world.y);
      const Vec3 z = normalize(file.to_world.z);
      const core::Ray ray = camera.ray({75, 40}, {}).ray;  // half to the right, a fifth up
      const Vec3 aside = x * 0.5F + y * 0.2F;
      expect_direction(ray.direction, flat ? -z : normalize(aside - z));
      expect_direction(ray.origin, file.to_world.t + (flat ? aside : Vec3{}));
      const auto seen = camera.project(ray.origin + ray.direction * 7, {});
      ASSERT_TRUE(seen);
      EXPECT_NEAR(seen->x, 75, 1e-3);
      EXPECT_NEAR(seen->y, 40, 1e-3);
      const Vec2 found = camera.importance(ray.origin, ray.direction).film_px;
      EXPECT_NEAR(found.x, 75, 1e-3);
      EXPECT_NEAR(found.y, 40, 1e-3);
    }
  }
}

TEST(Camera, FileCamerasWithoutADirectionAreRefusedByName) {
  CameraDescription file;
  file.name = "flat";
  file.to_world = core::scaling({0, 0, 0});
  const auto camera = Camera::create({}, {file}, unit_box(), 100, 100);
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().where, "/camera");
  EXPECT_EQ(camera.error().message,
            "the scene's camera 'flat' has no direction, because its node is scaled to 0");
}

TEST(Camera, OrthographicRaysAreParallelAndOneMagnificationApart) {
  CameraDescription file;
  file.orthographic = true;
  file.x_magnification = 4;
  file.y_magnification = 2;
  const Camera camera = make({}, {file}, 200, 100);
  const auto top = camera.ray({100, 0}, {}).ray;
  const auto right = camera.ray({200, 50}, {}).ray;
  expect_direction(top.direction, {0, 0, -1});
  EXPECT_NEAR(top.origin.y, 2, 1e-6);
  EXPECT_NEAR(right.origin.x, 4, 1e-6);
}

TEST(Camera, AnyPoseCanBeOrthographic) {
  CameraSettings settings = posed(45);
  settings.vertical_fov_degrees.reset();
  settings.type = core::CameraType::kOrthographic;
  settings.orthographic_height_m = 3.0F;
  const Camera given = make(settings, {}, 200, 100);
  expect_direction(given.ray({180, 10}, {}).ray.direction, {0, 0, -1});
  EXPECT_NEAR(given.ray({100, 0}, {}).ray.origin.y, 1.5F, 1e-6);
  EXPECT_NEAR(given.ray({200, 50}, {}).ray.origin.x, 3, 1e-6);
  EXPECT_NEAR(given.ray({200, 50}, {}).width_m, 0.03F, 1e-8);
  // The default height is that of 45 degrees at the target, 5 m away.
  settings.orthographic_height_m.reset();
  settings.focus_distance_m = 1.0F;
  EXPECT_NEAR(make(settings, {}, 200, 100).ray({100, 0}, {}).ray.origin.y,
              5 * std::tan(0.39269908F), 1e-5);
}

TEST(Camera, ProjectionOfAFileCameraCanBeOverridden) {
  CameraDescription file;
  file.vertical_fov_rad = 1.5707964F;
  file.to_world = core::translation({1, 2, 3});
  CameraSettings settings;
  settings.type = core::CameraType::kOrthographic;
  const Camera flat = make(settings, {file}, 100, 100);
  expect_direction(flat.ray({9, 9}, {}).ray.direction, {0, 0, -1});
  EXPECT_NEAR(flat.ray({50, 0}, {}).ray.origin.y, 5, 1e-5);  // the centre of the scene is 3 m ahead
  file.orthographic = true;
  settings.type = core::CameraType::kPerspective;
  settings.vertical_fov_degrees = 90.0F;
  const float s = std::sqrt(0.5F);
  expect_direction(make(settings, {file}, 100, 100).ray({50, 0}, {}).ray.direction, {0, s, -s});
}

TEST(Camera, PanoramaSeesAllDirections) {
  CameraSettings settings;
  settings.type = core::CameraType::kPanorama;
  settings.position = Vec3{1, 2, 3};
  settings.target = Vec3{1, 2, 0};  // along -z: +x is to the right
  const Camera camera = make(settings, {}, 400, 200);
  const auto direction = [&](float x, float y) { return camera.ray({x, y}, {}).ray.direction; };
  expect_direction(direction(200, 100), {0, 0, -1});
  expect_direction(direction(300, 100), {1, 0, 0});
  expect_direction(direction(100, 100), {-1, 0, 0});
  expect_direction(direction(0, 100), {0, 0, 1});
  expect_direction(direction(123, 0), {0, 1, 0});
  expect_direction(direction(123, 200), {0, -1, 0});
  const float s = std::sqrt(0.5F);
  expect_direction(direction(200, 50), {0, s, -s});
  EXPECT_TRUE(camera.ray({7, 9}, {}).ray.origin == (Vec3{1, 2, 3}));
  EXPECT_FALSE(camera.is_pinhole());
  test_support::Random random(1);
  for (int i = 0; i < 1000; ++i) {
    const Vec2 film = {400 * random.uniform(), 2 + 196 * random.uniform()};
    const Vec3 point =
        camera.ray(film, {}).ray.origin + direction(film.x, film.y) * (0.1F + 9 * random.uniform());
    const auto seen = camera.project(point, {0.5F, 0.5F});
    ASSERT_TRUE(seen);
    // Rounding of metres over 0.1 m at 64 pixels per radian, wider towards the poles.
    EXPECT_NEAR(std::remainder(seen->x - film.x, 400.0F), 0, 0.02);
    EXPECT_NEAR(seen->y, film.y, 1e-3);
  }
}

// Over a pixel, an angle of pi / 200 each way, importance is one over its solid angle.
TEST(Camera, ImportanceOfAPanoramaIntegratesToOneOverEachPixel) {
  CameraSettings settings;
  settings.type = core::CameraType::kPanorama;
  settings.position = Vec3{0, 0, 0};
  settings.target = Vec3{0.3F, 0.1F, 1};
  const Camera camera = make(settings, {}, 400, 200);
  for (const int row : {1, 40, 100, 170, 198}) {
    const double top = 3.14159265358979 / 200 * row;
    const double area =
        3.14159265358979 / 200 * (std::cos(top) - std::cos(top + 3.14159265358979 / 200));
    const core::Ray ray = camera.ray({33.5F, static_cast<float>(row) + 0.5F}, {}).ray;
    const auto importance = camera.importance(ray.origin, ray.direction);
    EXPECT_NEAR(static_cast<double>(importance.we) * area, 1, row == 1 || row == 198 ? 0.02 : 1e-3)
        << row;
    EXPECT_EQ(importance.we, importance.pdf_solid_angle);
  }
}

// A scene without a camera is framed: eye = c + r / sin(min(vertical, horizontal fov) / 2) *
// normalize(0, 0.25, 1).
TEST(Camera, FramesASceneWithoutACamera) {
  for (const auto& [width, height] :
       {std::pair{100, 100}, std::pair{300, 100}, std::pair{100, 300}}) {
    const Camera camera = make({}, {}, width, height);
    const float r = std::sqrt(3.0F);
    const float vertical = 0.7853982F;
    const float horizontal = 2 * std::atan(std::tan(vertical / 2) * static_cast<float>(width) /
                                           static_cast<float>(height));
    const float distance = r / std::sin(std::min(vertical, horizontal) / 2);
    const Vec3 way = normalize(Vec3{0, 0.25F, 1});
    const auto ray =
        camera.ray({static_cast<float>(width) / 2, static_cast<float>(height) / 2}, {}).ray;
    EXPECT_NEAR(length(ray.origin - way * distance), 0, 1e-5);
    expect_direction(ray.direction, -way);
  }
}

// From the front, it would be a line that no pixel shows.
TEST(Camera, SeesAModelThatIsFlatInXFromItsRight) {
  for (const float width : {0.0F, 1e-5F, 0.1F}) {
    Bounds box;
    box.add(Vec3{-width, -1, -1});
    box.add(Vec3{width, 1, 1});
    const auto camera = Camera::create({}, {}, box, 100, 100);
    ASSERT_TRUE(camera);
    const bool is_flat = width < 0.01F;
    expect_direction(camera->forward(),
                     -normalize(is_flat ? Vec3{1, 0.25F, 0} : Vec3{0, 0.25F, 1}));
  }
}

TEST(ViewFaults, AreAllReported) {
  const auto wheres = [](const CameraSettings& s) {
    std::vector<std::string> out;
    for (const core::Error& fault : core::view_faults(s)) {
      out.push_back(fault.where);
    }
    return out;
  };
  CameraSettings s;
  EXPECT_EQ(wheres(s), std::vector<std::string>());
  s.name = "front";
  s.index = 0;
  s.up = Vec3{0, 0, 0};
  s.target = Vec3{0, 0, 0};
  EXPECT_EQ(wheres(s),
            (std::vector<std::string>{"/camera/index", "/camera/up", "/camera/position"}));
  s = {};
  s.position = Vec3{0, 0, 1};
  s.target = Vec3{0, 0, 0};
  EXPECT_EQ(wheres(s), std::vector<std::string>());
  s.up = Vec3{0, 1e-17F, 0};
  EXPECT_EQ(wheres(s), std::vector<std::string>{"/camera/up"});
}

// The limit of parallel directions is a sine of 1e-6.
TEST(ViewFaults, HoldForDirectionsThatFloatsTellApart) {
  EXPECT_TRUE(core::span_view({0, 0, -3}, {0, 2e-6, 1}));
  EXPECT_FALSE(core::span_view({0, 0, -3}, {0, 5e-7, 1}));
  EXPECT_FALSE(core::span_view({0, 0, 0}, {0, 1, 0}));
  EXPECT_FALSE(core::span_view({0, 0, -1}, {0, 0, 0}));
}

TEST(Camera, ReportsInvalidSettings) {
  CameraDescription file;
  file.name = "front";
  CameraDescription flat;
  flat.name = "flat";
  flat.orthographic = true;
  const std::vector<CameraDescription> cameras = {file, flat};
  const auto where = [&](const CameraSettings& s) {
    const auto camera = Camera::create(s, cameras, unit_box(), 10, 10);
    return camera ? std::string("none") : camera.error().where;
  };
  CameraSettings s;
  s.name = "back";
  EXPECT_EQ(where(s), "/camera/name");
  const auto reason = [&s](const std::vector<CameraDescription>& some) {
    return Camera::create(s, some, unit_box(), 10, 10).error().message;
  };
  EXPECT_EQ(reason(cameras), "the scene has no camera 'back'; it has 'front', 'flat'");
  EXPECT_EQ(reason({file, {}, {}}),
            "the scene has no camera 'back'; it has 'front' and 2 without a name, which have an "
            "index from 0 to 2");
  s = {};
  s.index = 2;
  EXPECT_EQ(where(s), "/camera/index");
  s.index = 0;
  s.name = "front";
  EXPECT_EQ(where(s), "/camera/index");
  s = {};
  s.name = "flat";
  s.vertical_fov_degrees = 40;
  EXPECT_EQ(where(s), "/camera/vertical_fov_degrees");
  s = {};
  s.position = Vec3{1, 1, 1};
  EXPECT_EQ(where(s), "/camera/target");
  s.target = s.position;
  EXPECT_EQ(where(s), "/camera/target");
  s.target = Vec3{1, 5, 1};
  EXPECT_EQ(where(s), "/camera/up");
  s = {};
  s.name = "front";
  s.orthographic_height_m = 2.0F;
  EXPECT_EQ(where(s), "/camera/orthographic_height");
  s.name = "flat";
  EXPECT_EQ(where(s), "none");
  s = {};
  s.type = core::CameraType::kPanorama;
  s.vertical_fov_degrees = 40;
  EXPECT_EQ(where(s), "/camera/vertical_fov_degrees");
  s.vertical_fov_degrees.reset();
  s.aperture_radius_m = 0.1F;
  EXPECT_EQ(where(s), "/camera/aperture_radius");
}

// Truth 16, the lens: origins are uniform on the aperture's disk, and rays of one film point meet
// in the focal plane.
TEST(CameraChi2, LensIsAUniformDisk) {
  CameraSettings s = posed(40);
  s.aperture_radius_m = 0.25F;
  s.focus_distance_m = 4;
  const Camera camera = make(s, {}, 100, 100);
  test_support::Random random(3);
  std::vector<double> observed(12 * 16, 0.0);
  constexpr int kSamples = 100000;
  const Vec3 meeting = camera.ray({30, 80}, {0.5F, 0.5F}).ray.direction *
                           (4 / -camera.ray({30, 80}, {0.5F, 0.5F}).ray.direction.z) +
                       Vec3{0, 0, 5};
  for (int i = 0; i < kSamples; ++i) {
    const auto ray = camera.ray({30, 80}, random.uniform_2d()).ray;
    EXPECT_NEAR(ray.origin.z, 5, 1e-6);
    const Vec3 at = ray.origin + ray.direction * (4 / -ray.direction.z);
    ASSERT_NEAR(length(at - meeting), 0, 1e-5);
    const double r2 =
        static_cast<double>(ray.origin.x * ray.origin.x + ray.origin.y * ray.origin.y) / 0.0625;
    const double phi =
        std::atan2(static_cast<double>(ray.origin.y), static_cast<double>(ray.origin.x)) /
            6.2831853 +
        0.5;
    ++observed[std::min<std::size_t>(static_cast<std::size_t>(r2 * 12), 11) * 16 +
               std::min<std::size_t>(static_cast<std::size_t>(phi * 16), 15)];
  }
  const std::vector<double> expected(observed.size(), kSamples / 192.0);
  EXPECT_GT(test_support::chi2(observed, expected).p_value, 0.001);  // the false alarm rate
}

/// Looks along -z from (0, 0, 5) at the box from -1 to 1.
Camera with_planes(bool is_orthographic, float near_m, float far_m) {
  CameraDescription file;
  file.orthographic = is_orthographic;
  file.to_world.t = {0, 0, 5};
  file.near_m = near_m;
  file.far_m = far_m;
  return make({}, {file}, 100, 100);
}

TEST(CameraPlanes, BoundTheRays) {
  for (const bool is_orthographic : {false, true}) {
    const Camera camera = with_planes(is_orthographic, 4.5F, 5.5F);
    for (const Vec2 film : {Vec2{50, 50}, Vec2{3, 90}}) {
      const Camera::CameraRay ray = camera.ray(film, {});
      EXPECT_NEAR(ray.ray.origin.z, 0.5F, 1e-6);
      EXPECT_NEAR((ray.ray.origin + ray.ray.direction * ray.ray.t_max).z, -0.5F, 1e-6);
      EXPECT_NEAR(ray.from_lens().z, 5, 1e-6);
    }
    // Light from points beyond the planes does not reach the film, and the way of other light ends
    // at the near plane.
    EXPECT_EQ(camera.sample_wi({0.1F, 0, 0.6F}, {}).pdf_solid_angle, 0);
    EXPECT_EQ(camera.sample_wi({0.1F, 0, -0.6F}, {}).pdf_solid_angle, 0);
    const auto seen = camera.sample_wi({0.1F, 0, -0.25F}, {});
    EXPECT_GT(seen.pdf_solid_angle, 0);
    EXPECT_NEAR(seen.origin.z, 0.5F, 1e-6);
    EXPECT_TRUE(camera.project({0.1F, 0, 0.6F}, {}));  // of objects, whether clipped or not
  }
}

TEST(CameraPlanes, DoNothingWhereTheyCutNothing) {
  const core::Ray unbounded;
  for (const bool is_orthographic : {false, true}) {
    const auto ray = with_planes(is_orthographic, 3.9F, 6.1F).ray({30, 20}, {});
    EXPECT_EQ(ray.start_m, 0);
    EXPECT_EQ(ray.ray.origin.z, 5);
    EXPECT_EQ(ray.ray.t_max, unbounded.t_max);
  }
}

TEST(CameraPlanes, ANearPlaneBehindTheWholeModelIsNotMeant) {
  // As in a scene scaled down under a camera whose planes were not.
  for (const bool is_orthographic : {false, true}) {
    EXPECT_EQ(with_planes(is_orthographic, 6.1F, 1000).ray({30, 20}, {}).start_m, 0);
    EXPECT_GT(with_planes(is_orthographic, 5.9F, 1000).ray({30, 20}, {}).start_m, 5);  // is meant
  }
}

// Planes have no least distance: in a scene of another scale a near plane may be as small.
TEST(CameraPlanes, ClipAtAnyScale) {
  for (const float scale : {1e-9F, 1e-6F, 1.0F}) {
    CameraDescription file;  // within the box from -1 to 1
    file.near_m = 0.5F * scale;
    file.far_m = 0.75F * scale;
    const auto ray = make({}, {file}, 100, 100).ray({50, 50}, {});
    EXPECT_FLOAT_EQ(ray.start_m, 0.5F * scale);
    EXPECT_FLOAT_EQ(ray.ray.t_max, 0.25F * scale);
  }
}

TEST(CameraPlanes, BelongToCamerasOfTheFile) {
  CameraDescription file;
  file.near_m = 4.5F;
  file.far_m = 5.5F;
  const core::Ray unbounded;
  const auto ray = make(posed(90), {file}, 100, 100).ray({30, 20}, {});
  EXPECT_EQ(ray.start_m, 0);
  EXPECT_EQ(ray.ray.t_max, unbounded.t_max);
}

TEST(CameraPlanes, ThatMissTheWholeModelGiveAWarning) {
  // A square from z = -1 to 1, seen from z = 5.
  const auto warnings = [](const std::vector<std::pair<float, float>>& planes) {
    core::SceneDescription scene =
        test_support::scene_of({test_support::lambert({1, 1, 1})},
                               {test_support::quad({-1, 0, -1}, {0, 0, 2}, {2, 0, 0}, 0)});
    for (const auto& [near_m, far_m] : planes) {
      CameraDescription& camera = scene.cameras.emplace_back();
      camera.name = "c" + std::to_string(scene.cameras.size());
      camera.to_world.t = {0, 0, 5};
      camera.near_m = near_m;
      camera.far_m = far_m;
    }
    std::string all;
    const auto built = test_support::build(std::move(scene));
    for (const core::Warning& w : built->summary().warnings) {
      all += w.code + ": " + w.detail + "\n";
    }
    return all;
  };
  EXPECT_EQ(warnings({{0.1F, 100}, {4.5F, 5.5F}, {4, 6}, {5.9F, 100}, {0, 4.1F}}), "");
  EXPECT_EQ(
      warnings({{0.1F, 3.5F}, {10, 100}, {0, 100}, {7, 9}}),
      "camera: camera 'c1': its zfar of 3.5 m lies before the whole model, of which nothing is "
      "visible\n"
      "camera: camera 'c2': its znear of 10 m lies behind the whole model; it is left out (and "
      "1 more cameras alike)\n");
}

TEST(SceneBounds, AreThoseOfWhatIsDrawn) {
  core::MaterialDescription hidden = test_support::lambert({1, 1, 1});
  hidden.alpha_mode = core::AlphaMode::kBlend;
  hidden.base_alpha = 0;
  core::MaterialDescription cut = hidden;
  cut.alpha_mode = core::AlphaMode::kMask;
  cut.base_alpha = 0.4F;
  core::PrimitiveDescription seen = test_support::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0);
  seen.positions.push_back({100, 0, 0});  // of no triangle
  seen.normals.clear();
  for (auto& uv : seen.uv) {
    uv.clear();
  }
  const core::SceneDescription scene =
      test_support::scene_of({test_support::lambert({1, 1, 1}), hidden, cut},
                             {seen, test_support::quad({0, 0, -50}, {1, 0, 0}, {0, 1, 0}, 1),
                              test_support::quad({0, 90, 0}, {1, 0, 0}, {0, 1, 0}, 2)});
  for (const Bounds& bounds :
       {core::bounds_of(scene), test_support::build(scene)->summary().bounds}) {
    EXPECT_TRUE(bounds.min == (Vec3{0, 0, 0}));
    EXPECT_TRUE(bounds.max == (Vec3{1, 1, 0}));
  }
}

/// 64 x 64, 8-bit RGBA: alpha is `left` in the left half and `right` in the right one.
std::shared_ptr<const core::Image> two_alphas(int left, int right) {
  auto image = std::make_shared<core::Image>();
  image->width = image->height = 64;
  image->channels = 4;
  image->bytes.assign(std::size_t{64} * 64 * 4, std::byte{255});
  for (std::size_t i = 0; i < std::size_t{64} * 64; ++i) {
    image->bytes[4 * i + 3] = std::byte(i % 64 < 32 ? left : right);
  }
  return image;
}

struct AlphaCase {
  core::AlphaMode mode;
  float factor;
  int texel;         ///< alpha where the distant object is, of 255
  float vertex = 1;  ///< its alpha of vertices
  bool is_drawn = false;
};

/// A unit square that is drawn, and one 50 m below it that the case hides or not.
core::SceneDescription with_distant(const AlphaCase& c) {
  core::MaterialDescription material = test_support::lambert({1, 1, 1});
  material.alpha_mode = c.mode;
  material.base_alpha = c.factor;
  material.base_color_texture.image = 0;
  material.base_color_texture.uv_transform = {0.25F, 0, 0.125F, 0, 0.25F, 0.125F};  // left half
  core::PrimitiveDescription distant = test_support::quad({0, -50, 0}, {1, 0, 0}, {0, 1, 0}, 1);
  distant.uv[0] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  distant.colors.assign(distant.positions.size(), {1, 1, 1, c.vertex});
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert({1, 1, 1}), material},
      {test_support::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0), std::move(distant)});
  scene.images.push_back(two_alphas(c.texel, 255));
  return scene;
}

TEST(SceneBounds, LeaveOutWhatTexturesAndVerticesHide) {
  using core::AlphaMode;
  for (const AlphaCase& c : {AlphaCase{AlphaMode::kBlend, 1, 0},
                             {AlphaMode::kBlend, 1, 255, 0},
                             {AlphaMode::kMask, 1, 127},        // below .5
                             {AlphaMode::kMask, 0.6F, 191},     // .6 * .75
                             {AlphaMode::kMask, 1, 153, 0.8F},  // .8 * .6
                             {AlphaMode::kBlend, 1, 1, 1, true},
                             {AlphaMode::kMask, 1, 128, 1, true},
                             {AlphaMode::kMask, 0.6F, 230, 1, true},
                             {AlphaMode::kOpaque, 0, 0, 0, true}}) {
    const core::SceneDescription scene = with_distant(c);
    for (const Bounds& bounds :
         {core::bounds_of(scene), test_support::build(scene)->summary().bounds}) {
      EXPECT_EQ(bounds.min.y, c.is_drawn ? -50 : 0) << c.factor << ' ' << c.texel;
    }
    core::SceneDescription grounded = scene;
    core::GroundSettings catcher;
    catcher.type = core::GroundType::kCatcher;
    core::add_ground(grounded, catcher);
    const float ground = grounded.meshes.back().primitives[0].positions[0].y;
    EXPECT_NEAR(ground, c.is_drawn ? -50 : 0, 0.01) << c.factor << ' ' << c.texel;
  }
}

TEST(SceneBounds, LeaveOutWhatIsScaledToAPoint) {
  core::SceneDescription scene =
      test_support::scene_of({}, {test_support::quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, -1)});
  scene.instances.push_back(scene.instances[0]);
  scene.instances[1].to_world = core::translation({0, 0, 90}) * core::scaling({0, 0, 0});
  for (const Bounds& bounds :
       {core::bounds_of(scene), test_support::build(scene)->summary().bounds}) {
    EXPECT_EQ(bounds.max.z, 0);
  }
}

}  // namespace
