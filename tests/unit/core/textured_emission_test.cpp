// Which triangles of a textured emitter are lights, and the power that light samplers assign to
// them.

#include <gtest/gtest.h>

#include "core/light_samplers/emitted_light.h"
#include "core/scene/scene_data.h"
#include "core/textures/marked_blocks.h"
#include "tests/support/scenes.h"
#include "tests/support/statistics.h"

namespace {

using core::Rgb;
using core::TextureWrap;
using core::Vec2;
using core::Vec3;

constexpr int kSize = 64;

/// Black except for one texel.
std::shared_ptr<const core::Image> dot_at(int x, int y) {
  auto image = std::make_shared<core::Image>();
  image->width = image->height = kSize;
  image->channels = 3;
  image->bytes.resize(std::size_t{kSize} * kSize * 3);
  for (int c = 0; c < 3; ++c) {
    image->bytes[static_cast<std::size_t>((y * kSize + x) * 3 + c)] = std::byte{255};
  }
  return image;
}

/// A grid of n x n squares over [0,1]^2 at height 1, facing down, with the emission of the image.
std::shared_ptr<const core::Scene> ceiling(int n, std::shared_ptr<const core::Image> image) {
  auto material = test_support::emitter(Rgb(2));
  material.emissive_texture.image = 0;
  core::PrimitiveDescription grid;
  grid.material = 0;
  for (int z = 0; z <= n; ++z) {
    for (int x = 0; x <= n; ++x) {
      const Vec2 at = {static_cast<float>(x) / static_cast<float>(n),
                       static_cast<float>(z) / static_cast<float>(n)};
      grid.positions.push_back({at.x, 1, at.y});
      grid.uv[0].push_back(at);
    }
  }
  const auto corner = [n](int x, int z) { return static_cast<std::uint32_t>(z * (n + 1) + x); };
  for (int z = 0; z < n; ++z) {
    for (int x = 0; x < n; ++x) {
      for (const auto& [dx, dz] : {std::pair{0, 0}, std::pair{1, 0}, std::pair{0, 1},
                                   std::pair{1, 0}, std::pair{1, 1}, std::pair{0, 1}}) {
        grid.indices.push_back(corner(x + dx, z + dz));
      }
    }
  }
  core::SceneDescription scene = test_support::scene_of({material}, {grid});
  scene.images.push_back(std::move(image));
  return test_support::build(std::move(scene));
}

TEST(TexturedEmission, OnlyTrianglesWithANonBlackTexelAreLights) {
  const auto scene = ceiling(16, dot_at(20, 40));
  const core::SceneData& data = scene->data();
  ASSERT_EQ(data.triangle_lights.size(), 512U);
  int shining = 0;
  for (std::uint32_t i = 0; i < 512; ++i) {
    const bool shines = !core::is_black(data.triangle_lights[i].radiance);
    shining += shines ? 1 : 0;
    EXPECT_EQ(data.light_tree.prob_light({0.5F, 0, 0.5F}, {0, 1, 0}, i) > 0, shines) << i;
  }
  EXPECT_GT(shining, 0);
  EXPECT_LE(shining,
            4 * 4 * 2);  // blocks of 8 texels plus the bilinear footprint: 4 squares wide
}

// A triangle missing from the light sampler would lose light with strategy light and in paths from
// lights.
TEST(TexturedEmission, NoEmittingPointIsOnABlackTriangle) {
  for (const auto& [x, y] : {std::pair{0, 0}, std::pair{63, 63}, std::pair{31, 32}}) {
    const auto scene = ceiling(13, dot_at(x, y));
    const core::SceneData& data = scene->data();
    test_support::Random random(3);
    int seen = 0;
    for (int i = 0; i < 400000; ++i) {
      const auto light = static_cast<std::uint32_t>(random.bits() % data.triangle_lights.size());
      const Vec2 u = random.uniform_2d();
      const Vec2 b = u.x + u.y < 1 ? u : Vec2{1 - u.x, 1 - u.y};
      const core::TriangleLight& t = data.triangle_lights[light];
      const Vec3 place = t.p0 + t.edge1 * b.x + t.edge2 * b.y;
      if (!core::is_black(core::triangle_radiance(data, t, place, t.normal))) {
        ++seen;
        ASSERT_FALSE(core::is_black(t.radiance)) << light;
      }
    }
    EXPECT_GT(seen, 50);
  }
}

TEST(TexturedEmission, MeanEqualsThatOfTheTexels) {
  // Half of the image at 1, in stripes finer than the points at which a triangle is evaluated.
  auto image = std::make_shared<core::Image>();
  image->width = image->height = kSize;
  image->channels = 3;
  for (int y = 0; y < kSize; ++y) {
    for (int x = 0; x < kSize; ++x) {
      image->bytes.insert(image->bytes.end(), 3, static_cast<std::byte>(x % 2 == 0 ? 255 : 0));
    }
  }
  const auto scene = ceiling(2, image);
  for (const core::TriangleLight& t : scene->data().triangle_lights) {
    EXPECT_NEAR(t.radiance.g, 2 * 0.5F, 0.01F);
  }
}

TEST(TexturedEmission, FaintDotInALargeTriangleIsALight) {
  const auto scene = ceiling(1, dot_at(5, 5));
  const core::SceneData& data = scene->data();
  EXPECT_GT(data.light_tree.prob_light({0.5F, 0, 0.5F}, {0, 1, 0}, 0), 0);
  EXPECT_GT(core::luminance(data.triangle_lights[0].radiance), 0);
}

core::MarkedBlocks colored(const core::Texture& texture) {
  return {texture, [&texture](int x, int y) { return !texture.is_black(x, y); }};
}

TEST(MarkedBlocks, WrapLikeTheTexture) {
  const auto texture = core::Texture::create(*dot_at(60, 60), true);
  const core::MarkedBlocks blocks = colored(*texture);
  const auto is_black = [&blocks](float from, float to, TextureWrap mode) {
    return !blocks.has_mark({from, from}, {to, to}, mode, mode);
  };
  EXPECT_TRUE(is_black(0.1F, 0.4F, TextureWrap::kRepeat));
  EXPECT_FALSE(is_black(0.9F, 0.96F, TextureWrap::kRepeat));
  EXPECT_FALSE(is_black(-0.1F, 0.1F, TextureWrap::kRepeat));  // also reads the opposite end
  EXPECT_TRUE(is_black(-0.1F, 0.1F, TextureWrap::kClampToEdge));
  EXPECT_TRUE(is_black(-0.1F, 0.1F, TextureWrap::kMirroredRepeat));
  EXPECT_FALSE(is_black(1.02F, 1.1F, TextureWrap::kMirroredRepeat));
  EXPECT_FALSE(is_black(0, 7, TextureWrap::kRepeat));
  EXPECT_FALSE(is_black(std::nanf(""), std::nanf(""), TextureWrap::kRepeat));
}

TEST(MarkedBlocks, BlackTextureIsBlackEverywhere) {
  auto image = std::make_shared<core::Image>(*dot_at(0, 0));
  image->bytes.assign(image->bytes.size(), std::byte{0});
  const auto texture = core::Texture::create(*image, true);
  EXPECT_FALSE(
      colored(*texture).has_mark({-9, -9}, {9, 9}, TextureWrap::kRepeat, TextureWrap::kRepeat));
}

}  // namespace
