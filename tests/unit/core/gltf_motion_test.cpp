// Motion vectors of nodes, instances, skins, morphs and cameras, against formulas.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>

#include "core/aovs/first_hit.h"
#include "core/scene/drawn.h"
#include "core/scene/scene.h"
#include "core/scene/scene_data.h"
#include "tests/support/statistics.h"
#include "tests/unit/core/gltf_test_support.h"

namespace {

using namespace gltf_test;
using core::Vec2;
using core::Vec3;

constexpr int kWidth = 120;
constexpr int kHeight = 80;
constexpr double kFocalPx = kHeight;  ///< 2 atan(1/2) as field of view
constexpr double kNow = 0.25;
constexpr double kLater = 0.75;
constexpr float kBetween = 0.5F;  ///< fraction of the interval between the keys at 0 and 1 s

class File {
 public:
  core::GlbWriter writer;

  int positions(const std::vector<float>& values) {
    return accessor(writer, values, kF32, "VEC3", 3);
  }
  /// Animates from the first half of the values at 0 s to the second at 1 s.
  void animate(int node, const char* path, const std::vector<float>& values, const char* shape,
               std::size_t width) {
    const int times = accessor(writer, std::vector<float>{0, 1}, kF32, "SCALAR", 1);
    const int output = accessor(writer, values, kF32, shape, width);
    writer.add("animations",
               "{\"samplers\":[{\"input\":" + number(times) + ",\"output\":" + number(output) +
                   "}],\"channels\":[{\"sampler\":0,\"target\":" + "{\"node\":" + number(node) +
                   ",\"path\":\"" + path + "\"}}]}");
  }
  core::SceneDescription at(double seconds, bool geometry_only = false) {
    if (file_.empty()) {
      file_ = writer.finish();
    }
    core::GltfOptions options;
    options.time_seconds = seconds;
    options.geometry_only = geometry_only;
    auto scene = load(file_, options);
    EXPECT_TRUE(scene) << scene.error().where << ": " << scene.error().message;
    return *std::move(scene);
  }

 private:
  core::Bytes file_;
};

/// Later position of a point, for each object.
using Moves = std::map<std::uint32_t, std::function<Vec3(Vec3)>>;

/// A triangle with corners (0,0), (2,0), (0,2), and the xy position of its node.
std::string triangle_at(File& file, const std::string& more = "") {
  const int positions = file.positions({0, 0, 0, 2, 0, 0, 0, 2, 0});
  return "\"attributes\":{\"POSITION\":" + number(positions) + more + "}";
}

/// Node 0: the camera. 1: moves. 2: three instances that rotate about the z axis together. 3: a
/// skin of the joints 4 and 5. 6: a morph. 7: moves, with vertices split by tangents. 8: at rest,
/// behind all others.
void add_moving_nodes(File& file) {
  core::GlbWriter& writer = file.writer;
  writer.add("cameras",
             R"({"type":"perspective","perspective":{"yfov":0.9272952180016122,"znear":0.1}})");
  writer.add("nodes", R"({"camera":0,"translation":[0,0,10]})");
  add_primitive(writer, triangle_at(file), R"("translation":[-7,1,0])");
  file.animate(1, "translation", {-7, 1, 0, -6, 2, 1}, "VEC3", 3);
  const int places = file.positions({-1, -0.5F, 0, 1.5F, -0.5F, 0, -1, 1.5F, -1});
  add_primitive(writer, triangle_at(file),
                R"("extensions":{"EXT_mesh_gpu_instancing":{"attributes":{"TRANSLATION":)" +
                    number(places) + "}}}");
  const float s = std::sin(0.1F);
  const float c = std::cos(0.1F);
  file.animate(2, "rotation", {0, 0, -s, c, 0, 0, s, c}, "VEC4", 4);
  const int joints = accessor(writer, std::vector<std::uint8_t>{0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0},
                              kU8, "VEC4", 4);
  const int weights = accessor(writer, std::vector<float>{1, 0, 0, 0, 1, 0, 0, 0, 0.5F, 0.5F, 0, 0},
                               kF32, "VEC4", 4);
  add_primitive(
      writer,
      triangle_at(file, ",\"JOINTS_0\":" + number(joints) + ",\"WEIGHTS_0\":" + number(weights)),
      R"("skin":0)");
  writer.add("nodes", R"({"translation":[4,-3,0]})");
  writer.add("nodes", R"({"translation":[4,-3,0]})");
  writer.add("skins", R"({"joints":[4,5]})");
  file.animate(5, "translation", {4, -3, 0, 4, -2, 0.5F}, "VEC3", 3);
  const int lift = file.positions({0, 0, 0, 1, 0, 0, 0, 0, 0});
  add_primitive(writer, triangle_at(file) + ",\"targets\":[{\"POSITION\":" + number(lift) + "}]",
                R"("translation":[-7,-4,0])");
  file.animate(6, "weights", {0, 1}, "SCALAR", 1);
  // Two triangles that share an edge, with texture coordinates of opposite handedness.
  writer.add("materials",
             R"({"extensions":{"KHR_materials_anisotropy":{"anisotropyStrength":1}}})");
  const int square = file.positions({0, 0, 0, 2, 0, 0, 0, 2, 0, 2, 2, 0});
  const int uv = accessor(writer, std::vector<float>{0, 0, 1, 0, 0, 1, 0, 0}, kF32, "VEC2", 2);
  const int order =
      accessor(writer, std::vector<std::uint16_t>{0, 1, 2, 2, 1, 3}, kU16, "SCALAR", 1);
  add_primitive(writer,
                "\"material\":0,\"indices\":" + number(order) + ",\"attributes\":{\"POSITION\":" +
                    number(square) + ",\"TEXCOORD_0\":" + number(uv) + "}",
                R"("translation":[3,2,0])");
  file.animate(7, "translation", {3, 2, 0, 4, 2, 0}, "VEC3", 3);
  add_primitive(writer, triangle_at(file), R"("translation":[-8,-5,-3],"scale":[8,8,1])");
}

/// The object of node n is n + 1.
Moves moves() {
  const float angle = 0.2F * kBetween * 2;
  const auto skinned = [](Vec3 p) {
    // In the rest pose: weight of the second joint, x / 2 + y / 4.
    const Vec3 by = Vec3{0, 1, 0.5F};
    const auto weight = [](float x, float y) { return x / 2 + y / 4; };
    // At the first time it has moved by a quarter: y = y0 + w / 4, z = w / 8, with w of (x, y0).
    const float x = p.x - 4;
    const float y = (p.y + 3 - x / 8) / (1 + 1.0F / 16);
    return p + by * (kBetween * weight(x, y));
  };
  const auto morphed = [](Vec3 p) {
    const float x = (p.x + 7) / (1 + 0.125F);  // of the base: the target moves x by w x / 2
    return p + Vec3{0.5F * kBetween * x, 0, 0};
  };
  return {{2,
           [](Vec3 p) {
             return p + Vec3{1, 1, 1} * kBetween;
           }},
          {3,
           [angle](Vec3 p) {
             return Vec3{p.x * std::cos(angle) - p.y * std::sin(angle),
                         p.x * std::sin(angle) + p.y * std::cos(angle), p.z};
           }},
          {4, skinned},
          {7, morphed},
          {8,
           [](Vec3 p) {
             return p + Vec3{kBetween, 0, 0};
           }},
          {9, [](Vec3 p) { return p; }}};
}

struct Stage {
  std::shared_ptr<const core::Scene> scene;
  core::Motion motion;
};

Stage stage_of(File& file, const core::CameraSettings& settings = {}) {
  auto scene = core::Scene::build(file.at(kNow), 1);
  EXPECT_TRUE(scene);
  auto target = std::make_shared<const core::MotionTarget>(file.at(kLater, true));
  const core::SceneSummary& summary = (*scene)->summary();
  const auto camera = [&](const std::vector<core::CameraDescription>& cameras) {
    auto made = core::Camera::create(settings, cameras, summary.bounds, kWidth, kHeight);
    EXPECT_TRUE(made);
    return *made;
  };
  return {*scene, {target, camera(summary.cameras), camera(target->cameras()), kWidth}};
}

core::FirstHitPixel first_hit_at(const Stage& stage, Vec2 film_px) {
  std::uint64_t rays = 0;
  return core::first_hit_pixel(stage.scene->data(), stage.motion.now.ray(film_px, {0.5F, 0.5F}).ray,
                               &stage.motion, rays);
}

/// Pixels to the right and up from the centre, seen from (eye_x, 0, 10) along -z.
std::array<double, 2> seen(Vec3 p, double eye_x = 0) {
  const double away = 10 - static_cast<double>(p.z);
  return {kFocalPx * (static_cast<double>(p.x) - eye_x) / away,
          kFocalPx * static_cast<double>(p.y) / away};
}

struct Compared {
  std::map<std::uint32_t, int> points;  ///< number of compared points, by object
  int wrong = 0;
};

/// eye_x: distance that the camera moves.
Compared compare(const Stage& stage, const Moves& moves, double eye_x = 0) {
  Compared out;
  test_support::Random random(1);
  for (int i = 0; i < 4000; ++i) {
    const core::FirstHitPixel at =
        first_hit_at(stage, {random.uniform() * kWidth, random.uniform() * kHeight});
    if (at.object == 0) {
      continue;
    }
    ++out.points[at.object];
    const auto from = seen(at.position);
    const auto to = seen(moves.at(at.object)(at.position), eye_x);
    const bool is_near = std::fabs(static_cast<double>(at.motion.x) - (to[0] - from[0])) < 1e-3 &&
                         std::fabs(static_cast<double>(at.motion.y) - (to[1] - from[1])) < 1e-3;
    out.wrong += is_near ? 0 : 1;
  }
  return out;
}

TEST(Motion, FollowsNodesInstancesSkinsMorphsAndSplitVertices) {
  File file;
  add_moving_nodes(file);
  const Stage stage = stage_of(file);
  const Compared found = compare(stage, moves());
  EXPECT_EQ(found.points.size(), 6U);
  for (const auto& [object, points] : found.points) {
    EXPECT_GT(points, 30) << "object " << object;
  }
  EXPECT_EQ(found.wrong, 0);
  const auto& meshes = stage.scene->data().meshes;
  EXPECT_TRUE(std::any_of(meshes.begin(), meshes.end(), [](const core::MeshData& mesh) {
    return mesh.file_vertices.size() == 6;
  })) << "no vertices were split";
}

TEST(Motion, DetectsAnObjectThatMovesAFiftiethTooFar) {
  File file;
  add_moving_nodes(file);
  for (const auto& [object, move] : moves()) {
    Moves wrong = moves();
    wrong[object] = [move = move](Vec3 p) { return move(p) + (move(p) - p) * 0.02F; };
    EXPECT_EQ(compare(stage_of(file), wrong).wrong == 0, object == 9) << "object " << object;
  }
}

TEST(Motion, IsZeroWithoutMotion) {
  File file;
  add_moving_nodes(file);
  const Stage stage = stage_of(file);
  int points = 0;
  for (int x = 0; x < kWidth; ++x) {
    for (int y = 0; y < kHeight; ++y) {
      const core::FirstHitPixel at =
          first_hit_at(stage, {static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F});
      if (at.object == 9 || at.object == 0) {
        points += at.object == 9 ? 1 : 0;
        // Rounding at coordinates of about ten metres, with 8 pixels per metre.
        EXPECT_NEAR(at.motion.x, 0, 1e-4);
        EXPECT_NEAR(at.motion.y, 0, 1e-4);
      }
    }
  }
  EXPECT_GT(points, 30);
}

TEST(Motion, FollowsTheCamera) {
  File file;
  add_moving_nodes(file);
  // at 0 at the first time
  file.animate(0, "translation", {-0.25F, 0, 10, 0.75F, 0, 10}, "VEC3", 3);
  const Compared found = compare(stage_of(file), moves(), 0.5);
  EXPECT_EQ(found.wrong, 0);
  EXPECT_GT(compare(stage_of(file), moves(), 0.49).wrong, 400);
}

/// Renders the file at a time from a position; object: only this one, 0: all.
std::vector<core::FirstHitPixel> picture(File& file, double seconds, Vec3 eye,
                                         std::uint32_t object = 0) {
  core::SceneDescription description = file.at(seconds);
  if (object != 0) {
    std::erase_if(description.instances,
                  [object](const auto& instance) { return instance.object != object; });
  }
  const auto scene = core::Scene::build(std::move(description), 1);
  EXPECT_TRUE(scene);
  core::CameraSettings settings;
  settings.position = eye;
  settings.target = Vec3{-1, -1, 0};
  const auto camera = core::Camera::create(settings, {}, {}, kWidth, kHeight);
  std::vector<core::FirstHitPixel> out;
  std::uint64_t rays = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      const Vec2 film_px = {static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F};
      out.push_back(core::first_hit_pixel((*scene)->data(), camera->ray(film_px, {0.5F, 0.5F}).ray,
                                          nullptr, rays));
    }
  }
  return out;
}

TEST(FileFirstHits, EqualThoseOfEachObjectAloneAtAllTimesAndFromAllSides) {
  File file;
  add_moving_nodes(file);
  std::map<std::uint32_t, std::array<std::uint32_t, 2>> known;  // by instance: object, primitive
  int hidden = 0;
  for (const double seconds : {0.0, 0.5, 1.0}) {
    for (const Vec3 eye : {Vec3{7, -1, 1}, Vec3{-3, 9, -7}, Vec3{0, 0, 10}}) {
      const auto all = picture(file, seconds, eye);
      std::vector<core::FirstHitPixel> nearest(all.size());
      for (const auto& [object, move] : moves()) {
        const auto alone = picture(file, seconds, eye, object);
        for (std::size_t i = 0; i < all.size(); ++i) {
          if (alone[i].object == 0) {
            continue;
          }
          const bool is_free = nearest[i].object == 0;
          hidden += is_free ? 0 : 1;
          if (is_free || length(alone[i].position - eye) < length(nearest[i].position - eye)) {
            nearest[i] = alone[i];
          }
        }
      }
      for (std::size_t i = 0; i < all.size(); ++i) {
        ASSERT_EQ(all[i].object, nearest[i].object) << seconds << " s, pixel " << i;
        ASSERT_EQ(all[i].instance, nearest[i].instance);
        if (all[i].object != 0) {
          const auto [at, is_new] =
              known.try_emplace(all[i].instance, std::array{all[i].object, all[i].primitive});
          EXPECT_EQ(at->second, (std::array{all[i].object, all[i].primitive}));
        }
      }
    }
  }
  EXPECT_EQ(known.size(), 8U);
  EXPECT_GT(hidden, 100);
}

TEST(Motion, OfACameraWithAPoseIsThatOfTheObjects) {
  File file;
  add_moving_nodes(file);
  file.animate(0, "translation", {9, 0, 10, 0, 0, 9}, "VEC3", 3);
  core::CameraSettings settings;
  settings.position = Vec3{0, 0, 10};
  settings.target = Vec3{0, 0, 0};
  settings.vertical_fov_degrees = 53.130102F;
  EXPECT_EQ(compare(stage_of(file, settings), moves()).wrong, 0);
}

TEST(Motion, IsUnknownForPointsLaterHiddenOrBehindTheCamera) {
  File hidden;
  hidden.writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1,"znear":0.1}})");
  hidden.writer.add("nodes", R"({"camera":0,"translation":[0,0,10]})");
  add_primitive(hidden.writer, triangle_at(hidden));
  hidden.animate(1, "scale", {1, 1, 1, 0, 0, 0}, "VEC3", 3);
  // At 0.75 s it is scaled to a quarter; from 1 s on it is a point.
  Stage stage = stage_of(hidden);
  EXPECT_FALSE(std::isnan(first_hit_at(stage, {63, 37}).motion.x));
  stage.motion.target = std::make_shared<const core::MotionTarget>(hidden.at(1, true));
  EXPECT_EQ(first_hit_at(stage, {63, 37}).object, 2U);
  EXPECT_TRUE(std::isnan(first_hit_at(stage, {63, 37}).motion.x));
  File passing;
  add_moving_nodes(passing);
  // through the plane of the camera
  passing.animate(0, "translation", {0, 0, 15, 0, 0, -5}, "VEC3", 3);
  const core::FirstHitPixel passed = first_hit_at(stage_of(passing), {55, 40});
  EXPECT_NE(passed.object, 0U);
  EXPECT_TRUE(std::isnan(passed.motion.y));
}

TEST(Motion, OfAPanoramaTakesTheShorterWay) {
  File file;
  // Behind the camera, which looks along -z from the origin: from one side of the seam to the
  // other.
  const int positions = file.positions({-1, -1, 4, 0, 2, 4, 1, -1, 4});
  add_primitive(file.writer, "\"attributes\":{\"POSITION\":" + number(positions) + "}");
  file.animate(0, "translation", {0.5F, 0, 0, -0.5F, 0, 0}, "VEC3", 3);
  core::CameraSettings settings;
  settings.type = core::CameraType::kPanorama;
  settings.position = Vec3{0, 0, 0};
  settings.target = Vec3{0, 0, -1};
  const Stage stage = stage_of(file, settings);
  const core::FirstHitPixel at = first_hit_at(stage, {kWidth - 0.1F, kHeight / 2.0F});
  ASSERT_EQ(at.object, 1U);
  const double angle = std::atan2(static_cast<double>(at.position.x), 4);
  const double later = std::atan2(static_cast<double>(at.position.x) - 0.5, 4);
  EXPECT_NEAR(at.motion.x, (angle - later) * kWidth / 6.283185307179586, 1e-3);
  EXPECT_GT(at.motion.x, 0);
}

TEST(Motion, ModelsAreFramedOverTheirWholeAnimation) {
  File file;
  add_primitive(file.writer, triangle_at(file));  // x and y from 0 to 2
  file.animate(0, "translation", {0, 0, 0, 100, 50, 0}, "VEC3", 3);
  add_primitive(file.writer, triangle_at(file));
  for (const double time : {-5.0, 0.0, 0.3, 1.0}) {
    core::SceneDescription scene = file.at(time);
    const core::Bounds box = core::bounds_of(scene);
    EXPECT_EQ(box.min, (Vec3{0, 0, 0})) << time;
    EXPECT_EQ(box.max, (Vec3{102, 52, 0})) << time;
    const auto built = core::Scene::build(std::move(scene), 1);
    ASSERT_TRUE(built);
    EXPECT_EQ((*built)->summary().bounds.max, box.max);
    EXPECT_EQ((*built)->summary().extremes, core::framed_points_of(file.at(time)));
  }
  core::GltfOptions open;
  open.time_seconds = 0.25;
  open.shutter_seconds = 0.5;
  const core::Bytes bytes = file.writer.finish();
  const auto blurred = load(bytes, open);
  ASSERT_TRUE(blurred);
  EXPECT_EQ(core::framed_points_of(*blurred), core::framed_points_of(file.at(0)));
  core::GltfOptions rest;
  rest.time_seconds = std::nullopt;
  const auto resting = load(bytes, rest);
  ASSERT_TRUE(resting);
  EXPECT_EQ(core::bounds_of(*resting).max, (Vec3{2, 2, 0})) << "framed on its own";
}

TEST(Motion, SkinsAreFramedOverTheirWholeAnimationAndMovingCamerasCostNothing) {
  File file;
  add_moving_nodes(file);
  EXPECT_EQ(core::framed_points_of(file.at(0)), core::framed_points_of(file.at(1)));
  File flight;
  flight.writer.add("cameras", R"({"type":"perspective","perspective":{"yfov":1,"znear":0.1}})");
  flight.writer.add("nodes", R"({"camera":0})");
  flight.animate(0, "translation", {0, 0, 10, 0, 0, 20}, "VEC3", 3);
  add_primitive(flight.writer, triangle_at(flight));
  EXPECT_TRUE(flight.at(0.5).framed.empty());
}

}  // namespace
