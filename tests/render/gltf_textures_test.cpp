// Textures as specified by glTF and KHR_texture_transform: decoding, wrapping, transforms, texture
// coordinate sets, normal maps. Unlit patches show texels exactly; a lit one shows the normal.
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "tests/render/gltf_stage.h"

namespace {

using core::Rgb;
using core::TextureWrap;
using test_support::Picture;
using test_support::pixel;

core::MaterialDescription unlit() {
  core::MaterialDescription m;
  m.unlit = true;
  return m;
}

void expect_rgb(Rgb seen, Rgb expected, float tolerance, const std::string& what) {
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(seen[c], expected[c], tolerance) << what << ", channel " << c;
  }
}

constexpr double kPi = 3.14159265358979323846;

TEST(GltfTextures, DecodesColorsAsSrgbAndDataAsLinear) {
  core::MaterialDescription m = unlit();
  m.base_color_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  test_support::add_image(scene, 1, 1, 3, {128, 10, 255});
  const Rgb seen = pixel(test_support::shoot_glb(scene, {}), 4, 4);
  expect_rgb(seen,
             {static_cast<float>(test_support::srgb_to_linear(128)),
              static_cast<float>(test_support::srgb_to_linear(10)), 1},
             1e-5F, "base colour");
  // Roughness and metalness are read as stored: metal of 51/255 = 0.2 under a sun, without the
  // specular layer.
  core::MaterialDescription data = test_support::lambert({0.5F, 0.5F, 0.5F});
  data.metallic = 1;
  data.metallic_roughness_texture.image = 0;
  core::SceneDescription lit = test_support::stage(data);
  test_support::add_image(lit, 1, 1, 3, {0, 255, 51});
  lit.lights.push_back(test_support::sun(test_support::towards(80), {1, 1, 1}));
  const float diffuse = pixel(test_support::shoot_glb(lit, {}), 4, 4).r;
  const double expected = 0.8 * 0.5 / kPi * std::cos(80 * kPi / 180);
  EXPECT_GT(diffuse, expected);         // plus the reflection of the rough metal part:
  EXPECT_LT(diffuse, expected * 1.25);  // at most 0.2 of a Lambertian's albedo 0.5
}

TEST(GltfTextures, WrapModesRepeatMirrorAndClamp) {
  // A row of red, green, blue over u in [-1, 2]: nine columns of one texel each.
  const std::array<TextureWrap, 3> modes = {TextureWrap::kRepeat, TextureWrap::kMirroredRepeat,
                                            TextureWrap::kClampToEdge};
  const char* expected[3] = {"rgbrgbrgb", "bgrrgbbgr", "rrrrgbbbb"};
  for (std::size_t k = 0; k < 3; ++k) {
    for (const bool along_v : {false, true}) {
      core::MaterialDescription m = unlit();
      m.base_color_texture.image = 0;
      m.base_color_texture.nearest = true;
      (along_v ? m.base_color_texture.wrap_v : m.base_color_texture.wrap_u) = modes[k];
      core::SceneDescription scene = test_support::stage(m);
      const std::vector<int> texels = {255, 0, 0, 0, 255, 0, 0, 0, 255};
      test_support::add_image(scene, along_v ? 1 : 3, along_v ? 3 : 1, 3, texels);
      for (core::Vec2& uv : scene.meshes[0].primitives[0].uv[0]) {
        (along_v ? uv.y : uv.x) = (along_v ? uv.y : uv.x) * 3 - 1;
      }
      const Picture picture = test_support::shoot_glb(scene, {.width = 9, .height = 9});
      for (int i = 0; i < 9; ++i) {
        const Rgb seen = pixel(picture, along_v ? 4 : i, along_v ? i : 4);
        const char letter =
            seen.r > 0.99F ? 'r' : (seen.g > 0.99F ? 'g' : (seen.b > 0.99F ? 'b' : '?'));
        EXPECT_EQ(letter, expected[k][i]) << "mode " << k << (along_v ? " v " : " u ") << i;
      }
    }
  }
}

TEST(GltfTextures, TransformScalesThenRotatesThenTranslates) {
  // KHR_texture_transform: uv' = offset + R(rotation) scale uv; a positive rotation turns the image
  // counter-clockwise, so +u of the surface reads towards -v (up) of the image.
  const double angle = 0.6;
  const std::array<double, 2> scale = {0.7, 0.4};
  const std::array<double, 2> offset = {0.1, 0.35};
  core::MaterialDescription m = unlit();
  m.base_color_texture.image = 0;
  const auto c = static_cast<float>(std::cos(angle));
  const auto s = static_cast<float>(std::sin(angle));
  m.base_color_texture.uv_transform = {c * 0.7F, s * 0.4F, 0.1F, -s * 0.7F, c * 0.4F, 0.35F};
  core::SceneDescription scene = test_support::stage(m);
  // A linear ramp: red grows with u, green with v. Between texel centres it is exactly linear,
  // apart from the sRGB curve, which the two ends of each channel determine.
  test_support::add_image(scene, 2, 2, 3, {0, 0, 0, 255, 0, 0, 0, 255, 0, 255, 255, 0});
  const Picture picture =
      test_support::shoot_glb(scene, {.width = 16, .height = 16, .samples = 64});
  const auto ramp = [](double x) {  // bilinear between texel centres 1/4 and 3/4, repeated beyond
    const double t = x - std::floor(x);
    return t < 0.25 ? 0.5 - 2 * t : (t < 0.75 ? 2 * t - 0.5 : 2.5 - 2 * t);
  };
  for (int y = 0; y < 16; y += 3) {
    for (int x = 0; x < 16; x += 3) {
      const double u = (x + 0.5) / 16 * scale[0];
      const double v = (y + 0.5) / 16 * scale[1];
      const double u2 = std::cos(angle) * u + std::sin(angle) * v + offset[0];
      const double v2 = -std::sin(angle) * u + std::cos(angle) * v + offset[1];
      const Rgb seen = pixel(picture, x, y);
      EXPECT_NEAR(static_cast<double>(seen.r), ramp(u2), 0.04)
          << x << " " << y;  // half a pixel of the ramp
      EXPECT_NEAR(static_cast<double>(seen.g), ramp(v2), 0.04) << x << " " << y;
    }
  }
}

TEST(GltfTextures, SecondTextureCoordinateSetIsIndependent) {
  core::MaterialDescription m = unlit();
  m.base_color_texture.image = 0;
  m.base_color_texture.nearest = true;
  m.base_color_texture.uv_set = 1;
  core::SceneDescription scene = test_support::stage(m);
  test_support::add_image(scene, 2, 1, 3, {255, 0, 0, 0, 0, 255});
  auto& p = scene.meshes[0].primitives[0];
  p.uv[1] = {{1, 1}, {0, 1}, {0, 0}, {1, 0}};  // rotated: blue on the left
  const Picture picture = test_support::shoot_glb(scene, {});
  expect_rgb(pixel(picture, 1, 4), {0, 0, 1}, 1e-5F, "left");
  expect_rgb(pixel(picture, 6, 4), {1, 0, 0}, 1e-5F, "right");
}

TEST(GltfTextures, VertexColorsMultiplyTheFactorLinearly) {
  core::MaterialDescription m = unlit();
  m.base_color = {0.5F, 1, 1};
  core::SceneDescription scene = test_support::stage(m);
  // Linear in x and y: red grows to the right, green upwards.
  scene.meshes[0].primitives[0].colors = {
      {0, 0, 0.3F, 1}, {1, 0, 0.3F, 1}, {1, 1, 0.3F, 1}, {0, 1, 0.3F, 1}};
  const Picture picture = test_support::shoot_glb(scene, {.samples = 64});
  for (const int x : {0, 3, 7}) {
    for (const int y : {0, 4, 7}) {
      const auto fx = (static_cast<float>(x) + 0.5F) / 8;
      const auto fy = 1 - (static_cast<float>(y) + 0.5F) / 8;
      expect_rgb(pixel(picture, x, y), {0.5F * fx, fy, 0.3F}, 0.01F, "at a vertex colour");
    }
  }
}

/// A checkerboard of 64 x 64 squares on 8 m, seen at 8 degrees: root mean square and mean signed
/// difference from a reference computed arithmetically, 1024 points per pixel with the same box
/// filter.
struct Grazing {
  double rms = 0;
  double mean = 0;
};
Grazing grazing_checker(int samples) {
  constexpr int kSquares = 64;
  constexpr int kTexels = 4;  // per side of a square
  constexpr int kWidth = 64;
  constexpr int kHeight = 48;
  core::MaterialDescription m = unlit();
  m.base_color_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  std::vector<int> texels;
  for (int y = 0; y < kSquares * kTexels; ++y) {
    for (int x = 0; x < kSquares * kTexels; ++x) {
      const int grey = (x / kTexels + y / kTexels) % 2 == 0 ? 255 : 0;
      texels.insert(texels.end(), {grey, grey, grey});
    }
  }
  test_support::add_image(scene, kSquares * kTexels, kSquares * kTexels, 3, texels);
  for (core::Vec3& p : scene.meshes[0].primitives[0].positions) {
    p = {p.x * 4, p.y * 4, 0};
  }
  core::View view = test_support::view_of(scene, kWidth, kHeight);
  const double tilt = 8 * kPi / 180;
  const double away = 6;
  test_support::look_at(
      view,
      {0, static_cast<float>(-away * std::cos(tilt)), static_cast<float>(away * std::sin(tilt))},
      {0, 0, 0}, 20);
  view.settings.max_depth = 0;
  const Picture picture = test_support::render(view, samples);
  // The same camera, computed by hand: x to the right, `up` across the view.
  const double half = std::tan(10 * kPi / 180);
  Grazing out;
  int count = 0;
  for (int y = 0; y < kHeight; ++y) {
    for (int x = 0; x < kWidth; ++x) {
      double truth = 0;
      bool inside = true;
      constexpr int kSide = 32;
      for (int i = 0; i < kSide * kSide; ++i) {
        const double sx = (x + (i % kSide + 0.5) / kSide) / kWidth * 2 - 1;
        const double sy = 1 - (y + (i / kSide + 0.5) / kSide) / kHeight * 2;
        const double right = sx * half * kWidth / kHeight;
        const double up = sy * half;
        // forward = (0, cos, -sin), up = (0, sin, cos)
        const double dy = std::cos(tilt) + up * std::sin(tilt);
        const double dz = -std::sin(tilt) + up * std::cos(tilt);
        const double t = -away * std::sin(tilt) / dz;
        const double px = right * t;
        const double py = -away * std::cos(tilt) + dy * t;
        inside = inside && t > 0 && std::fabs(px) < 4 && std::fabs(py) < 4;
        const int column = static_cast<int>(std::floor((px + 4) / 8 * kSquares));
        const int row = static_cast<int>(std::floor((4 - py) / 8 * kSquares));
        truth += (column + row) % 2 == 0 ? 1.0 / (kSide * kSide) : 0;
      }
      if (inside) {
        const double difference = static_cast<double>(pixel(picture, x, y).g) - truth;
        out.rms += difference * difference;
        out.mean += difference;
        ++count;
      }
    }
  }
  EXPECT_GT(count, 1000);
  out.rms = std::sqrt(out.rms / count);
  out.mean /= count;
  return out;
}

TEST(GltfTextures, GrazingCheckerboardIsNeitherBlurredNorAliased) {
  // One point of a black and white square has a deviation of 0.5, and the mean of n independent
  // ones 0.5 / sqrt(n): 0.25 for 4. A single isotropic lookup of the footprint's area fails the
  // first limit. The error remaining with many samples is blur.
  const Grazing few = grazing_checker(4);
  EXPECT_LT(few.rms, 0.11);
  const Grazing many = grazing_checker(256);
  EXPECT_LT(many.rms, 0.055);
  EXPECT_NEAR(many.mean, 0, 0.005);
}

/// A patch whose normal map tilts the normal by `degrees` towards +u, or towards -v (the map's
/// green).
core::SceneDescription tilted(double degrees, bool along_v, float scale = 1) {
  core::MaterialDescription m = test_support::lambert({0.8F, 0.8F, 0.8F});
  m.normal_texture.image = 0;
  m.normal_scale = scale;
  core::SceneDescription scene = test_support::stage(m);
  const auto byte = [](double v) { return static_cast<int>(std::lround((v + 1) / 2 * 255)); };
  const double s = std::sin(degrees * kPi / 180);
  test_support::add_image(
      scene, 1, 1, 3,
      {byte(along_v ? 0 : s), byte(along_v ? s : 0), byte(std::cos(degrees * kPi / 180))});
  return scene;
}

/// Radiance of a Lambertian of albedo 0.8 with normal n under a sun at wi.
double lambert_radiance(core::Vec3 n, core::Vec3 wi) {
  return 0.8 / kPi * static_cast<double>(core::dot(n, wi));
}

float shown(core::SceneDescription scene, core::Vec3 wi) {
  scene.lights.push_back(test_support::sun(wi, {1, 1, 1}));
  return pixel(test_support::shoot_glb(scene, {}), 4, 4).r;
}

constexpr double kByte = 0.004;  // an 8-bit normal is off by up to 1/255 in each direction

TEST(GltfNormalMaps, RedTiltsAlongUAndGreenUpwards) {
  const core::Vec3 wi = test_support::towards(30, 20);
  EXPECT_NEAR(static_cast<double>(shown(tilted(25, false), wi)),
              lambert_radiance(test_support::towards(25, 0), wi), kByte);
  EXPECT_NEAR(static_cast<double>(shown(tilted(25, true), wi)),
              lambert_radiance(test_support::towards(25, 90), wi), kByte);
}

TEST(GltfNormalMaps, ScaleStretchesRedAndGreen) {
  const core::Vec3 wi = test_support::towards(20);
  for (const float scale : {0.5F, 2.0F, -1.0F}) {
    const double tilt =
        std::atan2(static_cast<double>(scale) * std::sin(0.3), std::cos(0.3)) * 180 / kPi;
    EXPECT_NEAR(static_cast<double>(shown(tilted(0.3 * 180 / kPi, false, scale), wi)),
                lambert_radiance(test_support::towards(tilt), wi), 2 * kByte)
        << scale;
  }
}

TEST(GltfNormalMaps, UsesGivenTangentsWithTheirSign) {
  const core::Vec3 wi = test_support::towards(20, 90);
  for (const float sign : {1.0F, -1.0F}) {
    core::SceneDescription scene = tilted(25, true);
    scene.meshes[0].primitives[0].tangents.assign(4, {1, 0, 0, sign});
    EXPECT_NEAR(static_cast<double>(shown(scene, wi)),
                lambert_radiance(test_support::towards(25, sign > 0 ? 90 : -90), wi), kByte);
  }
}

TEST(GltfNormalMaps, MirroredInstancesMirrorTheTilt) {
  const core::Vec3 wi = test_support::towards(20);
  for (const bool twice : {false, true}) {  // as a single node, or as one of two instances
    for (const bool given : {false, true}) {
      core::SceneDescription scene = tilted(25, false);
      if (given) {
        scene.meshes[0].primitives[0].tangents.assign(4, {1, 0, 0, 1});
      }
      scene.instances[0].to_world = core::scaling({-1, 1, 1});
      if (twice) {
        scene.instances.push_back({0, core::translation({5, 0, 0})});
      }
      EXPECT_NEAR(static_cast<double>(shown(scene, wi)),
                  lambert_radiance(test_support::towards(-25), wi), kByte)
          << twice << given;
    }
  }
}

constexpr float kStretch = 3;

/// Makes u grow faster over the patch than v.
void stretch(core::PrimitiveDescription& patch) {
  for (core::Vec2& p : patch.uv[0]) {
    p.x *= kStretch;
  }
}

/// Coordinates that are turned (counter-clockwise, degrees) and then mirrored in v.
std::array<float, 6> turned(double degrees, bool is_mirrored) {
  const auto c = static_cast<float>(std::cos(degrees * kPi / 180));
  const auto s = static_cast<float>(std::sin(degrees * kPi / 180));
  const float v = is_mirrored ? -2.0F : 2.0F;
  return {2 * c, s * v, 0, -2 * s, c * v, 0};  // uv_transform of rotation and scale (2, v)
}

/// Azimuth of the direction in the patch along which u of the transformed coordinates grows, and
/// their v falls: columns of the inverse; the patch's v points down.
double azimuth(const std::array<float, 6>& m, bool along_v) {
  const auto at = [&m](std::size_t i) { return static_cast<double>(m[i]); };
  const double sign = at(0) * at(4) - at(1) * at(3) < 0 ? -1 : 1;
  const double u = along_v ? at(1) : at(4);
  const double v = along_v ? -at(0) : -at(3);
  return std::atan2(-sign * v, sign * u) * 180 / kPi;
}

// "the texture coordinates associated with the normal texture" are those after the transform.
TEST(GltfNormalMaps, FollowTheTransformOfTheirCoordinates) {
  const core::Vec3 wi = test_support::towards(35, 25);
  for (const double degrees : {0.0, 30.0, 90.0, 180.0, 270.0}) {
    for (const bool is_mirrored : {false, true}) {
      for (const bool along_v : {false, true}) {
        core::SceneDescription scene = tilted(25, along_v);
        const auto m = turned(degrees, is_mirrored);
        scene.materials[0].normal_texture.uv_transform = m;
        EXPECT_NEAR(static_cast<double>(shown(scene, wi)),
                    lambert_radiance(test_support::towards(25, azimuth(m, along_v)), wi), kByte)
            << degrees << is_mirrored << along_v;
      }
    }
  }
}

// Where a step of u is not as long as one of v, the transform does not turn by its angle.
TEST(GltfNormalMaps, FollowTheTransformOfStretchedCoordinates) {
  const core::Vec3 wi = test_support::towards(35, 25);
  for (const double degrees : {0.0, 30.0, 120.0}) {
    for (const bool is_mirrored : {false, true}) {
      for (const bool along_v : {false, true}) {
        core::SceneDescription scene = tilted(25, along_v);
        stretch(scene.meshes[0].primitives[0]);
        auto m = turned(degrees, is_mirrored);
        scene.materials[0].normal_texture.uv_transform = m;
        m[0] *= kStretch;
        m[3] *= kStretch;
        // The bitangent is at a right angle to the tangent.
        const double side = along_v ? (is_mirrored ? -90 : 90) : 0;
        EXPECT_NEAR(static_cast<double>(shown(scene, wi)),
                    lambert_radiance(test_support::towards(25, azimuth(m, false) + side), wi),
                    kByte)
            << degrees << is_mirrored << along_v;
      }
    }
  }
}

TEST(GltfNormalMaps, AnisotropyFollowsTheTransformOfStretchedCoordinates) {
  const auto seen = [](double degrees, bool by_coordinates) {
    core::MaterialDescription m = test_support::lambert({1, 1, 1});
    m.metallic = 1;
    m.roughness = 0.5F;
    m.anisotropy = 0.8F;
    m.anisotropy_texture.image = 0;
    core::SceneDescription scene = test_support::stage(m);
    test_support::add_image(scene, 1, 1, 3, {255, 128, 255});
    core::PrimitiveDescription& patch = scene.meshes[0].primitives[0];
    stretch(patch);
    const auto matrix = turned(degrees, false);
    if (by_coordinates) {
      for (core::Vec2& p : patch.uv[0]) {
        p = {matrix[0] * p.x + matrix[1] * p.y, matrix[3] * p.x + matrix[4] * p.y};
      }
    } else {
      scene.materials[0].anisotropy_texture.uv_transform = matrix;
    }
    return shown(scene, test_support::towards(50, 20));
  };
  const float flat = seen(0, false);
  for (const double degrees : {30.0, 120.0}) {
    const float baked = seen(degrees, true);
    EXPECT_NEAR(seen(degrees, false), baked, 1e-4F * baked) << degrees;
    EXPECT_GT(std::fabs(baked - flat), 0.05F * flat) << degrees;
  }
}

// "When tangents are specified" they are the file's, whatever the transform.
TEST(GltfNormalMaps, GivenTangentsAreNotTurned) {
  core::SceneDescription scene = tilted(25, false);
  scene.materials[0].normal_texture.uv_transform = turned(90, false);
  scene.meshes[0].primitives[0].tangents.assign(4, {1, 0, 0, 1});
  const core::Vec3 wi = test_support::towards(20);
  EXPECT_NEAR(static_cast<double>(shown(scene, wi)),
              lambert_radiance(test_support::towards(25), wi), kByte);
}

/// A smooth black surface under a coat with a normal map, on a set of its own that is turned by
/// `degrees`, or has the transform.
core::SceneDescription coated(double degrees, bool by_coordinates) {
  core::MaterialDescription m = test_support::lambert({0, 0, 0});
  m.clearcoat = 1;
  m.clearcoat_roughness = 0.5F;
  m.normal_texture.image = 1;  // flat, on set 0
  m.clearcoat_normal_texture.image = 0;
  core::SceneDescription scene = test_support::stage(m);
  core::PrimitiveDescription& patch = scene.meshes[0].primitives[0];
  stretch(patch);
  const auto matrix = turned(degrees, false);
  if (by_coordinates) {
    scene.materials[0].clearcoat_normal_texture.uv_set = 1;
    for (const core::Vec2 p : patch.uv[0]) {
      patch.uv[1].push_back({matrix[0] * p.x + matrix[1] * p.y, matrix[3] * p.x + matrix[4] * p.y});
    }
  } else {
    scene.materials[0].clearcoat_normal_texture.uv_transform = matrix;
  }
  test_support::add_image(scene, 1, 1, 3, {190, 128, 230});
  test_support::add_image(scene, 1, 1, 3, {128, 128, 255});
  return scene;
}

// A coat's map has its own coordinates: another set, or another transform, than the normal map.
TEST(GltfNormalMaps, CoatsFollowTheirOwnCoordinates) {
  const core::Vec3 wi = test_support::towards(50, 100);
  const float flat = shown(coated(0, false), wi);
  for (const double degrees : {90.0, 120.0, 270.0}) {
    const float by_transform = shown(coated(degrees, false), wi);
    EXPECT_NEAR(shown(coated(degrees, true), wi), by_transform, 1e-4F * by_transform) << degrees;
    EXPECT_GT(std::fabs(by_transform - flat), 0.1F * flat) << degrees;
  }
}

// The mesh's own tangents are for the normal texture, be its coordinates mirrored or not.
TEST(GltfNormalMaps, CoatsOfAnotherSetDoNotFollowGivenTangents) {
  const core::Vec3 wi = test_support::towards(50, 100);
  for (const double degrees : {0.0, 120.0}) {
    core::SceneDescription scene = coated(degrees, true);
    const float computed = shown(scene, wi);
    for (const float sign : {1.0F, -1.0F}) {
      scene.meshes[0].primitives[0].tangents.assign(4, {1, 0, 0, sign});
      EXPECT_NEAR(shown(scene, wi), computed, 1e-4F * computed) << degrees << " " << sign;
    }
  }
}

TEST(GltfNormalMaps, BackOfADoubleSidedSurfaceFlipsTheNormal) {
  // Seen from behind (the patch is rotated about y), u grows to the left, and the tilt follows it;
  // the other components of the normal face the viewer.
  core::SceneDescription scene = tilted(25, false);
  scene.materials[0].double_sided = true;
  scene.instances[0].to_world = core::rotation({0, 1, 0, 0});
  const core::Vec3 wi = test_support::towards(20);
  // In the patch's frame n = (s, 0, c); rotated: (-s, 0, -c); flipped for the back: (s, 0, c).
  EXPECT_NEAR(static_cast<double>(shown(scene, wi)),
              lambert_radiance(test_support::towards(25), wi), kByte);
}

}  // namespace
