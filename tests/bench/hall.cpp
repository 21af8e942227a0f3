#include "tests/bench/hall.h"

#include <cmath>
#include <functional>

#include "core/math/numbers.h"

namespace bench {
namespace {

using core::Vec2;
using core::Vec3;

/// A checked and speckled 512x512 texture; `seed` varies it.
std::shared_ptr<const core::Image> texture(unsigned seed) {
  auto image = std::make_shared<core::Image>();
  image->width = image->height = 512;
  image->channels = 3;
  image->bytes.resize(512 * 512 * 3);
  unsigned state = seed * 2654435761U + 1;
  for (int y = 0; y < 512; ++y) {
    for (int x = 0; x < 512; ++x) {
      state = state * 1664525U + 1013904223U;
      const unsigned base = ((x / 64 + y / 64) % 2 == 0 ? 150U : 210U) + (state >> 28);
      for (std::size_t c = 0; c < 3; ++c) {
        const unsigned tint = (seed >> (4 * c)) & 15U;
        image->bytes[(static_cast<std::size_t>(y) * 512 + static_cast<std::size_t>(x)) * 3 + c] =
            static_cast<std::byte>(base - 3 * tint);
      }
    }
  }
  return image;
}

/// A grid of n x m quads over [0,1]^2, mapped by `at`.
core::PrimitiveDescription grid(int n, int m, int material, const std::function<Vec3(Vec2)>& at) {
  core::PrimitiveDescription p;
  p.material = material;
  const auto points = static_cast<std::size_t>((n + 1) * (m + 1));
  p.positions.reserve(points + 1);  // Scene::build() adds one
  p.normals.reserve(points);
  p.uv[0].reserve(points);
  p.indices.reserve(static_cast<std::size_t>(6 * n * m));
  for (int i = 0; i <= n; ++i) {
    for (int k = 0; k <= m; ++k) {
      const Vec2 uv = {static_cast<float>(i) / static_cast<float>(n),
                       static_cast<float>(k) / static_cast<float>(m)};
      const float e = 1e-3F;
      const Vec3 du = at({uv.x + e, uv.y}) - at({uv.x - e, uv.y});
      const Vec3 dv = at({uv.x, uv.y + e}) - at({uv.x, uv.y - e});
      p.positions.push_back(at(uv));
      p.normals.push_back(core::normalize_or(cross(du, dv), {0, 1, 0}));
      p.uv[0].push_back(uv * 4.0F);
    }
  }
  for (int i = 0; i < n; ++i) {
    for (int k = 0; k < m; ++k) {
      const auto a = static_cast<std::uint32_t>(i * (m + 1) + k);
      const auto b = a + static_cast<std::uint32_t>(m + 1);
      p.indices.insert(p.indices.end(), {a, b, b + 1, a, b + 1, a + 1});
    }
  }
  return p;
}

float bump(float x, float y) {
  return 0.02F * (std::sin(40 * x) * std::cos(33 * y) + 0.5F * std::sin(91 * x + 57 * y));
}

}  // namespace

core::SceneDescription hall(float fineness) {
  const auto fine = [fineness](int n) {
    return static_cast<int>(std::lround(static_cast<float>(n) * fineness));
  };
  core::SceneDescription scene;
  for (unsigned i = 0; i < 4; ++i) {
    scene.images.push_back(texture(0x159U * (i + 1)));
    core::MaterialDescription m;
    m.metallic = i == 3 ? 1.0F : 0.0F;
    m.roughness = 0.35F + 0.15F * static_cast<float>(i);
    m.base_color_texture.image = static_cast<int>(i);
    scene.materials.push_back(m);
  }
  scene.meshes.emplace_back();
  auto& parts = scene.meshes.back().primitives;
  parts.push_back(grid(fine(200), fine(300), 0, [](Vec2 t) {  // floor, 20 x 40 m
    return Vec3{20 * t.x - 10, bump(t.x, t.y), 20 - 40 * t.y};
  }));
  for (const float side : {-1.0F, 1.0F}) {  // walls with window openings above 5 m
    parts.push_back(grid(fine(150), fine(60), 1, [side](Vec2 t) {
      const float along = side > 0 ? t.x : 1 - t.x;
      return Vec3{side * (10 + bump(t.x, t.y)), 5 * t.y, 40 * along - 20};
    }));
  }
  for (int i = 0; i < 7; ++i) {  // ribs of the roof: the sky is visible between them
    const float z0 = -18 + 6 * static_cast<float>(i);
    parts.push_back(grid(fine(120), fine(24), 2, [z0](Vec2 t) {
      const float phi = core::kPi * t.x;
      const float r = 10 + 0.3F * std::sin(core::kPi * t.y);
      return Vec3{-r * std::cos(phi), 5 + 4 * std::sin(phi), z0 + 2 - 2 * t.y};
    }));
  }
  for (int i = 0; i < 14; ++i) {  // columns
    const float x = i % 2 == 0 ? -6.0F : 6.0F;
    const float z = -18 + 6 * static_cast<float>(i / 2);
    parts.push_back(grid(fine(96), fine(64), i % 4 == 3 ? 3 : 1, [x, z](Vec2 t) {
      const float phi = core::kTwoPi * t.x;
      const float r = 0.6F + 0.06F * std::cos(16 * phi) + 0.15F * std::pow(2 * t.y - 1, 6.0F);
      return Vec3{x + r * std::cos(phi), 6 * t.y, z - r * std::sin(phi)};
    }));
  }
  scene.instances.push_back({0, {}});
  core::CameraDescription camera;
  camera.name = "camera";
  camera.vertical_fov_rad = 1.0F;
  camera.to_world.t = {1, 2, 17};
  scene.cameras.push_back(camera);
  return scene;
}

}  // namespace bench
