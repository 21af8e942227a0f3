// Pictures have no scale: scenes of any size, mirrored, and under any strength of light give the
// same picture. Where a change multiplies all lengths or lights by a power of two, all numbers of a
// path are multiplied by powers of two, which rounds nothing: pictures must be equal to the bit, up
// to the order in which splats and photons are added.
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/integrators/registry.h"
#include "tests/render/gltf_stage.h"
#include "tests/support/scenes.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Picture;

constexpr int kSide = 12;

struct Change {
  float size = 1;   ///< of all lengths
  float light = 1;  ///< of all radiances
  /// Planted fault.
  bool forgets_point_light = false;
};

/// A corner of a room under an area light and a point light, with a block, a glossy ball of few
/// facets and a thin plate that floats above the floor.
core::View room(std::string_view integrator, const Change& change) {
  const float s = change.size;
  const auto quad = [s](Vec3 corner, Vec3 edge1, Vec3 edge2, int material) {
    return test_support::quad(corner * s, edge1 * s, edge2 * s, material);
  };
  core::MaterialDescription glossy = test_support::lambert({0.6F, 0.5F, 0.3F});
  glossy.specular = 1;
  glossy.roughness = 0.4F;
  core::SceneDescription scene = test_support::scene_of(
      {test_support::lambert({0.7F, 0.6F, 0.5F}), glossy,
       test_support::emitter(Rgb(10 * change.light))},
      {quad({-1, 0, 2}, {3, 0, 0}, {0, 0, -3}, 0), quad({-1, 0, -1}, {3, 0, 0}, {0, 2, 0}, 0),
       quad({0, 0, 0.4F}, {0.4F, 0, 0}, {0, 0.3F, 0}, 0),
       quad({0, 0.3F, 0.4F}, {0.4F, 0, 0}, {0, 0, -0.4F}, 0),
       quad({0.5F, 0.01F, 1}, {0.4F, 0, 0}, {0, 0, -0.4F}, 1),
       quad({-0.5F, 1.8F, -0.5F}, {0.4F, 0, 0}, {0, 0, 0.4F}, 2),
       test_support::sphere(Vec3{-0.4F, 0.3F, 0.6F} * s, 0.3F * s, 8, false, 1)});
  core::PunctualLightDescription lamp;
  lamp.type = core::PunctualType::kPoint;
  lamp.intensity = Rgb(0.5F * change.light * (change.forgets_point_light ? 1 : s * s));
  lamp.to_world.t = Vec3{1, 1.2F, 1} * s;
  scene.lights.push_back(lamp);
  core::View view = test_support::view_of(std::move(scene), kSide, kSide);
  test_support::look_at(view, Vec3{0.4F, 1, 3} * s, Vec3{0.1F, 0.3F, 0} * s, 36);
  view.environment = test_support::constant_sky(Rgb(0.25F * change.light));
  const core::FilmSettings film = view.settings.film;
  view.settings = core::default_settings(integrator);
  view.settings.film = film;
  view.settings.max_depth = integrator == "direct" ? 1 : 4;
  view.settings.photons.paths = 2000;
  view.settings.cache.rays = 64;
  return view;
}

std::vector<double> values(const Picture& picture) {
  std::vector<double> out;
  for (std::size_t p = 0; p < picture.snapshot.pixel_count(); ++p) {
    const Rgb c = core::pixel_value(picture.snapshot, p).mean;
    out.insert(out.end(),
               {static_cast<double>(c.r), static_cast<double>(c.g), static_cast<double>(c.b)});
  }
  return out;
}

/// Largest difference of a value, relative to the mean of `a`; 1 if `a` is black.
double difference(const std::vector<double>& a, const std::vector<double>& b, double factor) {
  double most = 0;
  double mean = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    mean += a[i] / static_cast<double>(a.size());
    most = std::max(most, std::fabs(a[i] - b[i] * factor));
  }
  return mean > 0 ? most / mean : 1;
}

class Invariance : public testing::TestWithParam<std::string> {
 protected:
  std::vector<double> picture(const Change& change) const {
    return values(test_support::render(room(GetParam(), change), 4));
  }
};

/// Of a value: splats are sums of integers in steps of a power of two, photons of floats.
constexpr double kRounding = 1e-3;

TEST_P(Invariance, SizeDoesNotMatter) {
  const std::vector<double> plain = picture({});
  for (const int exponent : {-20, -10, 10, 20}) {  // 1e-6 to 1e6
    EXPECT_LT(difference(plain, picture({.size = std::ldexp(1.0F, exponent)}), 1), kRounding)
        << "2^" << exponent;
  }
}

TEST_P(Invariance, StrengthOfLightIsAFactor) {
  const std::vector<double> plain = picture({});
  for (const int exponent : {-20, 20}) {
    EXPECT_LT(difference(plain, picture({.light = std::ldexp(1.0F, exponent)}),
                         std::ldexp(1.0, -exponent)),
              kRounding)
        << "2^" << exponent;
  }
}

// The planted fault: a lamp whose intensity does not follow the square of its distances.
TEST_P(Invariance, ALampOfAbsoluteStrengthIsSeen) {
  EXPECT_GT(difference(picture({}), picture({.size = 1024, .forgets_point_light = true}), 1),
            10 * kRounding);
}

std::vector<std::string> rows() {
  std::vector<std::string> names;
  for (const core::IntegratorEntry& row : core::integrators()) {
    names.emplace_back(row.name);
  }
  return names;
}
std::string name_of(const testing::TestParamInfo<std::string>& row) {
  std::string name = row.param;
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}
INSTANTIATE_TEST_SUITE_P(AllRows, Invariance, testing::ValuesIn(rows()), name_of);

/// The room in a file, at a place of the file's world.
core::SceneDescription at_place(core::Place place) {
  core::SceneDescription scene = test_support::cornell();
  core::CameraDescription camera;
  camera.vertical_fov_rad = 0.7F;
  camera.to_world.t = {0.5F, 0.5F, 2.2F};
  scene.cameras.push_back(camera);
  core::PunctualLightDescription lamp;
  lamp.name = "lamp";
  lamp.to_world.t = {0.5F, 0.8F, 0.8F};
  scene.lights.push_back(lamp);
  scene.origin = place;  // written as translations of the nodes
  return test_support::load(core::write_glb(scene));
}

class FarPlaces : public testing::TestWithParam<std::string> {
 protected:
  static double mean(const core::SceneDescription& scene) {
    core::View view = test_support::view_of(scene, kSide, kSide);
    const core::FilmSettings film = view.settings.film;
    view.settings = core::default_settings(GetParam());
    view.settings.film = film;
    view.settings.max_depth = GetParam() == "direct" ? 1 : 3;
    view.settings.photons.paths = 2000;
    view.settings.cache.rays = 64;
    return static_cast<double>(test_support::render(view, 16).mean().g);
  }
};

TEST_P(FarPlaces, PlaceDoesNotMatter) {
  const double plain = mean(at_place({}));
  // Coordinates of a map, and a shift by 100,000 km.
  for (const core::Place place : {core::Place{1000, 0, 0}, core::Place{448262.25, 120, 5411932.5},
                                  core::Place{1e8, 0, -1e8}}) {
    core::SceneDescription scene = at_place(place);
    EXPECT_TRUE(scene.warnings.empty());
    const core::Place corner = scene.origin + scene.instances.at(0).to_world.t;
    EXPECT_EQ(corner, place);  // in the file's coordinates
    EXPECT_NEAR(mean(scene), plain, 0.005 * plain) << place.x;
    // The planted fault: a lamp in 32-bit floats, whose steps at map coordinates are half a metre.
    scene.lights[0].to_world.t.z += 0.25F;
    if (GetParam() != "ao") {  // knows no lights
      EXPECT_GT(std::fabs(mean(scene) - plain), 0.01 * plain) << place.x;
    }
  }
}
std::vector<std::string> rows_without_chains() {
  std::vector<std::string> names = rows();
  std::erase(names, "mlt");  // one rounding error changes all of a chain after it
  return names;
}
INSTANTIATE_TEST_SUITE_P(AllRows, FarPlaces, testing::ValuesIn(rows_without_chains()), name_of);

TEST(FarFiles, FloatsOfTheFileThatLostTheShapeAreReported) {
  // The planted fault: vertices themselves in map coordinates, in steps of half a metre.
  core::SceneDescription scene = test_support::cornell();
  for (core::PrimitiveDescription& p : scene.meshes[0].primitives) {
    for (Vec3& v : p.positions) {
      v = v + Vec3{448262, 120, 5411932};
    }
  }
  const core::SceneDescription read = test_support::load(core::write_glb(scene));
  ASSERT_EQ(read.warnings.size(), 1U);
  EXPECT_NE(read.warnings[0].detail.find("in steps of 0."), std::string::npos)
      << read.warnings[0].detail;
}

TEST(FarFiles, SizesBeyondFloatsAreReported) {
  for (const float size : {1e-9F, 1e10F}) {
    core::SceneDescription scene = test_support::cornell();
    scene.instances[0].to_world = core::scaling({size, size, size});
    const core::SceneDescription read = test_support::load(core::write_glb(scene));
    ASSERT_EQ(read.warnings.size(), 1U) << size;
    EXPECT_NE(read.warnings[0].detail.find("radius"), std::string::npos);
  }
}

/// A room of five walls with a lamp under the ceiling, 12 triangles, a corner at the origin; seen
/// through the open side.
double room_radiance(float side) {
  const auto quad = [side](Vec3 corner, Vec3 edge1, Vec3 edge2, int material) {
    return test_support::quad(corner * side, edge1 * side, edge2 * side, material);
  };
  core::View view = test_support::view_of(
      test_support::scene_of(
          {test_support::lambert({0.7F, 0.7F, 0.7F}), test_support::emitter({12, 12, 12})},
          {quad({0, 0, 1}, {1, 0, 0}, {0, 0, -1}, 0), quad({0, 1, 0}, {1, 0, 0}, {0, 0, 1}, 0),
           quad({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 0), quad({0, 0, 1}, {0, 0, -1}, {0, 1, 0}, 0),
           quad({1, 0, 0}, {0, 0, 1}, {0, 1, 0}, 0),
           quad({0.35F, 0.99F, 0.35F}, {0.3F, 0, 0}, {0, 0, 0.3F}, 1)}),
      8, 8);
  test_support::look_at(view, Vec3{0.5F, 0.5F, 2.4F} * side, Vec3{0.5F, 0.5F, 0} * side, 38);
  view.settings.max_depth = 4;
  return static_cast<double>(test_support::render(view, 16).mean().g);
}

TEST(RoomSizes, ARoomOfAnySizeIsLitAlike) {
  // Sizes that are no powers of two round differently: a few paths of 1024 change.
  constexpr double kFewPaths = 0.01;
  const double plain = room_radiance(1);
  ASSERT_GT(plain, 0.1);
  for (int i = 1; i <= 60; ++i) {
    const auto side = static_cast<float>(std::pow(20000.0, i / 60.0));
    EXPECT_NEAR(room_radiance(side), plain, kFewPaths * plain) << side;
  }
  for (const float side : {1e-6F, 1e-4F, 555.0F, 1907.0F, 10000.0F, 1e6F}) {
    EXPECT_NEAR(room_radiance(side), plain, kFewPaths * plain) << side;
  }
}

}  // namespace
