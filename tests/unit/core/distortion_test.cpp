// Lens distortion against OpenCV's own numbers, its inverse, and calibrated cameras.
#include "core/camera/distortion.h"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/camera/camera.h"

namespace {

using core::Camera;
using core::CameraSettings;
using core::Distortion;
using core::DistortionModel;
using core::Place;
using core::Vec2;
using core::Vec3;

struct Lens {
  core::DistortionSettings settings;
  std::array<Distortion::Point, 4> shown;  ///< of kDirections
};
constexpr std::array<Place, 4> kDirections = {
    {{0.3, -0.2, 1}, {-0.8, 0.45, 1.6}, {0.05, 0.9, 2}, {1.1, -0.7, 2.5}}};

/// Source: cv::projectPoints and cv::fisheye::projectPoints of OpenCV 5.0.0, to 12 digits.
const std::vector<Lens>& lenses() {
  static const std::vector<Lens> all = {
      {{DistortionModel::kOpencv, {-0.28, 0.09, 0.0011, -0.0023}},
       {{{0.2886913, -0.1925172},
         {-0.461015942574, 0.25925770427},
         {0.0232256469727, 0.426694458008},
         {0.4076321664, -0.2595011968}}}},
      {{DistortionModel::kOpencv, {-0.31, 0.14, -0.0008, 0.0017, -0.035}},
       {{{0.2892197315, -0.192769821},
         {-0.454312558967, 0.255602236538},
         {0.023892294651, 0.423683178719},
         {0.408464470221, -0.25985528105}}}},
      {{DistortionModel::kOpencv, {0.42, -0.11, 0.0009, -0.0004, 0.012, 0.71, 0.05, 0.018}},
       {{{0.288676410163, -0.192368606776},
         {-0.455016953892, 0.256169180119},
         {0.0235088891758, 0.424805317665},
         {0.406128809792, -0.258270042595}}}},
      {{DistortionModel::kOpencv,
        {0.42, -0.11, 0.0009, -0.0004, 0.012, 0.71, 0.05, 0.018, 0.003, -0.0012, -0.0021, 0.0017}},
       {{{0.289046130163, -0.192612876776},
         {-0.45415961861, 0.255662190163},
         {0.0240687524571, 0.424448896767},
         {0.406856028992, -0.258715469795}}}},
      {{DistortionModel::kFisheye, {0.031, -0.012, 0.0045, -0.0007}},
       {{{0.288949937264, -0.19263329151},
         {-0.457404414813, 0.257289983333},
         {0.0236097954188, 0.424976317538},
         {0.40823882622, -0.259788343958}}}},
  };
  return all;
}

TEST(Distortion, ShowsPointsWhereOpencvDoes) {
  for (const Lens& lens : lenses()) {
    for (std::size_t i = 0; i < kDirections.size(); ++i) {
      const auto shown = Distortion(lens.settings).project(kDirections[i]);
      ASSERT_TRUE(shown);
      EXPECT_NEAR(shown->at.x, lens.shown[i].x, 1e-11);
      EXPECT_NEAR(shown->at.y, lens.shown[i].y, 1e-11);
    }
  }
}

TEST(Distortion, InverseReturnsToTheDirection) {
  for (const Lens& lens : lenses()) {
    const Distortion distortion(lens.settings);
    for (std::size_t i = 0; i < kDirections.size(); ++i) {
      const Distortion::Unprojected seen = distortion.unproject(lens.shown[i]);
      ASSERT_TRUE(seen.is_shown);
      EXPECT_NEAR(seen.direction.x / seen.direction.z, kDirections[i].x / kDirections[i].z, 1e-9);
      EXPECT_NEAR(seen.direction.y / seen.direction.z, kDirections[i].y / kDirections[i].z, 1e-9);
    }
  }
}

// Differences of neighbours.
TEST(Distortion, ScaleIsTheRatioOfAreas) {
  constexpr double kStep = 1e-5;
  for (const Lens& lens : lenses()) {
    const Distortion distortion(lens.settings);
    for (const Place d : kDirections) {
      const Place p = {d.x / d.z, d.y / d.z, 1};
      const auto at = [&](double x, double y) {
        return distortion.project({p.x + x, p.y + y, 1})->at;
      };
      const auto [right, left] = std::array{at(kStep, 0), at(-kStep, 0)};
      const auto [below, above] = std::array{at(0, kStep), at(0, -kStep)};
      double area =
          ((right.x - left.x) * (below.y - above.y) - (right.y - left.y) * (below.x - above.x)) /
          (4 * kStep * kStep);
      if (distortion.is_fisheye()) {  // per solid angle: dx dy = dw / cos^3
        area *= std::pow(1 + p.x * p.x + p.y * p.y, 1.5);
      }
      EXPECT_NEAR(distortion.project(d)->scale, area, 1e-6);
    }
  }
}

// r (1 - r^2 / 4) grows up to r = 2 / sqrt(3), where it is 4 / sqrt(27); then the image folds back.
TEST(Distortion, ShowsNothingBeyondTheFold) {
  const Distortion barrel({DistortionModel::kOpencv, {-0.25, 0, 0, 0}});
  const double fold = 2 / std::sqrt(3.0);
  const double edge = 4 / std::sqrt(27.0);
  EXPECT_TRUE(barrel.project({0.99 * fold, 0, 1}));
  EXPECT_FALSE(barrel.project({1.01 * fold, 0, 1}));
  EXPECT_FALSE(barrel.project({0.3, 0, -1}));
  EXPECT_TRUE(barrel.unproject({0, 0.999 * edge}).is_shown);
  EXPECT_FALSE(barrel.unproject({0, 1.001 * edge}).is_shown);
}

// theta (1 - theta^2 / 12) grows up to 2 rad, where it is 4 / 3.
TEST(Distortion, FisheyeSeesBehindItselfUpToItsFold) {
  const Distortion fisheye({DistortionModel::kFisheye, {-1.0 / 12, 0, 0, 0}});
  const auto toward = [](double theta) { return Place{std::sin(theta), 0, std::cos(theta)}; };
  ASSERT_TRUE(fisheye.project(toward(1.9)));
  EXPECT_NEAR(fisheye.project(toward(1.9))->at.x, 1.9 * (1 - 1.9 * 1.9 / 12), 1e-12);
  EXPECT_FALSE(fisheye.project(toward(2.01)));
  EXPECT_FALSE(fisheye.project({0, 0, -1}));
  const Place back = fisheye.unproject({0, 1.9 * (1 - 1.9 * 1.9 / 12)}).direction;
  EXPECT_NEAR(std::atan2(back.y, back.z), 1.9, 1e-8);
  EXPECT_TRUE(fisheye.unproject({0, 1.333}).is_shown);
  EXPECT_FALSE(fisheye.unproject({0, 1.334}).is_shown);
}

CameraSettings calibrated() {
  CameraSettings s;
  s.type = core::CameraType::kPinhole;
  s.position = Vec3{0, 0, 5};
  s.target = Vec3{0, 0, 0};
  s.fx_px = 100;
  return s;
}

Camera make(const CameraSettings& settings) {
  const auto camera = Camera::create(settings, {}, {}, 200, 100);
  EXPECT_TRUE(camera);
  return *camera;
}

void expect_seen(const Camera& camera, Vec3 point, double x, double y) {
  const auto at = camera.project(point, {0.5F, 0.5F});
  ASSERT_TRUE(at);
  EXPECT_NEAR(at->x, x, 1e-4);
  EXPECT_NEAR(at->y, y, 1e-4);
  const core::Ray ray = camera.ray(*at, {0.5F, 0.5F}).ray;
  EXPECT_LT(length(cross(normalize(point - ray.origin), ray.direction)), 1e-6F);
}

TEST(CalibratedCamera, FocalLengthsAndPrincipalPointPlaceThePixels) {
  CameraSettings s = calibrated();
  expect_seen(make(s), {1, 1, 0}, 100 + 100.0 / 5, 50 - 100.0 / 5);
  s.fy_px = 150;
  s.cx_px = 70.5;
  s.cy_px = 60;
  expect_seen(make(s), {1, 1, 0}, 70.5 + 100.0 / 5, 60 - 150.0 / 5);
  EXPECT_TRUE(make(s).is_pinhole());
  const core::Intrinsics film = make(s).intrinsics();
  EXPECT_EQ(film.fx, 100);
  EXPECT_EQ(film.fy, 150);
  EXPECT_EQ(film.cx, 70.5);
  EXPECT_EQ(film.cy, 60);
}

TEST(CalibratedCamera, ShiftMovesTheViewByWidthsAndHeights) {
  CameraSettings s = calibrated();
  s.type = core::CameraType::kPerspective;
  s.fx_px.reset();
  s.vertical_fov_degrees = 90;  // 50 pixels at distance 1
  expect_seen(make(s), {1, 1, 0}, 100 + 50.0 / 5, 50 - 50.0 / 5);
  s.shift = Vec2{0.25F, 0.5F};  // to the right and up: things move to the left and down
  expect_seen(make(s), {1, 1, 0}, 100 + 50.0 / 5 - 50, 50 - 50.0 / 5 + 50);
}

// A camera at (1, 2, 3) that looks along +x with z up, in the axes of all conventions.
TEST(CalibratedCamera, PosesMeanTheSameInEveryConvention) {
  CameraSettings s = calibrated();
  s.position.reset();
  s.target.reset();
  const auto with = [&s](core::PoseConvention convention, std::array<double, 16> matrix) {
    s.pose = {convention, matrix};
    return make(s);
  };
  for (const Camera& camera :
       {with(core::PoseConvention::kOpencv, {0, 0, 1, 1, -1, 0, 0, 2, 0, -1, 0, 3, 0, 0, 0, 1}),
        with(core::PoseConvention::kOpengl, {0, 0, -1, 1, -1, 0, 0, 2, 0, 1, 0, 3, 0, 0, 0, 1}),
        with(core::PoseConvention::kRos, {1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3, 0, 0, 0, 1})}) {
    expect_seen(camera, {5, 3, 4}, 100 - 100.0 / 4, 50 - 100.0 / 4);
  }
}

// Filters reach beyond the film, and there the lens shows nothing: the last direction is repeated.
TEST(CalibratedCamera, EveryRayHasImportance) {
  CameraSettings s = calibrated();
  s.fx_px = 146;  // the corner is at 112 / 146 = .766 focal lengths, the fold at .770
  s.distortion = {DistortionModel::kOpencv, {-0.25, 0, 0, 0}};
  const Camera camera = make(s);
  for (const Vec2 film : {Vec2{0, 0}, Vec2{-1.5F, -1.5F}, Vec2{201.5F, 50}, Vec2{201, 101}}) {
    const core::Ray ray = camera.ray(film, {0.5F, 0.5F}).ray;
    EXPECT_GT(camera.importance(ray.origin, ray.direction).pdf_solid_angle, 0) << film.x;
  }
}

TEST(CalibratedCamera, RefusesWhatNoCameraIs) {
  const auto where = [](const CameraSettings& s) {
    const auto camera = Camera::create(s, {}, {}, 200, 100);
    return camera ? std::string("none") : camera.error().where;
  };
  CameraSettings s = calibrated();
  EXPECT_EQ(where(s), "none");
  s.distortion = {DistortionModel::kOpencv, {0.1, 0, 0}};
  EXPECT_EQ(where(s), "/camera/distortion/k");
  // The corner is at 1.12 focal lengths; the image folds at .77.
  s.distortion = {DistortionModel::kOpencv, {-0.25, 0, 0, 0}};
  EXPECT_EQ(where(s), "/camera/distortion/k");
  s.fx_px = 200;
  EXPECT_EQ(where(s), "none");
  s.distortion = {DistortionModel::kFisheye, {0, 0, 0, 0}};
  s.aperture_radius_m = 0.1F;
  EXPECT_EQ(where(s), "/camera/aperture_radius");
  s = calibrated();
  s.fx_px.reset();
  EXPECT_EQ(where(s), "/camera/fx");
  s = calibrated();
  s.shift = Vec2{0.1F, 0};
  EXPECT_EQ(where(s), "/camera/shift");
  s = calibrated();
  s.type.reset();
  EXPECT_EQ(where(s), "/camera/fx");
  s = calibrated();
  s.pose.emplace();
  EXPECT_EQ(where(s), "/camera/position");
  s.position.reset();
  s.target.reset();
  EXPECT_EQ(where(s), "none");
  s.pose->matrix[0] = -1;  // a reflection
  EXPECT_EQ(where(s), "/camera/pose/matrix");
  s.pose->matrix[0] = 1.01;
  EXPECT_EQ(where(s), "/camera/pose/matrix");
  s.pose->matrix[0] = 1;
  s.pose->matrix[12] = 2;  // column by column
  EXPECT_EQ(where(s), "/camera/pose/matrix");
}

}  // namespace
