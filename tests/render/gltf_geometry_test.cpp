// Positions of surfaces under glTF's morph targets, skins and animations, read from the depth
// layer; the files are written by hand.
#include <string>

#include <gtest/gtest.h>

#include "tests/render/gltf_stage.h"

namespace {

/// A large triangle in the plane z = 0 below a camera 10 m away: the depth is 10 minus the z of the
/// surface.
class Surface {
 public:
  Surface() {
    const float positions[9] = {-2, -2, 0, 6, -2, 0, -2, 6, 0};
    position_ = writer.add_accessor(std::as_bytes(std::span(positions)), 5126, "VEC3", 3,
                                    R"({"min": [-2, -2, 0], "max": [6, 6, 0]})");
    writer.add("cameras",
               R"({"type": "orthographic", "orthographic": {"xmag": 1, "ymag": 1, "znear": 0,)"
               R"( "zfar": 99}})");
  }

  template <std::size_t N>
  int floats(const float (&values)[N], const char* type, std::size_t count,
             const char* more = "{}") {
    return writer.add_accessor(std::as_bytes(std::span(values)), 5126, type, count, more);
  }

  /// attributes: in addition to the positions; mesh, node: additional members, each starting with a
  /// comma.
  void place(const std::string& attributes, const std::string& primitive, const std::string& mesh,
             const std::string& node) {
    writer.add("meshes", R"({"primitives": [{"attributes": {"POSITION": )" +
                             std::to_string(position_) + attributes + "}" + primitive + "}]" +
                             mesh + "}");
    writer.add("nodes", R"({"mesh": 0)" + node + "}");
    writer.add("nodes", R"({"camera": 0, "translation": [0, 0, 10]})");
  }

  /// Adds an animation of node 0 with one channel.
  void animate(const char* path, const char* interpolation, int input, int output) {
    const std::string a = std::to_string(input);
    const std::string b = std::to_string(output);
    writer.add("animations",
               std::string(R"({"channels": [{"sampler": 0, "target": {"node": 0, "path": ")") +
                   path + R"("}}], "samplers": [{"interpolation": ")" + interpolation +
                   R"(", "input": )" + a + R"(, "output": )" + b + "}]}");
  }

  /// Returns the height of the surface at the centre of the image.
  static float height(const core::Bytes& glb, double time_seconds) {
    core::GltfOptions options;
    options.time_seconds = time_seconds;
    const auto picture = test_support::shoot(
        test_support::load(glb, options),
        {.width = 1, .height = 1, .samples = 16, .depth = 0, .depth_layer = true});
    return 10 - test_support::depth_at(picture, 0, 0);
  }

  core::GlbWriter writer;

 private:
  int position_ = 0;
};

constexpr float kTolerance = 2e-5F;  // ten times the rounding error at 10 m

TEST(GltfGeometry, MorphTargetsAddWeightedDisplacements) {
  Surface s;
  const float up[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
  const float more[9] = {0, 0, 0.5F, 0, 0, 0.5F, 0, 0, 0.5F};
  const std::string a =
      std::to_string(s.floats(up, "VEC3", 3, R"({"min": [0, 0, 1], "max": [0, 0, 1]})"));
  const std::string b =
      std::to_string(s.floats(more, "VEC3", 3, R"({"min": [0, 0, 0.5], "max": [0, 0, 0.5]})"));
  s.place("", R"(, "targets": [{"POSITION": )" + a + R"(}, {"POSITION": )" + b + "}]",
          R"(, "weights": [2, -1])", "");
  const core::Bytes glb = s.writer.finish();
  EXPECT_NEAR(Surface::height(glb, 0), 2 * 1 - 1 * 0.5F, kTolerance);
}

TEST(GltfGeometry, AnimatesMorphWeights) {
  Surface s;
  const float up[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
  const std::string a =
      std::to_string(s.floats(up, "VEC3", 3, R"({"min": [0, 0, 1], "max": [0, 0, 1]})"));
  s.place("", R"(, "targets": [{"POSITION": )" + a + "}]", R"(, "weights": [7])", "");
  const float times[2] = {1, 3};
  const float weights[2] = {0, 2};
  s.animate("weights", "LINEAR", s.floats(times, "SCALAR", 2, R"({"min": [1], "max": [3]})"),
            s.floats(weights, "SCALAR", 2));
  const core::Bytes glb = s.writer.finish();
  EXPECT_NEAR(Surface::height(glb, 1.5), 0.5F, kTolerance);
  EXPECT_NEAR(Surface::height(glb, 9), 2, kTolerance);  // the last key is held
}

TEST(GltfGeometry, InterpolatesStepLinearAndCubicSpline) {
  struct Case {
    const char* interpolation;
    float at_half;
  };
  // Keys z = 0 at 0 s and z = 1 at 2 s. The spline has out-tangent 3 and in-tangent 0 [1/s]: at t =
  // 1/2 p = (1/2) p0 + (1/8) 2 s * 3 + (1/2) p1 - (1/8) 2 s * 0.
  for (const Case& c : {Case{"STEP", 0}, Case{"LINEAR", 0.5F}, Case{"CUBICSPLINE", 0.5F + 0.75F}}) {
    Surface s;
    s.place("", "", "", "");
    const float times[2] = {0, 2};
    const int input = s.floats(times, "SCALAR", 2, R"({"min": [0], "max": [2]})");
    const float plain[6] = {0, 0, 0, 0, 0, 1};
    const float spline[18] = {0, 0, 0, 0, 0, 0, 0, 0, 3, 0, 0, 0, 0, 0, 1, 0, 0, 0};
    const bool cubic = std::string(c.interpolation) == "CUBICSPLINE";
    const int output = cubic ? s.floats(spline, "VEC3", 6) : s.floats(plain, "VEC3", 2);
    s.animate("translation", c.interpolation, input, output);
    const core::Bytes glb = s.writer.finish();
    EXPECT_NEAR(Surface::height(glb, 1), c.at_half, kTolerance) << c.interpolation;
    EXPECT_NEAR(Surface::height(glb, 2), 1, kTolerance) << c.interpolation;
  }
}

TEST(GltfGeometry, InterpolatesRotationsSpherically) {
  // A rotation by 90 degrees about y in one second has reached 30 degrees after a third: then the
  // plane through the origin has z = -x tan(30 degrees).
  Surface s;
  s.place("", "", "", "");
  const float times[2] = {0, 1};
  const float quarter[8] = {0, 0, 0, 1, 0, 0.70710678F, 0, 0.70710678F};
  s.animate("rotation", "LINEAR", s.floats(times, "SCALAR", 2, R"({"min": [0], "max": [1]})"),
            s.floats(quarter, "VEC4", 2));
  const core::Bytes glb = s.writer.finish();
  core::GltfOptions options;
  options.time_seconds = 1.0 / 3;
  core::SceneDescription scene = test_support::load(glb, options);
  scene.cameras[0].to_world.t.x = 0.5F;
  scene.cameras[0].x_magnification = scene.cameras[0].y_magnification = 1e-4F;
  const auto picture = test_support::shoot(
      scene, {.width = 1, .height = 1, .samples = 16, .depth = 0, .depth_layer = true});
  EXPECT_NEAR(10 - test_support::depth_at(picture, 0, 0), -0.5F * 0.57735027F, kTolerance);
}

TEST(GltfGeometry, SkinsFollowTheirJointsNotTheirNode) {
  Surface s;
  const std::uint8_t joints[12] = {0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0};
  const float weights[12] = {0.25F, 0.75F, 0, 0, 0.25F, 0.75F, 0, 0, 0.25F, 0.75F, 0, 0};
  // Inverse bind matrices that translate by -1 and -2 along z.
  const float inverse_bind[32] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -1, 1,
                                  1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, -2, 1};
  const std::string j =
      std::to_string(s.writer.add_accessor(std::as_bytes(std::span(joints)), 5121, "VEC4", 3));
  const std::string w = std::to_string(s.floats(weights, "VEC4", 3));
  const std::string m = std::to_string(s.floats(inverse_bind, "MAT4", 2));
  s.place(R"(, "JOINTS_0": )" + j + R"(, "WEIGHTS_0": )" + w, "", "",
          R"(, "skin": 0, "translation": [0, 0, 5])");
  s.writer.add("nodes", R"({"translation": [0, 0, 3]})");
  s.writer.add("nodes", R"({"translation": [0, 0, 6]})");
  s.writer.add("skins", R"({"joints": [2, 3], "inverseBindMatrices": )" + m + "}");
  // 0.25 (3 - 1) + 0.75 (6 - 2); the 5 m of the skinned node are ignored.
  EXPECT_NEAR(Surface::height(s.writer.finish(), 0), 0.25F * 2 + 0.75F * 4, kTolerance);
}

TEST(GltfGeometry, PlacesGpuInstancesByTheirAttributes) {
  Surface s;
  s.writer.use_extension("EXT_mesh_gpu_instancing");
  const float places[6] = {0, 0, 1, 0, 0, 2};
  const float scales[6] = {1, 1, 1, 1, -1, 1};
  const std::string t = std::to_string(s.floats(places, "VEC3", 2));
  const std::string k = std::to_string(s.floats(scales, "VEC3", 2));
  s.place("", "", "",
          R"(, "translation": [0, 0, 0.5],)"
          R"( "extensions": {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": )" +
              t + R"(, "SCALE": )" + k + "}}}");
  EXPECT_NEAR(Surface::height(s.writer.finish(), 0), 2.5F, kTolerance);
}

}  // namespace
