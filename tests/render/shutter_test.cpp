// Images with an open shutter against moving objects: the fraction of the exposure in which a pixel
// sees each.
//
// Files are written by hand; an orthographic camera looks along -z from z = 10 and sees 2 m in
// height.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/render/task/settle.h"
#include "core/scene/scene_data.h"
#include "tests/render/gltf_stage.h"

namespace {

constexpr int kF32 = 5126;
constexpr int kSize = 16;  ///< pixels per side; 8 per metre
/// the standard deviation of a fraction p is at most 1/2 / sqrt(1024)
constexpr int kSamples = 1024;
/// Six times that: the chance that any of 256 pixels of a run is as far off is at most 1e-6.
constexpr double kOff = 6 * 0.5 / 32;

class File {
 public:
  core::GlbWriter writer;

  File() {
    writer.use_extension("KHR_materials_unlit");
    writer.add("materials", R"({"extensions":{"KHR_materials_unlit":{}},"doubleSided":true})");
    writer.add("cameras",
               R"({"type":"orthographic","orthographic":{"xmag":1,"ymag":1,"znear":0,"zfar":99}})");
  }

  int floats(const std::vector<float>& values, const char* shape, std::size_t width) {
    return writer.add_accessor(std::as_bytes(std::span(values)), kF32, shape, values.size() / width,
                               "{}");
  }
  /// A rectangle at height z; returns its mesh.
  int rectangle(float left, float right, float low, float high, float z, int material,
                const std::string& attributes = "", const std::string& more = "") {
    const int positions = floats(
        {left, low, z, right, low, z, left, high, z, left, high, z, right, low, z, right, high, z},
        "VEC3", 3);
    return writer.add("meshes", R"({"primitives":[{"material":)" + std::to_string(material) +
                                    R"(,"attributes":{"POSITION":)" + std::to_string(positions) +
                                    attributes + "}" + more + "}]}");
  }
  int node(const std::string& json) { return writer.add("nodes", json); }
  int shown(int mesh) { return node(R"({"mesh":)" + std::to_string(mesh) + "}"); }
  void camera() { node(R"({"camera":0,"translation":[0,0,10]})"); }
  /// Adds keys, one per second.
  void animate(int node, const std::string& path, const std::vector<float>& values,
               const char* shape, std::size_t width, const std::string& interpolation = "LINEAR") {
    std::vector<float> times;
    for (std::size_t i = 0; i < values.size() / width; ++i) {
      times.push_back(static_cast<float>(i));
    }
    const int input = floats(times, "SCALAR", 1);
    const int output = floats(values, shape, width);
    writer.add("animations", R"({"samplers":[{"input":)" + std::to_string(input) + R"(,"output":)" +
                                 std::to_string(output) + R"(,"interpolation":")" + interpolation +
                                 R"("}],"channels":[{"sampler":0,"target":{"node":)" +
                                 std::to_string(node) + R"(,"path":")" + path + R"("}}]})");
  }
  core::SceneDescription open(double seconds, double shutter_seconds) {
    if (file_.empty()) {
      file_ = writer.finish();
    }
    core::GltfOptions options;
    options.time_seconds = seconds;
    options.shutter_seconds = shutter_seconds;
    return test_support::load(file_, options);
  }

 private:
  core::Bytes file_;
};

core::View view_of(core::SceneDescription scene, double shutter_seconds,
                   const std::string& integrator = "path") {
  core::View view = test_support::view_of(std::move(scene), kSize, kSize);
  view.settings.integrator = integrator;
  view.settings.max_depth = 1;
  view.settings.shutter_seconds = shutter_seconds;
  return view;
}

double red(const test_support::Picture& picture, int x, int y) {
  return static_cast<double>(test_support::pixel(picture, x, y).r);
}

/// Number of pixels that are further off than chance allows.
int wrong(const test_support::Picture& picture, const std::function<double(int, int)>& truth) {
  int out = 0;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      out += std::fabs(red(picture, x, y) - truth(x, y)) > kOff ? 1 : 0;
    }
  }
  return out;
}

/// Fraction of [low, high] within [a, b].
double within(double a, double b, double low, double high) {
  return std::max(std::min(b, high) - std::max(a, low), 0.0) / (high - low);
}

/// Mean over a pixel and the exposure of a square of side 0.5 whose left edge moves from x0 to x1,
/// at y of [0, 0.5].
double crossing(int x, int y, double x0, double x1) {
  constexpr int kParts = 64;
  const double left = -1 + x / 8.0;
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    const double at = x0 + (x1 - x0) * (i + 0.5) / kParts;
    sum += within(at, at + 0.5, left, left + 0.125) / kParts;
  }
  return sum * within(0, 0.5, 1 - (y + 1) / 8.0, 1 - y / 8.0);
}

void add_crossing_square(File& file) {
  const int square = file.shown(file.rectangle(0, 0.5F, 0, 0.5F, 0, 0));
  file.animate(square, "translation", {-1, 0, 0, 1, 0, 0}, "VEC3", 3);
  file.camera();
}

TEST(Shutter, AMovingNodeCoversPixelsForItsFractionOfTheExposure) {
  // From x = -0.5 at 0.25 s to 0 at 0.5 s.
  File file;
  add_crossing_square(file);
  const auto truth = [](int x, int y) { return crossing(x, y, -0.5, 0); };
  for (const char* integrator : {"path", "direct"}) {
    const auto picture =
        test_support::render(view_of(file.open(0.25, 0.25), 0.25, integrator), kSamples);
    EXPECT_EQ(wrong(picture, truth), 0) << integrator;
    // Planted faults: a shutter that is open twice as long, and a closed one.
    EXPECT_GT(wrong(picture, [](int x, int y) { return crossing(x, y, -0.5, 0.5); }), 20);
    EXPECT_GT(wrong(picture, [](int x, int y) { return crossing(x, y, -0.5, -0.499); }), 20);
  }
}

TEST(Shutter, ShadowRaysUseTheTimeOfThePath) {
  // A blind of 2 x 1 m at z = 1 rises by 4 m, through light that falls straight down on a floor at
  // z = 0, which the camera sees from below the blind's path: with the light at 45 degrees.
  File file;
  file.writer.use_extension("KHR_lights_punctual");
  file.writer.set("extensions", R"({"KHR_lights_punctual":{"lights":[)"
                                R"({"type":"directional","intensity":3.14159265}]}})");
  file.writer.add("materials", R"({"pbrMetallicRoughness":{"metallicFactor":0},)"
                               R"("extensions":{"KHR_materials_specular":{"specularFactor":0}}})");
  file.writer.use_extension("KHR_materials_specular");
  file.shown(file.rectangle(-4, 4, -4, 4, 0, 1));
  // Light travels along (-1, 0, -1): the point (x, y, 0) is in the shadow of (x + 5, y, 5).
  file.node(R"({"rotation":[0,0.38268343,0,0.92387953],)"
            R"("extensions":{"KHR_lights_punctual":{"light":0}}})");
  const int blind = file.shown(file.rectangle(4, 4.5F, -4, 4, 5, 1));
  file.animate(blind, "translation", {0, 0, 0, 2, 0, 0}, "VEC3", 3);
  file.camera();
  // The left edge of the shadow moves from -1 to 1; shutter open: all the time.
  const auto truth = [](int x, int /*y*/) {
    double dark = 0;
    for (int i = 0; i < 64; ++i) {
      const double at = -1 + 2 * (i + 0.5) / 64;
      dark += within(at, at + 0.5, -1 + x / 8.0, -1 + (x + 1) / 8.0) / 64;
    }
    return (1 - dark) * std::sqrt(0.5);
  };
  const auto dark_once = [](int x, int /*y*/) {  // the planted fault: shadow rays at time 0
    return (1 - within(-1, -0.5, -1 + x / 8.0, -1 + (x + 1) / 8.0)) * std::sqrt(0.5);
  };
  for (const char* integrator : {"path", "direct"}) {
    const auto picture = test_support::render(view_of(file.open(0, 1), 1, integrator), kSamples);
    EXPECT_EQ(wrong(picture, truth), 0) << integrator;
    EXPECT_GT(wrong(picture, dark_once), 30) << integrator;
  }
}

TEST(Shutter, AMovingEmitterLightsTheSurfacesAlongItsPath) {
  // An emitter moves horizontally over the floor: its light is the mean of that of emitters at rest
  // along the path, which light samples find.
  const auto lit = [](double at, double shutter_seconds) {
    File file;
    file.writer.add("materials", R"({"emissiveFactor":[1,1,1],"doubleSided":true})");
    file.writer.add("materials",
                    R"({"pbrMetallicRoughness":{"metallicFactor":0},)"
                    R"("extensions":{"KHR_materials_specular":{"specularFactor":0}}})");
    file.writer.use_extension("KHR_materials_specular");
    file.shown(file.rectangle(-4, 4, -4, 4, 0, 2));
    const int lamp = file.shown(file.rectangle(-1, 1, -1, 1, 0, 1));
    file.animate(lamp, "translation", {-12, 0, 11, 0, 0, 11}, "VEC3", 3);  // behind the camera
    file.camera();
    core::View view = view_of(file.open(at, shutter_seconds), shutter_seconds);
    view.settings.estimator.splitting = core::SplittingType::kNone;
    return test_support::render(view, shutter_seconds > 0 ? 4 * kSamples : 64);
  };
  double truth = 0;
  for (int i = 0; i < 16; ++i) {
    truth += static_cast<double>(lit((i + 0.5) / 16, 0).mean().r) / 16;
  }
  const auto picture = lit(0, 1);
  const auto spread = static_cast<double>(picture.standard_error().r);
  EXPECT_LT(spread, 0.02 * truth);
  EXPECT_NEAR(static_cast<double>(picture.mean().r), truth, 5 * spread + 0.005 * truth);
  // The planted fault, an emitter that does not move, is detected.
  EXPECT_GT(std::fabs(static_cast<double>(lit(0, 0).mean().r) - truth), 0.15 * truth);
}

TEST(Shutter, MorphsSkinsAndRotationsMove) {
  struct Case {
    const char* name;
    std::function<void(File&)> add;
  };
  const auto one_joint = [](File& file) {
    const std::vector<std::uint8_t> joints(24, 0);
    const std::string j = std::to_string(
        file.writer.add_accessor(std::as_bytes(std::span(joints)), 5121, "VEC4", 6, "{}"));
    std::vector<float> weights;
    for (int i = 0; i < 6; ++i) {
      weights.insert(weights.end(), {1, 0, 0, 0});
    }
    const std::string w = std::to_string(file.floats(weights, "VEC4", 4));
    const int mesh =
        file.rectangle(-1, -0.5F, 0, 0.5F, 0, 0, ",\"JOINTS_0\":" + j + ",\"WEIGHTS_0\":" + w);
    const int joint = file.node("{}");
    file.writer.add("skins", R"({"joints":[)" + std::to_string(joint) + "]}");
    file.node(R"({"skin":0,"mesh":)" + std::to_string(mesh) + "}");
    file.animate(joint, "translation", {0, 0, 0, 2, 0, 0}, "VEC3", 3);
  };
  const auto morph = [](File& file) {
    std::vector<float> aside;
    for (int i = 0; i < 6; ++i) {
      aside.insert(aside.end(), {1, 0, 0});
    }
    const int target = file.floats(aside, "VEC3", 3);
    const int node =
        file.shown(file.rectangle(-1, -0.5F, 0, 0.5F, 0, 0, "",
                                  R"(,"targets":[{"POSITION":)" + std::to_string(target) + "}]"));
    file.animate(node, "weights", {0, 2}, "SCALAR", 1);
  };
  for (const Case& c : {Case{"skin", one_joint}, Case{"morph", morph}}) {
    File file;
    c.add(file);
    file.camera();
    const auto picture = test_support::render(view_of(file.open(0.25, 0.25), 0.25), kSamples);
    EXPECT_EQ(wrong(picture, [](int x, int y) { return crossing(x, y, -0.5, 0); }), 0) << c.name;
  }
}

TEST(Shutter, CameraMotionIsTheInverseOfObjectMotion) {
  File file;
  file.shown(file.rectangle(-0.5F, 0, 0, 0.5F, 0, 0));
  const int camera = file.node(R"({"camera":0})");
  file.animate(camera, "translation", {0, 0, 10, -2, 0, 10}, "VEC3", 3);
  const auto picture = test_support::render(view_of(file.open(0, 0.25), 0.25), kSamples);
  EXPECT_EQ(wrong(picture, [](int x, int y) { return crossing(x, y, -0.5, 0); }), 0);
}

TEST(Shutter, RotationsUseSeveralStepsAndOneOfManyInstancesMovesAlone) {
  File file;
  const int mesh = file.rectangle(0, 1, -0.05F, 0.05F, 0, 0);
  const int turning = file.shown(mesh);
  file.shown(mesh);
  file.animate(turning, "rotation", {0, 0, 0, 1, 0, 0, 0.70710678F, 0.70710678F}, "VEC4", 4);
  file.camera();
  const auto scene = test_support::build(file.open(0, 1));
  const core::SceneData& data = scene->data();
  std::vector<std::size_t> steps;
  for (const core::MeshData& each : data.meshes) {
    steps.push_back(each.later.size());
  }
  std::sort(steps.begin(), steps.end());
  // Between 9 time steps of a right angle the error of a point's radius is 1 - cos(pi / 32) = 0.5
  // %.
  EXPECT_EQ(steps, (std::vector<std::size_t>{0, 8}));
  // Uniform motion along a line for one second needs only its two ends.
  File straight;
  add_crossing_square(straight);
  EXPECT_EQ(test_support::build(straight.open(0, 1))->data().meshes.at(0).later.size(), 1U);
}

TEST(Shutter, StepKeysHoldAtTheOpeningAndAWarningSaysSo) {
  File file;
  const int square = file.shown(file.rectangle(0, 0.5F, 0, 0.5F, 0, 0));
  file.animate(square, "translation", {-1, 0, 0, 0.5F, 0, 0}, "VEC3", 3, "STEP");
  const int camera = file.node(R"({"camera":0})");
  file.animate(camera, "translation", {0, 0, 10, 3, 0, 10}, "VEC3", 3, "STEP");
  core::SceneDescription scene = file.open(0.7, 0.5);
  ASSERT_EQ(scene.warnings.size(), 1U);
  EXPECT_EQ(scene.warnings[0].code, "shutter");
  EXPECT_TRUE(scene.cameras.at(0).later.empty());
  const auto picture = test_support::render(view_of(std::move(scene), 0.5), 64);
  EXPECT_EQ(wrong(picture, [](int x, int y) { return crossing(x, y, -1, -1); }), 0);
  EXPECT_TRUE(file.open(0.25, 0.5).warnings.empty()) << "no key while it is open";
  EXPECT_TRUE(file.open(1, 0.5).warnings.empty()) << "the last key, at the opening";
}

TEST(Shutter, ClosedEqualsNoShutterAndOpenIsDeterministic) {
  File file;
  add_crossing_square(file);
  const auto shut = test_support::render(view_of(file.open(0.25, 0), 0), 16);
  const auto opened = test_support::render(view_of(file.open(0.25, 0.25), 0), 16);
  EXPECT_EQ(shut.film->digest(), opened.film->digest());
  const auto once = test_support::render(view_of(file.open(0.25, 0.25), 0.25), 16, 1);
  const auto again = test_support::render(view_of(file.open(0.25, 0.25), 0.25), 16, 2);
  EXPECT_EQ(once.film->digest(), again.film->digest());
  EXPECT_NE(once.film->digest(), shut.film->digest());
}

TEST(Shutter, RefusesUnsupportedMotion) {
  File file;
  file.writer.use_extension("KHR_lights_punctual");
  file.writer.set("extensions",
                  R"({"KHR_lights_punctual":{"lights":[{"type":"point","name":"bulb"}]}})");
  file.shown(file.rectangle(0, 1, 0, 1, 0, 0));
  const int bulb = file.node(R"({"extensions":{"KHR_lights_punctual":{"light":0}}})");
  file.animate(bulb, "translation", {0, 0, 0, 1, 0, 0}, "VEC3", 3);
  const core::Bytes glb = file.writer.finish();
  core::GltfOptions options;
  options.shutter_seconds = 1;
  const auto moving_light = core::load_gltf(glb, nullptr, options);
  ASSERT_FALSE(moving_light);
  EXPECT_EQ(moving_light.error().where, "/shutter_seconds");
  EXPECT_NE(moving_light.error().message.find("moves while the shutter is open"),
            std::string::npos);
  options.time_seconds.reset();
  const auto resting = core::load_gltf(glb, nullptr, options);
  ASSERT_FALSE(resting);
  EXPECT_EQ(resting.error().where, "/shutter_seconds");
  File square;
  add_crossing_square(square);
  const auto bdpt = core::settled_renderer(view_of(square.open(0, 1), 1, "bdpt"));
  ASSERT_FALSE(bdpt);
  EXPECT_EQ(bdpt.error().where, "/shutter_seconds");
  core::View shared = view_of(square.open(0, 1), 1);
  shared.settings.light_sampler = core::LightSamplerType::kRestir;
  EXPECT_FALSE(core::settled_renderer(shared));
}

TEST(Shutter, RefusesMeshesThatAppearOrVanish) {
  for (const bool appears : {false, true}) {
    File file;
    const int node = file.shown(file.rectangle(0, 1, 0, 1, 0, 0));
    const float before = appears ? 0 : 1;
    const float after = 1 - before;
    file.animate(node, "scale", {before, before, before, after, after, after}, "VEC3", 3);
    core::GltfOptions options;
    options.time_seconds = 0;
    options.shutter_seconds = 1;
    const auto scene = core::load_gltf(file.writer.finish(), nullptr, options);
    ASSERT_FALSE(scene) << appears;
    EXPECT_EQ(scene.error().where, "/shutter_seconds");
    EXPECT_NE(scene.error().message.find("appears or disappears"), std::string::npos);
  }
}

}  // namespace
