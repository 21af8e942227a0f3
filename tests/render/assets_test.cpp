// Every file of the assets folder renders without errors, and shows the features that its author
// documents (labels, notes, make_gen.py). Skipped with a message if the folder is missing:
// TESSERA_ASSETS names another one.
#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "tests/render/gltf_stage.h"
#include "tests/support/asset_files.h"

namespace {

using core::Rgb;
using core::Vec3;
using test_support::Picture;

class Assets : public testing::Test {
 protected:
  void SetUp() override {
    const auto found = test_support::assets_folder();
    if (!found) {
      GTEST_SKIP() << test_support::missing_assets();
    }
    folder_ = *found;
  }

  core::SceneDescription load(const std::string& name) const {
    auto scene = test_support::load_asset(folder_ / name);
    EXPECT_TRUE(scene) << name << ": " << (scene ? "" : scene.error().message);
    return scene ? *std::move(scene) : core::SceneDescription{};
  }
  std::shared_ptr<const core::Environment> sky() const {
    return test_support::load_sky(folder_ / "env" / "venice_sunset_256.hdr");
  }

  std::filesystem::path folder_;
};

constexpr int kWidth = 96;
constexpr int kHeight = 72;

core::View view_of(core::SceneDescription scene, std::shared_ptr<const core::Environment> sky) {
  core::View view = test_support::view_of(std::move(scene), kWidth, kHeight);
  view.environment = std::move(sky);
  view.settings.film.albedo = view.settings.film.normal = view.settings.film.depth = true;
  return view;
}

/// The scene seen along -z by an orthographic camera, with its auxiliary layers; maps world
/// coordinates to pixels.
class Front {
 public:
  Front(core::SceneDescription scene, float half_height_m, Vec3 eye)
      : half_(half_height_m), eye_(eye) {
    core::CameraDescription camera = test_support::front_camera(half_height_m);
    camera.to_world.t = eye;
    scene.cameras = {camera};
    picture_ =
        test_support::render(view_of(std::move(scene), test_support::constant_sky(Rgb(1))), 16);
  }
  core::AuxPixel at(float x, float y) const { return aux(column(x), row(y)); }
  core::AuxPixel aux(int column, int row) const {
    return picture_.snapshot.aux[static_cast<std::size_t>(std::clamp(row, 0, kHeight - 1) * kWidth +
                                                          std::clamp(column, 0, kWidth - 1))];
  }
  Rgb radiance(float x, float y) const { return test_support::pixel(picture_, column(x), row(y)); }
  /// Returns the mean albedo of the rectangle around (x, y).
  Rgb albedo(float x, float y, float half_x, float half_y) const {
    Rgb sum;
    float n = 0;
    for (int r = row(y + half_y); r <= row(y - half_y); ++r) {
      for (int c = column(x - half_x); c <= column(x + half_x); ++c) {
        sum += aux(c, r).albedo;
        ++n;
      }
    }
    return sum / n;
  }
  /// Returns the mean depth of the square around (x, y), whose sides are pixel boundaries.
  float mean_depth(float x, float y, float half) const {
    float sum = 0;
    float n = 0;
    for (int r = row(y + half + 1e-3F) + 1; r <= row(y - half + 1e-3F); ++r) {
      for (int c = column(x - half + 1e-3F); c <= column(x + half - 1e-3F); ++c) {
        sum += aux(c, r).depth_m;
        ++n;
      }
    }
    return sum / n;
  }
  float world_x(int column) const {
    return eye_.x + ((static_cast<float>(column) + 0.5F) / kHeight * 2 -
                     static_cast<float>(kWidth) / kHeight) *
                        half_;
  }
  float world_y(int row) const {
    return eye_.y + (1 - (static_cast<float>(row) + 0.5F) / kHeight * 2) * half_;
  }

 private:
  int column(float x) const {
    return static_cast<int>(
        std::floor(((x - eye_.x) / half_ + static_cast<float>(kWidth) / kHeight) * 0.5F * kHeight));
  }
  int row(float y) const {
    return static_cast<int>(std::floor((1 - (y - eye_.y) / half_) * 0.5F * kHeight));
  }

  float half_;
  Vec3 eye_;
  Picture picture_;
};

TEST_F(Assets, EveryFileRendersUnderASky) {
  const auto light = sky();
  int rendered = 0;
  for (const std::string& name : test_support::asset_names(folder_)) {
    auto scene = test_support::load_asset(folder_ / name);
    ASSERT_TRUE(scene) << name << ": " << scene.error().message;
    const Picture picture = test_support::render(view_of(*std::move(scene), light), 8);
    EXPECT_EQ(picture.progress.rejected_samples, 0U) << name;
    double covered = 0;
    double contrast = 0;
    for (const core::AuxPixel& aux : picture.snapshot.aux) {
      covered += static_cast<double>(aux.hits) / 8 / (kWidth * kHeight);
      EXPECT_LE(std::max({aux.albedo.r, aux.albedo.g, aux.albedo.b}), 1.03F) << name;
      contrast = std::max(contrast, static_cast<double>(core::luminance(aux.albedo)));
    }
    EXPECT_GT(covered, 0.004) << name << ": the image is empty";
    EXPECT_GT(contrast, 0.01) << name << ": all surfaces are black";
    const Rgb mean = picture.mean();
    EXPECT_GT(core::luminance(mean), 0.02F) << name;
    EXPECT_LT(core::luminance(mean), 40.0F) << name;
    ++rendered;
  }
  EXPECT_GE(rendered, 58);
}

TEST_F(Assets, TextureCoordinateTestShowsEachColorInItsCorner) {
  const Front front(load("TextureCoordinateTest.glb"), 1.3F, {0, 0, 5});
  const Rgb top_left = front.albedo(-0.7F, 0.7F, 0.1F, 0.1F);
  const Rgb top_right = front.albedo(0.7F, 0.7F, 0.1F, 0.1F);
  const Rgb bottom_left = front.albedo(-0.7F, -0.7F, 0.1F, 0.1F);
  const Rgb bottom_right = front.albedo(0.7F, -0.7F, 0.1F, 0.1F);
  EXPECT_TRUE(top_left.r > 0.4F && top_left.g > 0.4F && top_left.b < 0.3F) << "yellow";
  EXPECT_TRUE(top_right.r > 0.4F && top_right.g < 0.35F && top_right.b < 0.2F) << "red";
  EXPECT_TRUE(bottom_left.b > 0.4F && bottom_left.r < 0.3F) << "blue";
  EXPECT_TRUE(bottom_right.g > 0.4F && bottom_right.r < 0.3F && bottom_right.b < 0.3F) << "green";
  // The checkered marks are at the outer corner of each tile, so no tile is rotated or mirrored.
  for (const float sx : {-1.0F, 1.0F}) {
    for (const float sy : {-1.0F, 1.0F}) {
      const float outer = core::luminance(front.albedo(sx * 1.1F, sy * 1.1F, 0.05F, 0.05F));
      for (const float inner :
           {core::luminance(front.albedo(sx * 0.3F, sy * 1.1F, 0.05F, 0.05F)),
            core::luminance(front.albedo(sx * 1.1F, sy * 0.3F, 0.05F, 0.05F))}) {
        EXPECT_LT(outer, 0.9F * inner) << sx << " " << sy;
      }
    }
  }
}

TEST_F(Assets, TextureTransformTestPointsAtItsGreenMarkers) {
  core::SceneDescription scene = load("TextureTransformTest.glb");
  // Positions that the tips of the arrows must reach (Correct Marker) and must not reach (the other
  // markers); the markers themselves are removed.
  std::vector<Vec3> right;
  std::vector<Vec3> wrong;
  std::erase_if(scene.instances, [&](const core::InstanceDescription& instance) {
    const std::string& name = scene.meshes[static_cast<std::size_t>(instance.mesh)].name;
    if (name.find("Marker") == std::string::npos) {
      return false;
    }
    (name == "Correct Marker" ? right : wrong).push_back(instance.to_world.t);
    return true;
  });
  const Front front(scene, 1.25F, {0, 0, 5});
  const Rgb u = front.albedo(-1.1F, 0.55F, 0.4F, 0.4F);
  const Rgb v = front.albedo(0, 0.55F, 0.4F, 0.4F);
  const Rgb uv = front.albedo(1.1F, 0.55F, 0.4F, 0.4F);
  EXPECT_GT(u.g, 1.5F * u.r);  // red means that the offset was not applied
  EXPECT_GT(u.g, 1.5F * u.b);
  EXPECT_GT(v.b, 1.5F * v.r);
  EXPECT_GT(uv.g, 1.3F * uv.r);
  EXPECT_GT(uv.b, 1.3F * uv.r);
  const auto distance_to_dark = [&front](Vec3 marker) {
    float nearest = 1e9F;
    for (int row = 0; row < kHeight; ++row) {
      for (int column = 0; column < kWidth; ++column) {
        const core::AuxPixel aux = front.aux(column, row);
        if (aux.hits == 16 && core::luminance(aux.albedo) < 0.25F && front.world_y(row) < 0) {
          nearest = std::min(
              nearest, std::hypot(front.world_x(column) - marker.x, front.world_y(row) - marker.y));
        }
      }
    }
    return nearest;
  };
  EXPECT_EQ(right.size(), 3U);
  for (const Vec3 marker : right) {
    EXPECT_LT(distance_to_dark(marker), 0.21F) << marker.x;  // the tip, and half of the marker
  }
  for (const Vec3 marker : wrong) {
    EXPECT_GT(distance_to_dark(marker), 0.21F) << marker.x;
  }
}

TEST_F(Assets, UnlitTestShowsItsExactColors) {
  const Front front(load("UnlitTest.glb"), 2, {0, 0, 9});
  const float g = 0.217637640824031F;  // of both base colour factors
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(front.radiance(-1.2F, 0)[c], (Rgb{1, g, 0}[c]), 1e-5F);
    EXPECT_NEAR(front.radiance(1.2F, 0)[c], (Rgb{0, g, 1}[c]), 1e-5F);
  }
}

TEST_F(Assets, BoxVertexColorsShowsTheColorsOfItsCorners) {
  const core::SceneDescription scene = load("BoxVertexColors.glb");
  const Front front(scene, 0.6F, {0, 0, 5});
  const auto& p = scene.meshes[0].primitives[0];
  const core::Transform& m = scene.instances[0].to_world;
  int corners = 0;
  for (std::size_t i = 0; i < p.positions.size(); ++i) {
    const Vec3 at = m.point(p.positions[i]);
    if (at.z > 0.49F && m.normal(p.normals[i]).z > 0.9F) {
      const Rgb seen = front.at(at.x * 0.97F, at.y * 0.97F).albedo;
      // The albedo is the colour reduced by the 4% specular reflection, plus that reflection:
      // within 0.1.
      const Rgb factor = scene.materials[0].base_color;
      EXPECT_NEAR(seen.r, factor.r * p.colors[i].x, 0.1F);
      EXPECT_NEAR(seen.g, factor.g * p.colors[i].y, 0.1F);
      EXPECT_NEAR(seen.b, factor.b * p.colors[i].z, 0.1F);
      ++corners;
    }
  }
  EXPECT_GE(corners, 4);
}

TEST_F(Assets, MirroredTangentsShowBumpsAndHollows) {
  // make_gen.py: a hemisphere in the normal map, on quads of 0.9 m. The third has w = -1 (green
  // inverted), the eighth a scale of -1 (hollow); all other kinds of mirroring leave a bump a bump.
  const Front front(load("gen_mirrored_tangents.glb"), 2.2F, {0, -0.5F, 5});
  for (int i = 0; i < 9; ++i) {
    const float x = i == 8 ? 0.0F : static_cast<float>(i % 4) - 1.5F;
    const float y = i == 8 ? -1.5F : 0.5F - static_cast<float>(i / 4);
    const float right = i == 7 ? -1.0F : 1.0F;
    const float up = i == 7 || i == 2 ? -1.0F : 1.0F;
    for (const float s : {-0.2F, 0.2F}) {
      EXPECT_GT(right * s * front.at(x + s, y).normal_world.x, 0.02F) << "tile " << i;
      EXPECT_GT(up * s * front.at(x, y + s).normal_world.y, 0.02F) << "tile " << i;
    }
  }
}

TEST_F(Assets, AlphaModesCoverTheFractionOfTheirTextures) {
  // make_gen.py: alpha falls from the centre as 1.2 - r / 32 texels, on quads of 0.9 m, 0.5 m in
  // front of a wall.
  const Front front(load("gen_alpha_modes.glb"), 2.0F, {0, 0, 5});
  const auto expected = [](float factor, float cutoff) {
    double sum = 0;
    for (int y = 0; y < 64; ++y) {
      for (int x = 0; x < 64; ++x) {
        const double byte = std::floor(255 * (1.2 - std::hypot(x - 31.5, y - 31.5) / 32));
        const double alpha = std::clamp(byte, 0.0, 255.0) / 255 * static_cast<double>(factor);
        sum += cutoff < 0 ? alpha : (alpha >= static_cast<double>(cutoff) ? 1 : 0);
      }
    }
    return sum / (64 * 64);
  };
  const double whole = 1;
  const double cases[6] = {whole, expected(1, 0.5F), expected(0.95F, 0.9F), whole,
                           0,     expected(1, -1)};
  for (int i = 0; i < 6; ++i) {
    const float x = static_cast<float>(i % 5) - 2;
    const float y = 0.5F - static_cast<float>(i / 5);
    // The square metre around each quad is 18 x 18 pixels. Hits are random in the 72 pixels on the
    // edges of the quad, and everywhere on a blended quad: 16 samples each.
    const auto depth = static_cast<double>(front.mean_depth(x, y, 0.5F));
    EXPECT_NEAR((5.5 - depth) / 0.5 / (0.9 * 0.9), cases[i], 0.03) << "case " << i;
  }
}

TEST_F(Assets, CornellBoxBleedsRedAndGreen) {
  const Picture picture = test_support::render(view_of(load("CornellBox.glb"), nullptr), 64);
  const auto mean = [&picture](int x0, int x1, int y0, int y1) {
    Rgb sum;
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        sum += test_support::pixel(picture, x, y);
      }
    }
    return sum;
  };
  double red = 0;
  double green = 0;
  for (int x = 0; x < kWidth; ++x) {
    const Rgb c = mean(x, x + 1, 25, 45);
    (x < kWidth / 2 ? red : green) += static_cast<double>(x < kWidth / 2 ? c.r - c.g : c.g - c.r);
  }
  EXPECT_GT(red, 0);
  EXPECT_GT(green, 0);
}

TEST_F(Assets, TenThousandInstancesShareOneMesh) {
  const auto scene = test_support::build(load("gen_instanced_10k.glb"));
  EXPECT_EQ(scene->summary().instances, 10'000U);
  EXPECT_GT(scene->summary().triangles, 5'000'000U);
  EXPECT_LT(scene->summary().bytes, std::size_t{40} << 20);
}

/// Block means of an image and their variances (from the halves), for encodings of one asset.
struct Blocks {
  std::vector<double> mean;
  std::vector<double> variance;
};

Blocks blocks_of(const Picture& picture) {
  constexpr int kSide = 12;
  Blocks out;
  for (int by = 0; by < kHeight / kSide; ++by) {
    for (int bx = 0; bx < kWidth / kSide; ++bx) {
      for (int c = 0; c < 3; ++c) {
        double sum = 0;
        double square = 0;
        for (int i = 0; i < kSide * kSide; ++i) {
          const auto at =
              static_cast<std::size_t>((by * kSide + i / kSide) * kWidth + bx * kSide + i % kSide);
          const auto a = static_cast<double>(core::half_value(picture.snapshot, at, 0).mean[c]);
          const auto b = static_cast<double>(core::half_value(picture.snapshot, at, 1).mean[c]);
          sum += (a + b) / 2;
          square += (a - b) * (a - b) / 4;
        }
        out.mean.push_back(sum / (kSide * kSide));
        out.variance.push_back(square / (kSide * kSide) / (kSide * kSide));
      }
    }
  }
  return out;
}

/// Returns the largest z over 48 blocks and 3 channels, with a tolerance for lossy encodings.
double greatest_z(const Blocks& a, const Blocks& b, double tolerance) {
  double z = 0;
  for (std::size_t i = 0; i < a.mean.size(); ++i) {
    const double difference = std::max(0.0, std::fabs(a.mean[i] - b.mean[i]) - tolerance);
    z = std::max(z, difference / (std::sqrt(a.variance[i] + b.variance[i]) + 1e-6));
  }
  return z;
}

TEST_F(Assets, EncodingsOfOneAssetRenderTheSameImage) {
  struct Pair {
    const char* plain;
    const char* encoded;
    double tolerance;
    bool same;
  };
  // 144 numbers per pair, 5 standard deviations: one false alarm in 2000 runs. The tolerances allow
  // for lossy textures and positions, and for logos that were redrawn at 128, 211 and 256 pixels:
  // 0.03 where outlines cross a block. The last two are planted faults that must fail: a texture
  // whose colours are 8/255 darker (glTF ignores its ICC profile), and the box with a shiny
  // material.
  const Pair pairs[] = {
      {"BoxTextured_webp/box-textured-with-fallback.gltf", "BoxTextured_webp_embedded.gltf", 0,
       true},
      {"BoxTextured_webp/box-textured-with-fallback.gltf", "BoxTextured_meshopt.glb", 0.03, true},
      {"BoxTextured_embedded.gltf", "BoxTextured_meshopt.glb", 0.03, true},
      {"2CylinderEngine.glb", "2CylinderEngine_draco.glb", 0.01, true},
      {"BoxTextured_embedded.gltf", "BoxTextured/BoxTextured.gltf", 0.03, false},
      {"BoxTextured_embedded.gltf", "BoxTextured_specgloss.glb", 0.03, false},
  };
  const auto light = sky();
  for (const Pair& pair : pairs) {
    const core::View a = view_of(load(pair.plain), light);
    core::View b = view_of(load(pair.encoded), light);
    b.settings.seed = 1;
    const double z = greatest_z(blocks_of(test_support::render(a, 64)),
                                blocks_of(test_support::render(b, 64)), pair.tolerance);
    EXPECT_EQ(z < 5, pair.same) << pair.encoded << ": z = " << z;
  }
}

TEST_F(Assets, WritingAGlbKeepsTheImage) {
  // External files, interleaved and sparse views, and instances are written again as plain
  // accessors in one file.
  const auto light = sky();
  for (const char* name : {"BoxTextured/BoxTextured.gltf", "BoxInterleaved.glb",
                           "SimpleSparseAccessor/SimpleSparseAccessor.gltf", "SimpleInstancing.glb",
                           "MultiUVTest.glb"}) {
    const core::SceneDescription scene = load(name);
    const core::View a = view_of(test_support::load(core::write_glb(scene)), light);
    core::View b = view_of(scene, light);
    b.settings.seed = 1;
    EXPECT_LT(greatest_z(blocks_of(test_support::render(a, 64)),
                         blocks_of(test_support::render(b, 64)), 0),
              5)
        << name;
  }
}

TEST_F(Assets, AnimationsMoveTheirTargets) {
  // Renders at rest and later: the image changes, and the same time gives the same image.
  for (const char* name : {"Fox.glb", "AnimatedMorphCube.glb", "InterpolationTest.glb"}) {
    const auto depth_sum = [&](double seconds) {
      core::GltfOptions options;
      options.time_seconds = seconds;
      auto scene = test_support::load_asset(folder_ / name, options);
      EXPECT_TRUE(scene);
      core::View view = view_of(*std::move(scene), nullptr);
      view.settings.max_depth = 0;
      const Vec3 middle = std::string(name) == "Fox.glb" ? Vec3{0, 40, 0} : Vec3{};
      const float away = std::string(name) == "Fox.glb" ? 300.0F : 20.0F;
      test_support::look_at(view, middle + Vec3{0, 0, away}, middle, 40);
      double sum = 0;
      for (const core::AuxPixel& aux : test_support::render(view, 2).snapshot.aux) {
        sum += static_cast<double>(aux.depth_m);
      }
      return sum;
    };
    EXPECT_EQ(depth_sum(0.25), depth_sum(0.25)) << name;
    EXPECT_NE(depth_sum(0), depth_sum(0.45)) << name;
  }
}

}  // namespace
